"""What follows from the angles, strokes and times of tables: found once for all that have them.

Readings of T tables have the shape (n, T): sums and extremes over the readings of a table then run
along the tables. What depends on the plan of the tables only is found once, such as the replicates
apart from a smooth drift over the run. A leading axis of length D is one where all tables have the
same times or none, and runs over the T tables elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache, wraps
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array, Ints, Mask
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.trend import Trend, directed, moments, trend_of
from accelcal.numerics.grouping import Grouped, grouped, median


class Cells(NamedTuple):
    """Readings brought together in cells, for the mean of each.

    Attributes
    ----------
    readings : Grouped
        The readings by what those of each cell share.
    weight : ndarray, shape (m,) or (T, m)
        Weight of the mean of each cell: the sum of those of its readings.
    precision : ndarray, shape (n,) or (T, n), or None
        One over the spread of each reading, in which the values are then counted, so that all have
        the same noise, 0 where a table has a gap; None where they have it as they are.
    """

    readings: Grouped
    weight: NDArray[Any]
    precision: Array | None = None

    @classmethod
    def of(cls, keys: NDArray[Any], precision: Array | None = None) -> Cells:
        """Bring readings of one key together."""
        return cls.over(grouped(keys), precision)

    @classmethod
    def over(cls, readings: Grouped, precision: Array | None = None) -> Cells:
        """Bring readings together as they are grouped."""
        if precision is None:
            return cls(readings, readings.members)
        return cls(readings, readings.sums(precision[..., None] ** 2)[..., 0], precision)

    @property
    def number(self) -> Any:
        """How many readings there are, of each table where these have gaps of their own."""
        if self.precision is None:
            return self.readings.cell.size
        return np.count_nonzero(self.precision, axis=-1)

    @property
    def members(self) -> NDArray[Any]:
        """How many readings each cell has, shape (m,) or (T, m)."""
        gaps = self.precision is not None and self.precision.ndim == 2
        return self.weight if gaps else self.readings.members

    def means(self, values: Array) -> Array:
        """Mean over the readings of each cell, from shape (..., n, k) to shape (..., m, k).

        Of values v = y p of precision p it is the weighted mean of y, the sum of v p over that of
        p^2.
        """
        own = values if self.precision is None else values * beside(self.precision, values)
        return np.asarray(self.readings.sums(own) / beside(self.weight, values))

    def at_readings(self, means: Array) -> Array:
        """What is expected of the readings, from means of shape (..., m, k), shape (..., n, k)."""
        expected = np.take(means, self.readings.cell, axis=-2)
        return expected if self.precision is None else expected * beside(self.precision, means)

    @property
    def own_share(self) -> Array:
        """Share of each reading's own error in the mean of its cell, shape (n,) or (T, n)."""
        own = 1.0 if self.precision is None else self.precision**2
        return np.asarray(own / self.weight[..., self.readings.cell])

    def centred(self, values: Array) -> Array:
        """Take the mean of its cell off each reading, shape (..., n, k)."""
        return np.asarray(values - self.at_readings(self.means(values)))


def beside(each: Array, values: Array) -> Array:
    """Bring what readings have, (n,) or (T, n), to values of shape (n, T) or (T, n, k)."""
    return np.atleast_2d(each).T if values.ndim == 2 else each[..., None]


_LEAST_EIGENVALUE = 1e-9  # over the largest: smaller ones are rounding errors


def contracted(matrix: Array, values: Array) -> Array:
    """Sum each table's values, shape (n, T), times its columns, shape (D, n, k): shape (k, T).

    D is 1 or T.
    """
    if len(matrix) == 1:
        return np.asarray(matrix[0].T @ values)
    return np.asarray((values.T[:, None] @ matrix)[:, 0].T)


