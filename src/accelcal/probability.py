"""Quantiles and tail probabilities of Student's t and Fisher's F.

scipy.special has both, but importing it takes longer than all the rest of a fit of one table, so
the one function they need, the regularised incomplete beta function, stands here. The tests hold
it against scipy.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

__all__ = ["dof_of_student_quantile", "f_survival", "student_quantile", "student_survival"]

_TINY = 1e-300


def _beta_continued_fraction(a: float, b: float, x: float) -> float:
    """Continued fraction of the incomplete beta function by the modified Lentz method."""
    c = 1.0
    d = 1.0 / _away_from_zero(1.0 - (a + b) * x / (a + 1.0))
    fraction = d
    for m in range(1, 10_000):
        even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m))
        odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1))
        for term in (even, odd):
            d = 1.0 / _away_from_zero(1.0 + term * d)
            c = _away_from_zero(1.0 + term / c)
            fraction *= c * d
        if abs(c * d - 1.0) < 1e-15:
            break
    return fraction


def _away_from_zero(x: float) -> float:
    return x if abs(x) > _TINY else _TINY


def _regularised_beta(a: float, b: float, x: float) -> float:
    """Regularised incomplete beta function I_x(a, b)."""
    if x <= 0.0 or x >= 1.0:
        return 0.0 if x <= 0.0 else 1.0
    log_front = (
        math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b) + a * math.log(x) + b * math.log1p(-x)
    )
    if x < (a + 1.0) / (a + b + 2.0):
        return math.exp(log_front) * _beta_continued_fraction(a, b, x) / a
    return 1.0 - math.exp(log_front) * _beta_continued_fraction(b, a, 1.0 - x) / b


def student_survival(t: float, dof: float) -> float:
    """Probability that Student's t exceeds a value.

    Parameters
    ----------
    t : float
        The value.
    dof : float
        Degrees of freedom, above 0; infinity gives the normal distribution.

    Returns
    -------
    float
        P(T > t).

    Examples
    --------
    >>> round(student_survival(4.302653, 2), 6)
    0.025
    """
    if math.isinf(dof) or dof > 1e8:
        return 0.5 * math.erfc(t / math.sqrt(2.0))
    tail = 0.5 * _regularised_beta(dof / 2.0, 0.5, dof / (dof + t * t))
    return tail if t >= 0 else 1.0 - tail


@lru_cache(maxsize=1024)
def student_quantile(level: float, dof: float) -> float:
    """Two-sided coverage factor of Student's t.

    Parameters
    ----------
    level : float
        Probability of the interval, between 0 and 1.
    dof : float
        Degrees of freedom, above 0; infinity gives the normal distribution.

    Returns
    -------
    float
        t with P(|T| <= t) = `level`.

    Examples
    --------
    >>> round(student_quantile(0.95, 2), 4), round(student_quantile(0.95, float("inf")), 4)
    (4.3027, 1.96)
    """
    tail = 0.5 * (1.0 - level)
    t = 0.0
    for _ in range(200):  # the tail is convex: Newton's steps from the left never overshoot
        step = (student_survival(t, dof) - tail) / _student_density(t, dof)
        t += step
        if step <= 1e-15 * t:
            break
    return t


def _student_density(t: float, dof: float) -> float:
    if math.isinf(dof) or dof > 1e8:
        return math.exp(-0.5 * t * t) / math.sqrt(2.0 * math.pi)
    log_front = math.lgamma((dof + 1.0) / 2.0) - math.lgamma(dof / 2.0)
    return math.exp(log_front - (dof + 1.0) / 2.0 * math.log1p(t * t / dof)) / math.sqrt(
        dof * math.pi
    )


def dof_of_student_quantile(level: float, factor: float) -> float:
    """Degrees of freedom whose two-sided coverage factor has a given value.

    Parameters
    ----------
    level : float
        Probability of the interval.
    factor : float
        Coverage factor.

    Returns
    -------
    float
        Degrees of freedom; infinity where `factor` is not above the normal one.

    Examples
    --------
    >>> round(dof_of_student_quantile(0.95, student_quantile(0.95, 7.0)), 6)
    7.0
    """
    tail = 0.5 * (1.0 - level)
    if student_survival(factor, 1e6) >= tail:
        return math.inf
    return 1.0 / _root(lambda x: student_survival(factor, 1.0 / x) - tail, 1e-6, 100.0)


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    """Root of an increasing function (regula falsi with the Illinois rule)."""
    f_low, f_high = function(low), function(high)
    side = 0
    for _ in range(100):
        x = (low * f_high - high * f_low) / (f_high - f_low)
        value = function(x)
        if value * f_high > 0.0:
            step, high, f_high = high - x, x, value
            f_low, side = (f_low / 2.0 if side == 1 else f_low), 1
        else:
            step, low, f_low = x - low, x, value
            f_high, side = (f_high / 2.0 if side == -1 else f_high), -1
        if value == 0.0 or step < 1e-12 * x:
            break
    return x


def f_survival(ratio: float, dof1: float, dof2: float) -> float:
    """Probability that Fisher's F exceeds a value.

    Parameters
    ----------
    ratio : float
        The ratio of two mean squares.
    dof1, dof2 : float
        Degrees of freedom of numerator and denominator, finite and above 0.

    Returns
    -------
    float
        P(F > ratio).

    Examples
    --------
    >>> round(f_survival(4.0, 2, 46), 6)
    0.025025
    """
    if ratio <= 0:
        return 1.0
    return _regularised_beta(dof2 / 2.0, dof1 / 2.0, dof2 / (dof2 + dof1 * ratio))
