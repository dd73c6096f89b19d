"""Quantiles and tail probabilities of Student's t and Fisher's F.

scipy.special has both, but importing it takes longer than all the rest of a fit of one table, so
the one function they need, the regularised incomplete beta function, stands here. The tests hold
it against scipy.

The coverage factor of a band that holds everywhere along a curve, and not at each point alone, is
here too. A curve of estimates moves, over its standard uncertainty, along a path on the unit sphere
of its errors. With kappa the length of that path,

    P(max |t| > c) <= P(|t| > c) + kappa / pi (1 + c^2 / dof)^(-dof / 2)

(Naiman 1986; the tube formula of Sun and Loader 1994). Scheffe's factor holds for all combinations
of the errors, of which the curve is a few, and is wider.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from accelcal.errors import InputError

Array = NDArray[Any]
Number = Any  # a float, or an array of them: what both can do is written once

LEVEL = 0.95
"""Probability of all intervals that are told, and so of every expanded uncertainty."""

LEAST_CHANCE = 1e-15
"""A p-value below this is told as no more than that."""

_TINY = 1e-300  # in place of zero in a denominator
_SETTLED = 1e-15  # relative change that ends a continued fraction
_AS_GOOD_AS_INFINITE = 1e15  # degrees of freedom: to the last digits
_WORTH_ARRAYS = 24  # fewer numbers are faster one by one


def _regularised_beta(a: Number, b: Number, x: Number, y: Number) -> Number:
    """Regularised incomplete beta function I_x(a, b); y = 1 - x keeps the digits where x is near 1.

    Of numbers, or of arrays x and y of one shape with a and b either way. The continued fraction is
    (DLMF 8.17.22) contracted to its even part, as in TOMS 708; its terms hold y and not 1 - x, so
    that large a lose no digits.
    """
    turned = (x * (a + b + 2.0) > a + 1.0) & (y > 0.0)
    if isinstance(x, float):
        if x <= 0.0 or y <= 0.0:
            return float(x > 0.0)
        tail = _regularised_beta_tail(*((b, a, y, x) if turned else (a, b, x, y)))
        return 1.0 - tail if turned else tail
    found = np.where(x > 0.0, 1.0, 0.0)  # where x or y is 0
    within = (x > 0.0) & (y > 0.0)
    for own, is_turned in ((within & ~turned, False), (within & turned, True)):
        if own.any():
            at = [value if isinstance(value, float) else value[own] for value in (a, b, x, y)]
            if is_turned:
                found[own] = 1.0 - _regularised_beta_tail(at[1], at[0], at[3], at[2])
            else:
                found[own] = _regularised_beta_tail(*at)
    return found


def _regularised_beta_tail(a: Number, b: Number, x: Number, y: Number) -> Number:
    c = fraction = a * (a * y - b * x + 1.0) / (a + 1.0) + _TINY
    d = 0.0
    for m in range(1, 10_000):
        before = a + (2 * m - 1)
        numerator = (a + (m - 1)) / before * ((a + b + (m - 1)) / before) * m * (b - m) * x * x
        term = m + m * (b - m) * x / before
        term = term + (a + m) * (a * y - b * x + 1.0 + m * (1.0 + y)) / (before + 2)
        d = 1.0 / (term + numerator * d + _TINY)  # modified Lentz method
        c = term + numerator / c + _TINY
        factor = c * d
        fraction = fraction * factor
        away = abs(factor - 1.0)
        if (away if isinstance(away, float) else np.fmax.reduce(away)) < _SETTLED:
            break
    return _beta_density(a, b, x, y) / fraction


def _beta_density(a: Number, b: Number, x: Number, y: Number) -> Number:
    """x^a y^b / B(a, b), with Stirling's formula taken out, which cancels for large a and b."""
    n = a + b
    excess = b * x - a * y  # n x - a, without its loss of digits
    exponent = _log_power(a, excess, n * x) + _log_power(b, -excess, n * y)
    rest = _beyond_stirling(n) - _beyond_stirling(a) - _beyond_stirling(b)
    if isinstance(x, float):
        return math.sqrt(a / n * b / (2.0 * math.pi)) * math.exp(exponent + rest)
    return np.sqrt(a / n * b / (2.0 * math.pi)) * np.exp(exponent + rest)


def _log_power(a: Number, excess: Number, total: Number) -> Number:
    """Logarithm of (total / a)^a, where total = a + excess."""
    if isinstance(total, float):
        return a * (math.log1p(excess / a) if abs(excess) < 0.5 * a else math.log(total / a))
    near = np.abs(excess) < 0.5 * a
    return a * np.where(near, np.log1p(np.where(near, excess / a, 0.0)), np.log(total / a))