def rank_and_inverse(normal: Array) -> tuple[Array, Array]:
    """Rank of the normal matrices of some columns, shape (..., q, q), and their pseudo-inverses."""
    values, vectors = np.linalg.eigh(normal)
    told = values > _LEAST_EIGENVALUE * values[..., -1:]
    over = np.where(told, values, np.inf)
    return told.sum(axis=-1, dtype=np.float64), vectors / over[..., None, :] @ vectors.mT


class ReplicateFit(NamedTuple):
    """Least squares through readings that are alike but for a trend [output unit]."""

    means: Array  # of the readings of each cell, the trend not taken off, shape (m, T)
    trend: Array  # its coefficients, shape (q, T)
    residual: Array  # what is left of the readings, shape (n, T)
    squares: Array  # sum of the squared residuals, shape (T,)


class ReplicatePlan(NamedTuple):
    """What such least squares needs beside the readings: a mean for each cell, and the trend."""

    cells: Cells
    within: Array  # the trend's columns less their means in the cells, shape (D, n, q)
    normal: Array  # their normal matrix, shape (D, q, q)
    inverse: Array  # covariance of the trend's coefficients over the variance of a reading
    rank: Array  # number of independent columns of the trend, shape (D,)
    dof: Array  # degrees of freedom of the residuals, shape (D,)

    @classmethod
    def of(cls, cells: Cells, columns: Array) -> ReplicatePlan:
        """Take a mean of each cell beside a trend along columns of shape (D, n, q)."""
        within = cells.centred(columns)
        normal = within.mT @ within
        rank, inverse = rank_and_inverse(normal)
        dof = cells.number - cells.readings.key.size - rank
        return cls(cells, within, normal, inverse, rank, dof)

    @property
    def free(self) -> Array:
        """Share of each reading's own error that is left in its residual, shape (D, n)."""
        leverage = (self.within @ self.inverse * self.within).sum(axis=2)
        return np.asarray(np.maximum(1.0 - self.cells.own_share - leverage, 0.0))

    def fit(self, output: Array) -> ReplicateFit:
        """Fit readings of shape (n, T)."""
        means = self.cells.means(output)
        trend = contracted(self.within @ self.inverse, output)
        deviation = output - self.cells.at_readings(means)
        residual = deviation - contracted(self.within.mT, trend)
        return ReplicateFit(means, trend, residual, (residual**2).sum(axis=0))

    def blind(self, weights: Array, columns: Array) -> Array:
        """Weights of the readings that no trend along the columns moves, shape (D, n, k)."""
        seen = self.inverse @ (columns.mT @ weights)
        return np.asarray(weights - self.within @ seen)


Found = TypeVar("Found")


class Spread(NamedTuple):
    """Standard deviations of the readings of a table against each other, shape (n,)."""

    size: Array  # standard deviation of each over the median of all
    doubt: Array  # variance of the logarithm of its square


def spread_of(table: PreparedTable) -> Spread | None:
    """Tell how unlike the noise of the readings is by the declared scatter.

    None where the noise of all readings is alike.
    """
    if table.scatter.ndim == 2 or np.ptp(table.scatter) == 0.0:  # no scatter differs with gaps
        return None
    return Spread(table.scatter / median(table.scatter), table.scatter_doubt)


