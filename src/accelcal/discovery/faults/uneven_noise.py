"""Noise that is larger where the angle matters more, from the scatter of replicates."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array
from accelcal.discovery.columns import dummies
from accelcal.discovery.faults.pure_error import TELLING, PureError, moving
from accelcal.discovery.spans import orthonormal
from accelcal.effects.conditions import Conditions
from accelcal.numerics.grouping import grouped
from accelcal.numerics.probability import student_survival
from accelcal.numerics.sorting import distinct, median

_FEWEST_CELLS = 8
_STEPS = 30


class Vibration(NamedTuple):
    """Noise of variance sigma^2 + vibration^2 a_p^2.

    Attributes
    ----------
    vibration : float
        Its standard deviation at a_p = 1 g [g].
    uncertainty : float
        Standard uncertainty of that [g].
    sigma : float
        Standard deviation of the noise where the angle does not matter [g].
    """

    vibration: float
    uncertainty: float
    sigma: float


def chance_of_vibration(view: PureError, c: Conditions, mounting: NDArray[np.str_]) -> float:
    """Chance that the scatter of cells grows so much with a_p^2; 1 where there are too few.

    Notes
    -----
    One-sided test of the slope of the ranks, which no outlier and no heavy tail misleads: the cells
    (readings of one position in one run, reached in the same sense) are alike where the noise is
    even.
    """
    square, scatter = _cells(view, c, mounting)
    if square.size < _FEWEST_CELLS or np.ptp(square) < 1e-6 or not np.ptp(scatter) > 0.0:
        return 1.0
    _, place, members = grouped(scatter)
    rank = (np.cumsum(members) - 0.5 * members)[place]
    rank, x = rank - rank.mean(), square - square.mean()
    r = float(rank @ x) / float(np.sqrt((rank @ rank) * (x @ x)))
    dof = square.size - 2.0
    return student_survival(r * np.sqrt(dof / max(1.0 - r * r, 1e-12)), dof)


def _cells(view: PureError, c: Conditions, mounting: NDArray[np.str_]) -> tuple[Array, Array]:
    """The a_p^2 of each cell, and the mean square of its readings."""
    member = dummies(c.run, mounting, np.round(c.angle, 6), c.rotation).T
    free = member @ view.free
    telling = free > TELLING * member.sum(axis=1)
    square = (member @ c.cross**2) / member.sum(axis=1)
    squares = member @ view.residual**2
    return square[telling], squares[telling] / free[telling]


def vibration_over_noise(view: PureError, c: Conditions, mounting: NDArray[np.str_]) -> float:
    """Estimate how the variance grows with a_p^2, whatever the outliers.

    It is the variance from vibration at a_p = 1 g over that where the angle does not matter, by the
    medians of the cells of each a_p^2 [1].
    """
    square, scatter = _cells(view, c, mounting)
    square = np.round(square, 6)
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
    basis = orthonormal(moving(c, mounting))
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
