"""The step in which values come, as a voltmeter shows them."""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array, Ints, Mask

_GLANCE = 3
"""Values that are looked at first: mostly they rule out a step that is too large."""

_FEW = 6
"""Values that mostly tell that their differences have no common factor."""

_DIGITS = np.arange(2, 12)
"""Decimals that readings may have where the largest has one digit before the point."""

_LEAST = -40
_POWERS = np.array([float(f"1e{k}") for k in range(_LEAST, -_LEAST)])  # exact as far as can be


def decimal_step(values: Array) -> float:
    """Find the power of ten of which all values are multiples, as a voltmeter shows them.

    It is the largest such step of which the largest value has a hundred, and not 1e12; 0 where
    there is none.

    Examples
    --------
    >>> import numpy as np
    >>> [decimal_step(np.array(values)) for values in ([1.2503, -0.71], [1.3e9, 1e4], [1.0 / 3.0])]
    [0.0001, 10000.0, 0.0]
    """
    return float(decimal_steps(values.reshape(1, -1))[0])


def decimal_steps(values: Array) -> Array:
    """Find the step of `decimal_step` for each row of values, shape (T, n), shape (T,).

    Examples
    --------
    >>> import numpy as np
    >>> decimal_steps(np.array([[1.2503, -0.71], [1.0, 1.0 / 3.0]])).tolist()
    [0.0001, 0.0]
    """
    if len(values) > values.shape[1]:
        values = np.asfortranarray(values)  # to go along many short rows takes longer
    # The largest value must have a hundred steps: values much smaller than a step would all pass
    # for zero times the step.
    largest = np.abs(values).max(axis=1)
    first = np.floor(np.log10(np.where(largest > 0.0, largest, 1.0))).astype(np.int64)
    digits = _DIGITS[:, None] - first
    in_one = _POWERS[digits - _LEAST]
    possible = _whole(in_one[:, None] * values.T[:_GLANCE]).all(axis=1) & (largest > 0.0)
    step = np.zeros(len(values))
    rows = np.flatnonzero(possible.any(axis=0))
    while rows.size:
        first = possible[:, rows].argmax(axis=0)
        own = values if rows.size == len(values) else values[rows]
        found = _whole(own * in_one[first, rows][:, None]).all(axis=1)
        step[rows[found]] = _POWERS[-digits[first, rows][found] - _LEAST]
        possible[first, rows] = False
        rows = rows[~found & possible[:, rows].any(axis=0)]
    return step


def common_steps(values: Array, digit: Array) -> Array:
    """Find the largest step of which all values, shape (n, T), are multiples but for a constant.

    The decimal steps of the values, see `decimal_steps`, are of shape (T,), as the steps are; 0
    where there is none.

    Examples
    --------
    >>> import numpy as np
    >>> common_steps(np.array([[1.25], [0.71], [0.03]]), np.array([0.01])).tolist()
    [0.02]
    """
    factor = _common_factor(values[:_FEW], digit)
    # A common factor of all differences is one of the first few as well: where these have none but
    # 1, the others need no look.
    open_ = np.flatnonzero((factor != 1) & (digit > 0.0))
    factor[open_] = _common_factor(values[:, open_], digit[open_])
    return digit * factor


def _common_factor(values: Array, digit: Array) -> Ints:
    """Greatest common divisor of the differences of the values, counted in digits, (T,)."""
    counts = np.round(values / np.where(digit > 0.0, digit, np.inf)).astype(np.int64)
    return np.asarray(np.gcd.reduce(counts - counts[0], axis=0))


def _whole(values: Array) -> Mask:
    """Tell which values are whole numbers but for rounding errors."""
    away = np.rint(values)
    np.subtract(values, away, out=away)  # in place: it takes the least time of all
    return np.asarray(np.abs(away, out=away) < 1e-4)
