"""Uncertainty of what follows from the coefficients: their covariance carried through Jacobians."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arrays import Array
from accelcal.estimate.uncertainty import Intervals, combined


class Part(NamedTuple):
    """Variance from one source, and the degrees of freedom that tell it."""

    variance: Array
    dof: Array | float


def propagated(
    covariance: ArrayLike, freedom: Sequence[float], rows: Sequence[Array | float]
) -> Part:
    """J C J', J given by its columns; each coefficient counts by its own variance in the dof.

    NaN in C is NaN in what depends on it, and nowhere else.
    """
    jacobian, told = np.stack(rows, axis=-1), np.asarray(covariance, dtype=np.float64)
    unknown = np.isnan(told)
    matrix = np.where(unknown, 0.0, told)
    variance = np.maximum(np.einsum("...i,...i->...", jacobian @ matrix, jacobian), 0.0)
    if unknown.any():
        used = (jacobian != 0.0).astype(float)
        missing = np.einsum("...i,...i->...", used @ unknown, used)
        variance = np.where(missing > 0.0, np.nan, variance)
    if all(map(math.isinf, freedom)):
        return Part(variance, math.inf)
    alone, squares = np.diagonal(matrix), jacobian**2
    return Part(variance, _ratio(squares @ alone, squares @ (alone / np.array(freedom))))


def linear_sum(one: Part, other: Part) -> Part:
    """Sum of two parts that may be fully correlated."""
    first, second = np.sqrt(one.variance), np.sqrt(other.variance)
    total = first + second
    return Part(total**2, _ratio(total, first / one.dof + second / other.dof))


def interval_of_parts(parts: Sequence[Part]) -> Intervals:
    """Add independent parts in squares, with Student's factor for all of them together."""
    return combined([part.variance for part in parts], [np.asarray(part.dof) for part in parts])


def _ratio(numerator: Array, denominator: Array) -> Array:
    """Quotient, infinite where the denominator is 0."""
    endless = np.full(np.shape(numerator), np.inf)
    return np.asarray(np.divide(numerator, denominator, out=endless, where=denominator != 0.0))
