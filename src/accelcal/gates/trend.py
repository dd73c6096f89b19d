"""Replicates apart from a smooth drift over the run, of many tables at once.

What depends on the plan of the tables only is found once. A leading axis of length D is one where
all tables have the same times or none, and runs over the T tables elsewhere.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.noise import FEW
from accelcal.grouping import distinct, grouped
from accelcal.record import TumbleRecord

__all__ = [
    "Cells",
    "Replicates",
    "Trend",
    "contracted",
    "directed",
    "moments",
    "rank_and_inverse",
    "trend_of",
]

Array = NDArray[np.float64]
Places = NDArray[np.intp]

_HIGHEST_POWER = 3  # of a drift, however many strokes there are


def contracted(matrix: Array, values: Array) -> Array:
    """Sum each table's values times its columns.

    Parameters
    ----------
    matrix : ndarray, shape (D, n, k)
        Columns.
    values : ndarray, shape (T, n)
        Values; D is 1 or T.

    Returns
    -------
    ndarray, shape (T, k)
        The sums over n.
    """
    if len(matrix) == 1:
        return np.asarray(values @ matrix[0])
    return np.asarray((values[:, None] @ matrix)[:, 0])


class Cells(NamedTuple):
    """Readings brought together in cells, for sums over each.

    Attributes
    ----------
    key : ndarray, shape (m,)
        What the readings of each cell share.
    cell : ndarray of int, shape (n,)
        Cell of each reading.
    members : ndarray of int, shape (m,)
        Number of readings of each cell.
    order, start : ndarray of int
        Readings cell by cell, and where each cell begins there.
    """

    key: NDArray[np.int64]
    cell: Places
    members: Places
    order: Places
    start: Places

    @classmethod
    def of(cls, keys: NDArray[np.int64]) -> Cells:
        """Bring readings of one key together."""
        key, cell, members = grouped(keys)
        start = np.concatenate([[0], np.cumsum(members)[:-1]])
        return cls(key, cell, members, np.argsort(cell, kind="stable"), start)

    @property
    def parts(self) -> list[Places]:
        """Readings of each cell."""
        edges = [*self.start.tolist(), self.order.size]
        return [self.order[start:stop] for start, stop in pairwise(edges)]

    def sums(self, values: Array) -> Array:
        """Sum over the readings of each cell, from shape (T, n, ...) to shape (T, m, ...)."""
        return np.asarray(np.add.reduceat(values[:, self.order], self.start, axis=1))

    def centred(self, values: Array) -> Array:
        """Take the mean of its cell off each reading, shape (T, n, ...)."""
        members = self.members.reshape(-1, *(1,) * (values.ndim - 2))
        return np.asarray(values - (self.sums(values) / members)[:, self.cell])


def rank_and_inverse(columns: Array) -> tuple[Array, Array, Array]:
    """Rank of some columns, pseudo-inverse of their normal matrix, and what each reading pulls.

    Parameters
    ----------
    columns : ndarray, shape (D, n, q)
        Columns.

    Returns
    -------
    rank : ndarray, shape (D,)
        Number of independent columns.
    inverse : ndarray, shape (D, q, q)
        Pseudo-inverse.
    leverage : ndarray, shape (D, n)
        Share of each reading's error that the columns follow.
    """
    inverse = np.linalg.pinv(columns.swapaxes(1, 2) @ columns, rcond=1e-9, hermitian=True)
    leverage = (columns @ inverse * columns).sum(axis=2)
    rank: Array = np.round(leverage.sum(axis=1))
    return rank, np.asarray(inverse), leverage


class Replicates(NamedTuple):
    """Least squares through readings that are alike but for a trend: a mean for each cell.

    Attributes
    ----------
    cells : Cells
        The cells.
    residual : ndarray, shape (T, n)
        What is left of the readings [output unit].
    free : ndarray, shape (D, n)
        Share of each reading's own error that is left in its residual.
    trend : ndarray, shape (T, q)
        Coefficients of the trend [output unit].
    within : ndarray, shape (D, n, q)
        The trend's columns less their means in the cells.
    inverse : ndarray, shape (D, q, q)
        Covariance of the trend's coefficients over the variance of a reading.
    dof : ndarray, shape (D,)
        Degrees of freedom of the residuals.
    """

    cells: Cells
    residual: Array
    free: Array
    trend: Array
    within: Array
    inverse: Array
    dof: Array

    @classmethod
    def of(cls, output: Array, keys: NDArray[np.int64], columns: Array) -> Replicates:
        """Fit the means of the cells and the trend along some columns of shape (D, n, q)."""
        cells = Cells.of(keys)
        within = cells.centred(columns)
        rank, inverse, leverage = rank_and_inverse(within)
        trend = contracted(within @ inverse, output)
        return cls(
            cells=cells,
            residual=cells.centred(output) - contracted(within.swapaxes(1, 2), trend),
            free=np.maximum(1.0 - 1.0 / cells.members[cells.cell] - leverage, 0.0),
            trend=trend,
            within=within,
            inverse=inverse,
            dof=output.shape[1] - cells.members.size - rank,
        )

    @property
    def squares(self) -> Array:
        """Sum of the squared residuals, shape (T,)."""
        return np.asarray((self.residual**2).sum(axis=1))

    def blind(self, weights: Array, columns: Array) -> Array:
        """Weights of the readings, (n, k), that no trend along the columns moves, (D, n, k)."""
        seen = self.inverse @ (columns.swapaxes(1, 2) @ weights)
        return np.asarray(weights - self.within @ seen)


def directed(record: TumbleRecord) -> NDArray[np.int64]:
    """Sort readings by angle and direction.

    Parameters
    ----------
    record : TumbleRecord
        Readings of one table.

    Returns
    -------
    ndarray of int, shape (n,)
        The same number for readings of one angle in strokes of one direction.
    """
    return np.asarray(2 * grouped(np.round(record.angle, 6))[1] + record.stroke % 2)


class Trend(NamedTuple):
    """Columns of a smooth drift over a run, shape (D, n, q), by what drifts.

    Attributes
    ----------
    bias : ndarray, shape (D, n, b)
        Powers of the time.
    scale_factor : ndarray, shape (D, n, s)
        Time by the cosine of the head angle; no column where the readings are too few.
    angle : ndarray, shape (D, n, s)
        Time by the sine of the head angle, as a turn of the unit in the head makes.
    """

    bias: Array
    scale_factor: Array
    angle: Array

    @property
    def columns(self) -> Array:
        """All columns, side by side."""
        return np.concatenate(self, axis=2)


def trend_of(record: TumbleRecord, moment: Array) -> Trend:
    """Columns of a smooth drift over a run: of the bias, one for each two strokes, and of the rest.

    Parameters
    ----------
    record : TumbleRecord
        Readings of a table of the plan.
    moment : ndarray, shape (D, n)
        When each reading was taken, in any unit.

    Returns
    -------
    Trend
        Powers of the time from -1 to 1, and that time by cosine and sine; no column where the
        readings are too few.

    Notes
    -----
    So many powers leave the alternation of forward and back strokes almost untouched.
    """
    x = _run_time(moment)
    free = len(record) - distinct(directed(record)).size - FEW
    powers = min((distinct(record.stroke).size - 1) // 2, _HIGHEST_POWER)
    powers = max(0, min(powers, free))
    whole = powers > 0 and free >= powers + 2
    th = np.radians(record.angle)
    return Trend(
        bias=x[..., None] ** np.arange(1, powers + 1),
        scale_factor=(x * np.cos(th))[..., None][..., : int(whole)],
        angle=(x * np.sin(th))[..., None][..., : int(whole)],
    )


def _run_time(moment: Array) -> Array:
    """Time from -1 at the first reading to 1 at the last."""
    span = np.ptp(moment, axis=1, keepdims=True)
    since = moment - moment.min(axis=1, keepdims=True)
    return np.asarray(2.0 * since / np.where(span > 0.0, span, 1.0) - 1.0)


def moments(record: TumbleRecord, time: Array | None) -> Array:
    """When each reading was taken.

    Parameters
    ----------
    record : TumbleRecord
        Readings of a table of the plan.
    time : ndarray, shape (T, n), or None
        Times of the readings of each table [s].

    Returns
    -------
    ndarray, shape (D, n)
        Times [s], or where there are none the places in the order of measuring [strokes]; one row
        where all tables have the same.
    """
    angles, row, _ = grouped(np.round(record.angle, 6))
    place = np.where(record.stroke % 2 == 1, row, angles.size - 1 - row)
    strokes = (record.stroke + place / angles.size)[None]
    if time is None:
        return np.asarray(strokes)
    known = np.isfinite(time).all(axis=1) & (np.ptp(time, axis=1) > 0.0)
    found = np.where(known[:, None], time, strokes)
    return found[:1] if (found == found[0]).all() else found
