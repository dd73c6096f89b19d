"""Inversion of the output model by Newton's method, made safe by a bracket.

In units of local g and divided by the scale factor, equation (1) is a cubic in a_i:

    Y/K1 - k0 - delta a_p = (1 + delta_ip a_p) a_i + k2 a_i^2 + k3 a_i^3

It is solved on its branch through zero, where the output rises with the acceleration.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arrays import Array, Mask

__all__ = ["CLOSE", "FARTHEST", "MOST_STEPS", "invert", "invert_with"]
__all__ += ["rising_branch", "slope"]

Function = Callable[[Array], Array]
Coefficient = Array | float

FARTHEST = 1e4
"""No solution is looked for beyond this acceleration [g]."""

CLOSE = 1e-9
"""A step of this size, relative to 1 g or to the solution, is the last: the next would be its
square times k2 or k3."""

MOST_STEPS = 100
"""More steps than halving the bracket down to rounding takes."""

_NARROWEST = 1e-6
"""Half width of the first bracket about a solution without effects, at least [g]."""

_DOUBLINGS = 40
"""More than lead from the narrowest to `FARTHEST`."""


def invert(target: ArrayLike, linear: ArrayLike, second: Coefficient, third: Coefficient) -> Array:
    """Solve target = linear a + second a^2 + third a^3 on the branch through zero.

    Parameters
    ----------
    target : array_like, shape (n,)
        Left side [g].
    linear : array_like
        Coefficient of a; it broadcasts [1].
    second, third : ndarray or float
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
        return _root(
            lambda a: _cubic(a, linear, second, third) - target,
            lambda a: slope(a, linear, second, third),
            np.clip(target / linear, low, high),
            (low, high),
            solvable,
        )


def _root(
    excess_of: Function, slope_of: Function, a: Array, ends: tuple[Array, Array], solvable: Mask
) -> Array:
    """Zero of what is negative at the lower end and positive at the upper one, sought from a."""
    low, high = ends
    done = ~solvable
    for _ in range(MOST_STEPS):
        excess = excess_of(a)
        low, high = np.where(excess <= 0.0, a, low), np.where(excess >= 0.0, a, high)
        new = a - excess / slope_of(a)
        new = np.where((low <= new) & (new <= high), new, 0.5 * (low + high))
        near = np.abs(new - a) <= CLOSE * (1.0 + np.abs(a))
        a = np.where(done, a, new)
        done |= near
        if done.all():
            break
    return np.where(solvable & done, a, np.nan)


def invert_with(
    effects: Function, target: Array, linear: ArrayLike, second: Coefficient, third: Coefficient
) -> Array:
    """Solve target = linear a + second a^2 + third a^3 + effects(a), near the solution without.

    Parameters
    ----------
    effects : callable
        Function of a, smaller than a itself; it may have kinks and steps [g].
    target : ndarray, shape (n,)
        Left side [g].
    linear, second, third
        As for `invert`.

    Returns
    -------
    ndarray, shape (n,)
        The solution a [g], NaN where there is none. Where the right side stands still, as in a dead
        zone, any of those there are.

    Examples
    --------
    >>> invert_with(lambda a: 1e-3 * abs(a), np.array([1.001, -0.999]), 1.0, 0.0, 0.0).round(9)
    array([ 1., -1.])
    """
    of_a = np.asarray(linear, dtype=np.float64)

    def excess(a: Array) -> Array:
        return np.asarray(_cubic(a, of_a, second, third) + effects(a) - target)

    def steepness(a: Array) -> Array:
        # by differences over +- CLOSE, so that a kink is smeared over no more than that
        of_effects = (effects(a + CLOSE) - effects(a - CLOSE)) / (2.0 * CLOSE)
        return np.asarray(slope(a, of_a, second, third) + of_effects)

    without = invert(target, linear, second, third)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        low, high, solvable = _around(excess, without, 2.0 * np.abs(effects(without)) + _NARROWEST)
        return _root(excess, steepness, without, (low, high), solvable)


def _around(excess_of: Function, a: Array, width: Array) -> tuple[Array, Array, Mask]:
    """Ends about a with a zero between them, as near as doubling the width finds them."""
    for _ in range(_DOUBLINGS):
        low, high = a - width, a + width
        is_inside = (excess_of(low) <= 0.0) & (excess_of(high) >= 0.0)
        is_inside &= width < FARTHEST
        if np.all(is_inside | ~(width < FARTHEST)):
            break
        width = np.where(is_inside, width, 2.0 * width)
    return low, high, is_inside


def rising_branch(
    linear: ArrayLike, second: Coefficient, third: Coefficient
) -> tuple[Array, Array]:
    """Ends of the branch through zero on which linear a + second a^2 + third a^3 rises.

    Parameters
    ----------
    linear : array_like
        Coefficient of a [1].
    second, third : ndarray or float
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


def slope(a: Array, linear: Array, second: Coefficient, third: Coefficient) -> Array:
    """Derivative of linear a + second a^2 + third a^3.

    Parameters
    ----------
    a : ndarray
        Acceleration [g].
    linear : ndarray
        Coefficient of a [1].
    second, third : ndarray or float
        Coefficients of a^2 [1/g] and of a^3 [1/g^2].

    Returns
    -------
    ndarray
        The derivative [1].
    """
    return np.asarray((3.0 * third * a + 2.0 * second) * a + linear)


def _cubic(a: Array, linear: Array, second: Coefficient, third: Coefficient) -> Array:
    return np.asarray(((third * a + second) * a + linear) * a)
