"""Noise that is larger where the angle matters more, from the scatter of replicates."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array
from accelcal.discovery.columns import dummies
from accelcal.discovery.noise.pure_error import TELLING, PureError, tilting
from accelcal.discovery.spans import orthonormal, without
from accelcal.effects.conditions import Conditions
from accelcal.numerics.grouping import distinct, grouped, median
from accelcal.numerics.probability import student_survival

_FEWEST_CELLS = 8
_STEPS = 30

_DRAWS = 1000
"""Readings drawn: the scatter of the slope is known to 2 %."""

_WORTH_DRAWS = 0.05
"""Chance of independent cells beyond which no draws are needed: those of real ones are larger."""


class Vibration(NamedTuple):
    """Noise of variance sigma^2 + vibration^2 a_p^2."""

    vibration: float  # its standard deviation at a_p = 1 g [g]
    uncertainty: float  # standard uncertainty of that [g]
    sigma: float  # standard deviation of the noise where the angle does not matter [g]


class _Cells(NamedTuple):
    """Readings of one position in one run, reached in the same sense, where they tell a scatter.

    `member`, shape (m, n), tells the readings of each of m cells, `square` is its a_p^2, and `free`
    are the degrees of freedom that are left of its readings.
    """

    member: Array
    square: Array
    free: Array

    @classmethod
    def of(cls, view: PureError, c: Conditions, mounting: NDArray[np.str_]) -> _Cells:
        member = dummies(c.run, mounting, np.round(c.angle, 6), c.rotation).T
        readings, free = member.sum(axis=1), member @ view.free
        telling = free > TELLING * readings
        square = (member @ c.cross**2) / readings
        return cls(member[telling], square[telling], free[telling])

    def scatter(self, residual: Array) -> Array:
        """Mean square of the readings of each cell, (m,) or (m, k), from (n,) or (n, k)."""
        return np.asarray(((self.member @ residual**2).T / self.free).T)

    def correlation(self, residual: Array) -> Array:
        """Correlation of the ranks of the scatter with a_p^2, of each column of (n, k)."""
        ranks = np.stack([_ranks(own) for own in self.scatter(residual).T])
        ranks -= ranks.mean(axis=1, keepdims=True)
        x = self.square - self.square.mean()
        return np.asarray((ranks @ x) / np.sqrt((ranks**2).sum(axis=1) * (x @ x)))


def chance_of_vibration(view: PureError, c: Conditions, mounting: NDArray[np.str_]) -> float:
    """Chance that the scatter of cells grows so much with a_p^2; 1 where there are too few.

    Notes
    -----
    One-sided test of the slope of the ranks, which no outlier and no heavy tail misleads: the cells
    (readings of one position in one run, reached in the same sense) are alike where the noise is
    even. They are not independent, as the drifts of the cycles were taken out of all of them:
    normal noise that is drawn tells how much the slope scatters. With four strokes in one run,
    where Student's quantile for independent cells was exceeded in 5 % in place of 1 %, that counts
    most. The draws are the same each time.
    """
    cells = _Cells.of(view, c, mounting)
    if cells.square.size < _FEWEST_CELLS or np.ptp(cells.square) < 1e-6:
        return 1.0
    if not np.ptp(cells.scatter(view.residual)) > 0.0:
        return 1.0
    r = float(cells.correlation(view.residual[:, None])[0])
    chance = _chance_of_slope(r, cells.square.size)
    if chance > _WORTH_DRAWS:
        return chance
    drawn = np.random.default_rng(0).standard_normal((view.residual.size, _DRAWS))
    variance = float((cells.correlation(without(drawn, view.taken)) ** 2).mean())
    return _chance_of_slope(r, min(1.0 / variance + 1.0, float(cells.square.size)))


def _chance_of_slope(r: float, size: float) -> float:
    """Chance that a correlation of so many independent pairs is larger."""
    dof = size - 2.0
    return student_survival(r * np.sqrt(dof / max(1.0 - r * r, 1e-12)), dof)


def _ranks(values: Array) -> Array:
    """Ranks, those of equal values alike."""
    _, place, members = grouped(values)
    return np.asarray((np.cumsum(members) - 0.5 * members)[place])


def vibration_over_noise(view: PureError, c: Conditions, mounting: NDArray[np.str_]) -> float:
    """Estimate how the variance grows with a_p^2, whatever the outliers.

    It is the variance from vibration at a_p = 1 g over that where the angle does not matter, by the
    medians of the cells of each a_p^2 [1].
    """
    cells = _Cells.of(view, c, mounting)
    square, scatter = np.round(cells.square, 6), cells.scatter(view.residual)
    levels = distinct(square)
    medians = np.array([median(scatter[square == level]) for level in levels])
    weights = np.sqrt([(square == level).sum() for level in levels])
    columns = np.column_stack([np.ones_like(levels), levels]) * weights[:, None]
    start, slope = np.linalg.lstsq(columns, medians * weights, rcond=None)[0]
    return max(float(slope), 0.0) / max(float(start), 0.02 * float(medians.max()))


def vibration(readings: Array, c: Conditions, mounting: NDArray[np.str_]) -> Vibration:
    """Estimate normal noise from vibration by restricted maximum likelihood, without outliers [g].

    Notes
    -----
    In the eigenvectors of what a_p^2 makes of the pure error, coordinate k has the variance
    sigma^2 + lambda_k vibration^2, independent of the others; Fisher's scoring does the rest.
    """
    basis = orthonormal(tilting(c, mounting))
    rest = np.linalg.qr(basis, mode="complete")[0][:, basis.shape[1] :]
    values, vectors = np.linalg.eigh(rest.T @ (c.cross[:, None] ** 2 * rest))
    squares = (vectors.T @ (rest.T @ readings)) ** 2
    columns = np.column_stack([np.ones_like(values), np.maximum(values, 0.0)])
    parts = np.array([0.5, 0.5]) * squares.mean()
    for _ in range(_STEPS):
        weight = 1.0 / (columns @ parts) ** 2
        normal = columns.T @ (weight[:, None] * columns)
        found = np.linalg.solve(normal, columns.T @ (weight * squares))
        parts = np.maximum(found, 1e-3 * np.abs(found).max())
    variance = float(np.linalg.inv(0.5 * normal)[1, 1])
    size = float(np.sqrt(parts[1]))
    return Vibration(size, float(np.sqrt(variance)) / (2.0 * size), float(np.sqrt(parts[0])))