@dataclass(frozen=True, eq=False)
class TablePlan:
    """The plan of tables of n readings.

    Attributes
    ----------
    angle, head : ndarray, shape (n,)
        Angle of each reading, and its position on the head [deg].
    stroke : ndarray of int, shape (n,)
        Its stroke.
    design : ndarray, shape (n, p)
        Columns of the coefficients that are estimated.
    moment : ndarray, shape (D, n)
        When it was taken, see `accelcal.estimate.trend.moments`.
    spread : Spread or None
        How unlike their noise is; None where it is alike.
    there : ndarray, shape (T, n), or None
        1 where a table has this reading, and 0 at a gap; None where no table has gaps.
    known : dict
        What was found, see `once_a_plan`.
    """

    angle: Array
    head: Array
    stroke: Ints
    design: Array
    moment: Array
    spread: Spread | None = None
    there: Array | None = None
    known: dict[Callable[[TablePlan], Any], Any] = field(default_factory=dict)

    @cached_property
    def trend(self) -> Trend:
        """Columns of a smooth drift."""
        return trend_of(self.angle, self.stroke, self.moment, self.directions.readings.key.size)

    @property
    def size(self) -> Array:
        """Size of the spread of each reading, shape (n,)."""
        return np.ones(self.angle.size) if self.spread is None else self.spread.size

    @cached_property
    def precision(self) -> Array | None:
        """One over the spread, or 0 at gaps, see `Cells`."""
        return self.there if self.spread is None else np.asarray(1.0 / self.spread.size)

    def alike(self, values: Array) -> Array:
        """Count values of readings in their spread: all have one noise then.

        They are of shape (n, T) or (..., n, k); those at gaps are 0.
        """
        own = self.precision
        return values if own is None else np.asarray(values * beside(own, values))

    def cells(self, keys: NDArray[Any]) -> Cells:
        """Bring readings of one key together, to be counted in their spread."""
        return Cells.of(keys, self.precision)

    @cached_property
    def strokes(self) -> Grouped:
        """Readings by stroke."""
        return grouped(self.stroke)

    @cached_property
    def directions(self) -> Cells:
        """Readings of one angle and one direction."""
        return self.cells(directed(self.angle, self.stroke))

    @cached_property
    def columns(self) -> Array:
        """Columns of the trend, counted in the spread, shape (D, n, q)."""
        return self.alike(self.trend.columns)

    @cached_property
    def apart(self) -> ReplicatePlan:
        """Readings of one angle and one direction, a drift set aside."""
        return ReplicatePlan.of(self.directions, self.columns)

    @cached_property
    def at_head(self) -> ReplicatePlan:
        """Readings at one position of the head, a drift set aside."""
        return ReplicatePlan.of(self.cells(self.head), self.columns)


def once_a_plan(function: Callable[[TablePlan], Found]) -> Callable[[TablePlan], Found]:
    """Let a function of a plan find its result once, which the plan keeps."""

    @wraps(function)
    def found(plan: TablePlan) -> Found:
        if function not in plan.known:
            plan.known[function] = function(plan)
        kept: Found = plan.known[function]
        return kept

    return found


def plan_of(table: PreparedTable, time: Array | None, there: Mask | None = None) -> TablePlan:
    """Plan of a table and times (T, n) [s], the same whenever such a table comes again.

    Tables with gaps of their own tell which readings are `there`, shape (T, n).
    """
    record = table.record
    arrays = record.angle, table.head, record.stroke, table.kept_design
    if there is not None:
        moment = moments(record.angle, record.stroke, time)
        # a gap is put at the first reading, so that first and last stay what they are
        first = np.where(there, moment, np.inf).min(axis=1, keepdims=True)
        return TablePlan(*arrays, np.where(there, moment, first), None, there.astype(np.float64))
    spread = spread_of(table)
    unlike = None if spread is None else tuple(each.tobytes() for each in spread)
    if time is None:
        return _plan(*(each.tobytes() for each in arrays), None, unlike)
    moment = moments(record.angle, record.stroke, time)
    if len(moment) > 1:
        return TablePlan(*arrays, moment, spread)
    return _plan(*(each.tobytes() for each in arrays), moment.tobytes(), unlike)


@lru_cache(maxsize=16)
def _plan(
    angle: bytes,
    head: bytes,
    stroke: bytes,
    design: bytes,
    moment: bytes | None,
    spread: tuple[bytes, ...] | None,
) -> TablePlan:
    at, on_head, columns = (np.frombuffer(each) for each in (angle, head, design))
    number = np.frombuffer(stroke, dtype=np.int64)
    when = moments(at, number, None) if moment is None else np.frombuffer(moment)[None]
    unlike = None if spread is None else Spread(*map(np.frombuffer, spread))
    return TablePlan(at, on_head, number, columns.reshape(at.size, -1), when, unlike)
