"""Uncertainty of what follows from coefficients, their covariance carried over; bands of laws."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from accelcal.arrays import Array
from accelcal.estimate.uncertainty import FEWEST, Intervals, combined
from accelcal.results.temperature import TemperatureModel


class Part(NamedTuple):
    """Variance from one source, and the degrees of freedom that tell it."""

    variance: Array
    dof: Array | float


def propagated(errors: ArrayLike, rows: Sequence[Array | float]) -> Part:
    """J C J' with its degrees of freedom J C J' / J D J', J given by its columns.

    The errors are C, and D with each source over its degrees of freedom, shape (2, n, n). No source
    counts as fewer than `FEWEST`, so that less is a rounding of D where C nearly vanishes. NaN in C
    is NaN in what depends on it, and nowhere else.
    """
    jacobian = np.stack(rows, axis=-1)
    covariance, of_sources = np.asarray(errors, dtype=np.float64)
    variance = variance_of(jacobian, covariance)
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


_PARTS = ("at_T0", "above", "below")


def law_and_band(model: TemperatureModel, name: str, rise: Array) -> tuple[Array, Array] | None:
    """Work out the law of ``"k0"``, ``"K1"`` or ``"delta"`` at T - T0, shape (n,), and its band.

    That is the law, NaN on a side whose slope is not determined, and the half width of its 95 %
    interval; of K1 the change from T0, both over K1 at T0. It is None where there is no value at
    T0.
    """
    law = model.laws[name]
    if law.at_T0 is None or law.at_T0.value is None:
        return None
    columns = np.stack([np.ones(rise.size), rise.clip(min=0.0), rise.clip(max=0.0)])
    values = [0.0 if (q := getattr(law, part)) is None else q.value or 0.0 for part in _PARTS]
    scale = 1.0
    if name == "K1":
        scale, values[0] = law.at_T0.value, 0.0
    middle = np.asarray(values) @ columns
    if name == "K1":
        columns[0] += middle  # the relative error of K1N is one of the whole scale factor
    half = _half_width(model, name, columns, scale)
    middle[((law.above is None) & (rise > 0.0)) | ((law.below is None) & (rise < 0.0))] = np.nan
    return middle, half


def _half_width(model: TemperatureModel, name: str, columns: Array, scale: float) -> Array:
    """Half width of the band, from the covariance of value and slopes."""
    place = {told: i for i, told in enumerate(model.covariance_names)}
    names = [f"{name} {part}" for part in _PARTS]
    known = [i for i, part in enumerate(names) if part in place]
    own = [place[names[i]] for i in known]
    blocks = np.zeros((2, 3, 3))
    for block, whole in zip(blocks, (model.covariance, model.over_dof), strict=True):
        block[np.ix_(known, known)] = whole[np.ix_(own, own)]
    units = np.array([1.0 / scale, 1.0, 1.0])
    parts = [getattr(model.laws[name], part) for part in _PARTS]
    if all(part is None or part.coverage_factor is None for part in parts):
        return np.zeros(columns.shape[1])
    found = propagated(blocks * np.outer(units, units), list(columns))
    return np.asarray(interval_of_parts([found]).expanded)
