"""Replicates apart from a smooth drift over the run."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.noise import FEW
from accelcal.estimate.tables import PreparedTable
from accelcal.grouping import distinct, grouped
from accelcal.record import TumbleRecord

__all__ = ["Replicates", "Trend", "directed", "moments", "smallest", "trend_of"]

Array = NDArray[np.float64]
Places = NDArray[np.intp]

_HIGHEST_POWER = 3  # of a drift, however many strokes there are


class Replicates(NamedTuple):
    """Least squares through readings that are alike but for a trend: a mean for each cell.

    Attributes
    ----------
    residual : ndarray, shape (n,)
        What is left of the readings [output unit].
    free : ndarray, shape (n,)
        Share of each reading's own error that is left in its residual.
    trend : ndarray, shape (q,)
        Coefficients of the trend [output unit].
    within : ndarray, shape (n, q)
        The trend's columns less their means in the cells.
    inverse : ndarray, shape (q, q)
        Covariance of the trend's coefficients over the variance of a reading.
    dof : float
        Degrees of freedom of the residuals.
    """

    residual: Array
    free: Array
    trend: Array
    within: Array
    inverse: Array
    dof: float

    @classmethod
    def of(cls, output: Array, cell: Places, columns: Array) -> Replicates:
        """Fit the means of the cells and the trend along some columns of shape (n, q)."""
        _, cell, members = grouped(cell)

        def centred(values: Array) -> Array:
            return np.asarray(values - (np.bincount(cell, values) / members)[cell])

        within = np.column_stack([*map(centred, columns.T), np.zeros((output.size, 0))])
        inverse = np.linalg.pinv(within.T @ within, rcond=1e-9, hermitian=True)
        trend = inverse @ within.T @ output
        leverage = (within @ inverse * within).sum(axis=1)
        rank = round(float(leverage.sum()))
        return cls(
            residual=centred(output) - within @ trend,
            free=np.maximum(1.0 - 1.0 / members[cell] - leverage, 0.0),
            trend=trend,
            within=within,
            inverse=inverse,
            dof=float(output.size - members.size - rank),
        )

    @property
    def squares(self) -> float:
        """Sum of the squared residuals."""
        return float(self.residual @ self.residual)

    def blind(self, weights: Array, columns: Array) -> Array:
        """Weights of the readings that no trend along the columns moves, shape (n,)."""
        return np.asarray(weights - self.within @ (self.inverse @ (columns.T @ weights)))


def directed(record: TumbleRecord) -> Places:
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
    """Columns of a smooth drift over a run, shape (n, q), by what drifts.

    Attributes
    ----------
    bias : ndarray, shape (n, b)
        Powers of the time.
    scale_factor : ndarray, shape (n, s)
        Time by the cosine of the head angle; no column where the readings are too few.
    angle : ndarray, shape (n, s)
        Time by the sine of the head angle, as a turn of the unit in the head makes.
    """

    bias: Array
    scale_factor: Array
    angle: Array

    @property
    def columns(self) -> Array:
        """All columns, side by side."""
        return np.column_stack(self)


def trend_of(record: TumbleRecord) -> Trend:
    """Columns of a smooth drift over a run: of the bias, one for each two strokes, and of the rest.

    Parameters
    ----------
    record : TumbleRecord
        Readings of one table.

    Returns
    -------
    Trend
        Powers of the time from -1 to 1, and that time by cosine and sine; no column where the
        readings are too few.

    Notes
    -----
    So many powers leave the alternation of forward and back strokes almost untouched.
    """
    x = _run_time(moments(record))
    free = len(record) - distinct(directed(record)).size - FEW
    powers = min((distinct(record.stroke).size - 1) // 2, _HIGHEST_POWER)
    powers = max(0, min(powers, free))
    whole = powers > 0 and free >= powers + 2
    th = np.radians(record.angle)
    nothing = np.zeros((x.size, 0))
    return Trend(
        bias=np.column_stack([x**power for power in range(1, powers + 1)] or [nothing]),
        scale_factor=(x * np.cos(th))[:, None] if whole else nothing,
        angle=(x * np.sin(th))[:, None] if whole else nothing,
    )


def _run_time(moment: Array) -> Array:
    """Time from -1 at the first reading to 1 at the last."""
    return np.asarray(2.0 * (moment - moment.min()) / (np.ptp(moment) or 1.0) - 1.0)


def moments(record: TumbleRecord) -> Array:
    """When each reading was taken.

    Parameters
    ----------
    record : TumbleRecord
        Readings of one table.

    Returns
    -------
    ndarray, shape (n,)
        Times [s], or where there are none the places in the order of measuring [strokes].
    """
    if record.time is not None and np.isfinite(record.time).all() and np.ptp(record.time) > 0.0:
        return record.time
    angles, row, _ = grouped(np.round(record.angle, 6))
    place = np.where(record.stroke % 2 == 1, row, angles.size - 1 - row)
    return np.asarray(record.stroke + place / angles.size)


def smallest(table: PreparedTable) -> float:
    """Rounding error of a reading: readings alike to the last digit still have it.

    Parameters
    ----------
    table : PreparedTable
        The table.

    Returns
    -------
    float
        Standard deviation [output unit].
    """
    return float(4.0 * np.finfo(float).eps * np.abs(table.record.output).max())
