"""Quantiles and tail probabilities of Student's t and Fisher's F.

scipy.special has both, but importing it takes longer than all the rest of a fit of one table, so
the one function they need, the regularised incomplete beta function, stands here. The tests hold
it against scipy.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

from accelcal.errors import InputError

__all__ = ["dof_of_student_quantile", "f_survival", "student_quantile", "student_survival"]

_TINY = 1e-300
_AS_GOOD_AS_INFINITE = 1e15  # degrees of freedom


def _regularised_beta(a: float, b: float, x: float, y: float) -> float:
    """Regularised incomplete beta function I_x(a, b); y = 1 - x keeps the digits where x is near 1.

    The continued fraction is (DLMF 8.17.22) contracted to its even part, as in TOMS 708; its terms
    hold y and not 1 - x, so that large a lose no digits.
    """
    if x <= 0.0:
        return 0.0
    if y <= 0.0:
        return 1.0
    if x * (a + b + 2.0) > a + 1.0:
        return 1.0 - _regularised_beta_tail(b, a, y, x)
    return _regularised_beta_tail(a, b, x, y)


def _regularised_beta_tail(a: float, b: float, x: float, y: float) -> float:
    c = fraction = a * (a * y - b * x + 1.0) / (a + 1.0) or _TINY
    d = 0.0
    for m in range(1, 10_000):
        before = a + 2 * m - 1
        numerator = (a + m - 1) / before * ((a + b + m - 1) / before) * m * (b - m) * x * x
        term = m + m * (b - m) * x / before
        term += (a + m) * (a * y - b * x + 1.0 + m * (1.0 + y)) / (before + 2)
        d = 1.0 / (term + numerator * d or _TINY)  # modified Lentz method
        c = term + numerator / c or _TINY
        fraction *= c * d
        if abs(c * d - 1.0) < 1e-15:
            break
    return _beta_density(a, b, x, y) / fraction


def _beta_density(a: float, b: float, x: float, y: float) -> float:
    """x^a y^b / B(a, b), with Stirling's formula taken out, which cancels for large a and b."""
    n = a + b
    excess = b * x - a * y  # n x - a, without its loss of digits
    exponent = _log_power(a, excess, n * x) + _log_power(b, -excess, n * y)
    rest = _beyond_stirling(n) - _beyond_stirling(a) - _beyond_stirling(b)
    return math.sqrt(a / n * b / (2.0 * math.pi)) * math.exp(exponent + rest)


def _log_power(a: float, excess: float, total: float) -> float:
    """Logarithm of (total / a)^a, where total = a + excess."""
    return a * (math.log1p(excess / a) if abs(excess) < 0.5 * a else math.log(total / a))


def _beyond_stirling(z: float) -> float:
    """Logarithm of the gamma function minus Stirling's formula."""
    if z < 16.0:
        return math.lgamma(z) - ((z - 0.5) * math.log(z) - z + 0.5 * math.log(2.0 * math.pi))
    w = 1.0 / (z * z)
    return (1 / 12 - w * (1 / 360 - w * (1 / 1260 - w * (1 / 1680 - w / 1188)))) / z  # DLMF 5.11.1


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
    if math.isinf(dof):
        return 0.5 * math.erfc(t / math.sqrt(2.0))
    ratio = t * t / dof
    tail = 0.5 * _regularised_beta(dof / 2.0, 0.5, 1.0 / (1.0 + ratio), ratio / (1.0 + ratio))
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

    Raises
    ------
    InputError
        If `level` is not between 0 and 1, or `dof` is not above 0.

    Examples
    --------
    >>> round(student_quantile(0.95, 2), 4), round(student_quantile(0.95, float("inf")), 4)
    (4.3027, 1.96)
    """
    if not 0.0 < level < 1.0:
        raise InputError(f"level {level}; the probability of an interval lies between 0 and 1")
    if not dof > 0.0:
        raise InputError(f"{dof} degrees of freedom; Student's factor needs more than 0")
    tail = 0.5 * (1.0 - level)
    t = 0.0 if math.isinf(dof) else _cornish_fisher(student_quantile(level, math.inf), dof)
    for _ in range(200):
        step = (student_survival(t, dof) - tail) / _student_density(t, dof)
        t += step
        if abs(step) <= 1e-9 * t:  # Newton's next step would be of the order of its square
            break
    return t


def _cornish_fisher(z: float, dof: float) -> float:
    """Student's quantile from the normal one, Abramowitz and Stegun 26.7.5; z for few dof.

    From there, or from the left, Newton's steps converge: the tail is convex.
    """
    if dof < 5.0:
        return z
    first = (z**3 + z) / 4.0
    second = (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / 96.0
    third = (3.0 * z**7 + 19.0 * z**5 + 17.0 * z**3 - 15.0 * z) / 384.0
    return z + (first + (second + third / dof) / dof) / dof


def _student_density(t: float, dof: float) -> float:
    if math.isinf(dof):
        return math.exp(-0.5 * t * t) / math.sqrt(2.0 * math.pi)
    rest = _beyond_stirling((dof + 1.0) / 2.0) - _beyond_stirling(dof / 2.0)
    front = math.exp(rest + 0.5 * dof * math.log1p(1.0 / dof) - 0.5) / math.sqrt(2.0 * math.pi)
    return front * math.exp(-(dof + 1.0) / 2.0 * math.log1p(t * t / dof))


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
        Degrees of freedom of numerator and denominator, above 0; `dof2` may be infinite, where the
        variance is known.

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
    odds = dof1 * ratio / min(dof2, _AS_GOOD_AS_INFINITE)
    parts = 1.0 / (1.0 + odds), odds / (1.0 + odds)
    return _regularised_beta(min(dof2, _AS_GOOD_AS_INFINITE) / 2.0, dof1 / 2.0, *parts)
