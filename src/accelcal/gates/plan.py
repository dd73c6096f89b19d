"""What follows from the angles, strokes and times of tables: found once for all that have them."""

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
from accelcal.gates.replicate_plan import Cells, ReplicatePlan, beside
from accelcal.numerics.grouping import Grouped, grouped
from accelcal.numerics.sorting import median

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
