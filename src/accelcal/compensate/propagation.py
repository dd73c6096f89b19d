"""Uncertainty of what follows from the coefficients: their covariance carried through Jacobians."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from accelcal.arrays import Array
from accelcal.estimate.uncertainty import FEWEST, Intervals, combined


class Part(NamedTuple):
    """Variance from one source, and the degrees of freedom that tell it."""

    variance: Array
    dof: Array | float


def propagated(covariance: ArrayLike, over_dof: ArrayLike, rows: Sequence[Array | float]) -> Part:
    """J C J' with its degrees of freedom J C J' / J D J', J given by its columns.

    D is the covariance with each source over its degrees of freedom; one without rows has none that
    end. No source counts as fewer than `FEWEST`, so that less is a rounding of D where C nearly
    vanishes. NaN in C is NaN in what depends on it, and nowhere else.
    """
    jacobian = np.stack(rows, axis=-1)
    variance = variance_of(jacobian, np.asarray(covariance, dtype=np.float64))
    of_sources = np.asarray(over_dof, dtype=np.float64)
    if not of_sources.any():
        return Part(variance, math.inf)
    return Part(variance, np.maximum(ratio(variance, _squares(jacobian, of_sources)), FEWEST))


def variance_of(jacobian: Array, covariance: Array) -> Array:
    """J C J', the rows of J one for each sample; NaN in C is NaN in what depends on it."""
    unknown = np.isnan(covariance)
    variance = _squares(jacobian, np.where(unknown, 0.0, covariance))
    if not unknown.any():
        return variance
    used = (jacobian != 0.0).astype(float)
    return np.where(_squares(used, unknown) > 0.0, np.nan, variance)


def _squares(jacobian: Array, matrix: NDArray[Any]) -> Array:
    """J M J', which is not below zero by rounding."""
    return np.asarray(np.maximum(np.einsum("...i,...i->...", jacobian @ matrix, jacobian), 0.0))


def linear_sum(one: Part, other: Part) -> Part:
    """Sum of two parts that may be fully correlated."""
    first, second = np.sqrt(one.variance), np.sqrt(other.variance)
    total = first + second
    return Part(total**2, ratio(total, first / one.dof + second / other.dof))


def interval_of_parts(parts: Sequence[Part]) -> Intervals:
    """Add independent parts in squares, with Student's factor for all of them together."""
    return combined([part.variance for part in parts], [np.asarray(part.dof) for part in parts])


def ratio(numerator: Array, denominator: Array) -> Array:
    """Quotient, infinite where the denominator is 0."""
    endless = np.full(np.shape(numerator), np.inf)
    return np.asarray(np.divide(numerator, denominator, out=endless, where=denominator != 0.0))
