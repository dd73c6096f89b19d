"""Inversion of the output model by Newton's method, made safe by a bracket.

In units of local g and divided by the scale factor, equation (1) is a cubic in a_i:

    Y/K1 - k0 - delta a_p = (1 + delta_ip a_p) a_i + k2 a_i^2 + k3 a_i^3

It is solved on its branch through zero, where the output rises with the acceleration.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["CLOSE", "FARTHEST", "MOST_STEPS", "invert", "rising_branch", "slope"]

Array = NDArray[np.float64]

FARTHEST = 1e4
"""No solution is looked for beyond this acceleration [g]."""

CLOSE = 1e-9
"""A step of this size, relative to 1 g or to the solution, is the last: the next would be its
square times k2 or k3."""

MOST_STEPS = 100
"""More steps than halving the bracket down to rounding takes."""


def invert(target: ArrayLike, linear: ArrayLike, second: float, third: float) -> Array:
    """Solve target = linear a + second a^2 + third a^3 on the branch through zero.

    Parameters
    ----------
    target : array_like, shape (n,)
        Left side [g].
    linear : array_like
        Coefficient of a; it broadcasts [1].
    second, third : float
        Coefficients of a^2 [1/g] and of a^3 [1/g^2].

    Returns
    -------
    ndarray, shape (n,)
        The solution a [g], NaN where the branch does not reach the target.

    Notes
    -----
    Newton's method; a step that leaves the bracket is replaced by halving the bracket. Each sample
    stops by itself, so its result does not depend on the other samples.

    Examples
    --------
    >>> invert([0.0, 1.01, 1e9], 1.0, 0.01, 0.0).round(12).tolist()
    [0.0, 1.0, nan]
    """
    target, linear = np.asarray(target, dtype=np.float64), np.asarray(linear, dtype=np.float64)
    low, high = rising_branch(linear, second, third)
    solvable = (_cubic(low, linear, second, third) <= target) & (
        target <= _cubic(high, linear, second, third)
    )
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        a = np.clip(target / linear, low, high)
        done = ~solvable
        for _ in range(MOST_STEPS):
            excess = _cubic(a, linear, second, third) - target
            low, high = np.where(excess <= 0.0, a, low), np.where(excess >= 0.0, a, high)
            new = a - excess / slope(a, linear, second, third)
            new = np.where((low <= new) & (new <= high), new, 0.5 * (low + high))
            near = np.abs(new - a) <= CLOSE * (1.0 + np.abs(a))
            a = np.where(done, a, new)
            done |= near
            if done.all():
                break
    return np.where(solvable & done, a, np.nan)


def rising_branch(linear: ArrayLike, second: float, third: float) -> tuple[Array, Array]:
    """Ends of the branch through zero on which linear a + second a^2 + third a^3 rises.

    Parameters
    ----------
    linear : array_like
        Coefficient of a [1].
    second, third : float
        Coefficients of a^2 [1/g] and of a^3 [1/g^2].

    Returns
    -------
    lowest, highest : ndarray
        Ends, at most `FARTHEST` away; NaN where the branch does not rise at zero [g].

    Notes
    -----
    The ends are the zeros of linear + 2 second a + 3 third a^2 next to a = 0. With u = 1/a they are
    those of linear u^2 + 2 second u + 3 third, which has no small divisor.

    Examples
    --------
    >>> [float(end) for end in rising_branch(1.0, 0.0, -1 / 300)]
    [-10.0, 10.0]
    """
    linear = np.asarray(linear, dtype=np.float64)
    rising = np.where(linear > 0.0, linear, np.nan)
    inside = second * second - 3.0 * third * rising
    root = np.sqrt(np.maximum(inside, 0.0))
    upper = np.where(inside >= 0.0, (root - second) / rising, 0.0)
    lower = np.where(inside >= 0.0, (-root - second) / rising, 0.0)
    highest = 1.0 / np.maximum(upper, 1.0 / FARTHEST)
    lowest = 1.0 / np.minimum(lower, -1.0 / FARTHEST)
    return np.where(linear > 0.0, lowest, np.nan), np.where(linear > 0.0, highest, np.nan)


def slope(a: Array, linear: Array, second: float, third: float) -> Array:
    """Derivative of linear a + second a^2 + third a^3.

    Parameters
    ----------
    a : ndarray
        Acceleration [g].
    linear : ndarray
        Coefficient of a [1].
    second, third : float
        Coefficients of a^2 [1/g] and of a^3 [1/g^2].

    Returns
    -------
    ndarray
        The derivative [1].
    """
    return np.asarray((3.0 * third * a + 2.0 * second) * a + linear)


def _cubic(a: Array, linear: Array, second: float, third: float) -> Array:
    return np.asarray(((third * a + second) * a + linear) * a)