def _beyond_stirling(z: Number) -> Number:
    """Logarithm of the gamma function minus Stirling's formula."""
    if not isinstance(z, float):
        values = sorted(set(z.tolist()))  # few different degrees of freedom in a large array
        each = np.array([_beyond_stirling(value) for value in values])
        return each[np.searchsorted(values, z)]
    if z < 16.0:
        return math.lgamma(z) - ((z - 0.5) * math.log(z) - z + 0.5 * math.log(2.0 * math.pi))
    w = 1.0 / (z * z)
    return (1 / 12 - w * (1 / 360 - w * (1 / 1260 - w * (1 / 1680 - w / 1188)))) / z  # DLMF 5.11.1


def student_survival(t: float, dof: float) -> float:
    """Probability that Student's t exceeds a value; that of the normal one with infinite dof.

    Examples
    --------
    >>> round(student_survival(4.302653, 2), 6)
    0.025
    """
    if dof > _AS_GOOD_AS_INFINITE:
        return 0.5 * math.erfc(t / math.sqrt(2.0))
    ratio = t * t / dof
    parts = 1.0 / (1.0 + ratio), ratio / (1.0 + ratio)
    tail = 0.5 * float(_regularised_beta(dof / 2.0, 0.5, *parts))
    return tail if t >= 0 else 1.0 - tail


@lru_cache(maxsize=1024)
def student_quantile(level: float, dof: float) -> float:
    """Two-sided coverage factor of Student's t: t with P(|T| <= t) = `level`.

    Infinite degrees of freedom give the normal distribution.

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
        step = (student_survival(t, dof) - tail) / student_density(t, dof)
        t += step
        if abs(step) <= 1e-9 * t:  # Newton's next step would be about the square of this one
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


def student_density(t: float, dof: float) -> float:
    """Density of Student's t; with infinite dof it is that of the normal distribution.

    Examples
    --------
    >>> round(student_density(0.0, 1.0) * math.pi, 12)
    1.0
    """
    if math.isinf(dof):
        return math.exp(-0.5 * t * t) / math.sqrt(2.0 * math.pi)
    rest = _beyond_stirling((dof + 1.0) / 2.0) - _beyond_stirling(dof / 2.0)
    front = math.exp(rest + 0.5 * dof * math.log1p(1.0 / dof) - 0.5) / math.sqrt(2.0 * math.pi)
    return front * math.exp(-(dof + 1.0) / 2.0 * math.log1p(t * t / dof))


def dof_of_student_quantile(level: float, factor: float) -> float:
    """Degrees of freedom whose two-sided coverage factor has a given value.

    Infinite where it is not above the normal one.

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


@overload
def f_survival(ratio: float, dof1: float, dof2: float) -> float: ...
@overload
def f_survival(ratio: Array, dof1: ArrayLike, dof2: ArrayLike) -> Array: ...
def f_survival(ratio: Number, dof1: Number, dof2: Number) -> Number:
    """Probability that Fisher's F, the ratio of two mean squares, exceeds a value, or values.

    The degrees of freedom of the denominator may be infinite, where the variance is known. Arrays
    broadcast; it is NaN where the ratio of an array is.

    Notes
    -----
    The square of Student's t has Fisher's distribution with 1 and its own degrees of freedom:
    ``f_survival(t**2, 1.0, dof)`` is the two-sided probability.

    Examples
    --------
    >>> round(f_survival(4.0, 2, 46), 6)
    0.025025
    >>> import numpy as np
    >>> f_survival(np.array([1.0, 4.0]), 2, 46).round(6).tolist()
    [0.375735, 0.025025]
    """
    if isinstance(ratio, np.ndarray):
        tests = np.broadcast(ratio, dof1, dof2)
        if tests.size < _WORTH_ARRAYS:
            return np.array([f_survival(*map(float, one)) for one in tests]).reshape(tests.shape)
        return _f_survivals(*np.broadcast_arrays(ratio, dof1, dof2))
    if not 0.0 < ratio < math.inf:
        return ratio if math.isnan(ratio) else float(ratio <= 0.0)
    limited = min(float(dof2), _AS_GOOD_AS_INFINITE)
    odds = float(dof1 * ratio / limited)
    return _regularised_beta(limited / 2.0, dof1 / 2.0, 1.0 / (1.0 + odds), odds / (1.0 + odds))


def _f_survivals(ratio: Array, dof1: Array, dof2: Array) -> Array:
    found = np.where(np.isnan(ratio), np.nan, np.where(ratio > 0.0, 0.0, 1.0))
    within = np.isfinite(ratio) & (ratio > 0.0)
    r, d1, d2 = (np.asarray(part[within], dtype=np.float64) for part in (ratio, dof1, dof2))
    if not r.size:
        return found
    limited = np.minimum(d2, _AS_GOOD_AS_INFINITE)
    odds = d1 * r / limited
    parts = 1.0 / (1.0 + odds), odds / (1.0 + odds)
    found[within] = _regularised_beta(_number(limited / 2.0), _number(d1 / 2.0), *parts)
    return found


def _number(values: Array) -> Number:
    """One number for values that are all alike, which saves most of the work."""
    return float(values[0]) if (values == values[0]).all() else values


@lru_cache(maxsize=1024)
def f_quantile(level: float, dof1: float, dof2: float) -> float:
    """Value that Fisher's F exceeds with a given probability, between 0 and 1, see `f_survival`.

    Examples
    --------
    >>> round(f_quantile(0.05, 2, 46), 4)
    3.1996
    """
    low, high = 0.0, 1.0
    while f_survival(high, dof1, dof2) > level:
        low, high = high, 2.0 * high
    return _root(lambda x: math.log(level / f_survival(x, dof1, dof2)), low, high)


def f_exceeds(level: ArrayLike, ratio: Array, dof1: ArrayLike, dof2: ArrayLike) -> Array:
    """Tell where Fisher's F exceeds a value with less than a given probability.

    That is where ``f_survival(ratio, dof1, dof2) < level``, in the shape of all together.

    Notes
    -----
    The probability falls as the ratio grows. So the ratios of a row that have the same level and
    degrees of freedom are held against their one quantile, without a probability of each.

    Examples
    --------
    >>> import numpy as np
    >>> f_exceeds(0.05, np.array([3.1, 3.3]), 2, 46).tolist()
    [False, True]
    """
    few = ratio.size < _WORTH_ARRAYS
    each = [] if few else np.broadcast_arrays(*map(_one_a_row, (level, dof1, dof2)))
    if few or each[0].size * _WORTH_ARRAYS > ratio.size:
        return np.asarray(f_survival(ratio, dof1, dof2) < level)
    tests = zip(*(values.ravel().tolist() for values in each), strict=True)
    limits = np.array([f_quantile(*test) for test in tests]).reshape(each[0].shape)
    return np.asarray(ratio > limits)


def written_p_value(p: float, least: float = LEAST_CHANCE) -> str:
    """Write a p-value beside a number, one that is too small as below the least.

    Examples
    --------
    >>> written_p_value(0.0123), written_p_value(0.0), written_p_value(1e-9, 1e-3)
    ('p = 0.012', 'p < 1e-15', 'p < 0.001')
    """
    return f"p < {least:g}" if p < least else f"p = {p:.2g}"


def _one_a_row(values: ArrayLike) -> Array:
    array = np.atleast_1d(values)
    first = array[..., :1]
    return first if (array == first).all() else array


NORMAL_FACTOR = student_quantile(LEVEL, math.inf)
"""Expanded over standard uncertainty where that is known with endlessly many degrees of freedom."""


def path_length(covariance: Array) -> float:
    """Length [rad] of the path of n neighbouring points on the unit sphere of their errors.

    It is the sum of the angles between neighbours, from their covariance; a point without any error
    has no place on the path.

    Examples
    --------
    >>> import numpy as np
    >>> path_length(np.ones((3, 3))), round(path_length(np.eye(3)) / np.pi, 12)
    (0.0, 1.0)
    """
    u = np.sqrt(np.diagonal(covariance))
    kept = u > 0.0
    covered = covariance[np.ix_(kept, kept)] / np.outer(u[kept], u[kept])
    return float(np.arccos(np.clip(np.diagonal(covered, 1), -1.0, 1.0)).sum())


@lru_cache(maxsize=1024)
def simultaneous_quantile(level: float, dof: float, length: float) -> float:
    """Two-sided coverage factor of Student's t at all points of a path, of `path_length`, at once.

    c with P(max |T| <= c) >= `level`; Student's factor where the path has no length. Infinite
    degrees of freedom give the normal distribution.

    Raises
    ------
    InputError
        As of `accelcal.numerics.probability.student_quantile`.

    Examples
    --------
    >>> [round(simultaneous_quantile(0.95, float("inf"), length), 3) for length in (0.0, 3.0)]
    [1.96, 2.532]
    """
    c = student_quantile(level, dof)
    for _ in range(200):
        beyond, slope = _of_path(c, dof, length)
        excess = 2.0 * student_survival(c, dof) + beyond - (1.0 - level)
        step = excess / (2.0 * student_density(c, dof) - slope)
        c += step  # from the left of the root of a convex function
        if abs(step) <= 1e-9 * c:
            break
    return c


def _of_path(c: float, dof: float, length: float) -> tuple[float, float]:
    """What the path adds to the probability of a single point, and its slope."""
    bent = 1.0 if math.isinf(dof) else 1.0 + c * c / dof
    tail = math.exp(-0.5 * c * c) if math.isinf(dof) else bent ** (-0.5 * dof)
    return length / math.pi * tail, -length / math.pi * tail * c / bent
