"""Tables of one plan, stacked: what the gates look at."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from accelcal.arrays import Array, Ints, Mask, Places
from accelcal.estimate.noise import ReadingNoise
from accelcal.estimate.tables import PreparedTable
from accelcal.gates.plan import ReplicateFit, TablePlan, plan_of, spread_of
from accelcal.gates.verdict import reading_name
from accelcal.model import SCALE_FACTOR
from accelcal.numerics.decimal_steps import decimal_steps
from accelcal.numerics.grouping import places_of_equals
from accelcal.numerics.one_thread import multiply
from accelcal.record import TumbleRecord
from accelcal.units import HOUR


@dataclass(frozen=True, eq=False)
class TableStack:
    """T tables with the same angles and strokes, in one mounting, of n readings each.

    Attributes
    ----------
    table : PreparedTable
        Any of them; only what follows from its angles and strokes counts, its unit, and the ratios
        of its declared scatter.
    output : ndarray, shape (n, T)
        Readings [output unit].
    coefficients : ndarray, shape (T, 6)
        Least-squares coefficients, zero where not estimated [output unit / g^n].
    noise : ndarray, shape (T,)
        Standard deviation of a reading over the declared scatter, or the standard deviation itself
        where none is declared [output unit]; NaN where nothing tells it.
    noise_dof : ndarray, shape (T,)
        Its degrees of freedom.
    declared : ndarray of bool, shape (T,)
        Whether it is the declared scatter.
    scatter : ndarray, shape (T,)
        Median declared scatter of the readings, or 1 where none is declared.
    digit : ndarray, shape (T,)
        Decimal step in which the readings come, see `decimal_steps` [output unit].
    step : ndarray, shape (T,)
        Declared resolution [output unit]; NaN where none is.
    time : ndarray, shape (T, n), or None
        Time of each reading [s]; a row of NaN where a table has none.
    there : ndarray of bool, shape (T, n), or None
        Where the tables have the readings, others of their cells being in the places of those that
        are missing; None where no table has gaps.
    alone : callable
        Gives the stack of one of the tables with gaps, which says what is wrong with it.
    line : callable
        Gives the lines of the source that hold the readings of one table, or None.
    delta0 : float
        Fixture angle of the fit [rad].

    Notes
    -----
    What depends on the times and gaps as well as on angles and strokes has a leading axis of length
    D: one where all tables have the same times or none, and no gaps, T elsewhere.
    """

    table: PreparedTable
    output: Array
    coefficients: Array
    noise: Array
    noise_dof: Array
    declared: Mask
    scatter: Array
    digit: Array
    step: Array
    time: Array | None = None
    there: Mask | None = None
    alone: Callable[[int], TableStack] | None = None
    line: Callable[[int], Ints | None] = lambda _: None
    delta0: float = 0.0

    @classmethod
    def of(
        cls,
        tables: Sequence[PreparedTable],
        coefficients: Sequence[Array],
        noises: Sequence[ReadingNoise],
        delta0: float = 0.0,
    ) -> TableStack:
        """Stack tables of one plan, see `of_one_plan`."""
        records = [table.record for table in tables]
        steps = [record.apparatus.resolution for record in records]
        output = np.stack([record.output for record in records], axis=1)
        return cls(
            table=tables[0],
            output=output,
            coefficients=np.array(coefficients),
            noise=np.array([noise.factor for noise in noises]),
            noise_dof=np.array([noise.dof for noise in noises]),
            declared=np.array([noise.source == "declared" for noise in noises]),
            scatter=np.array([table.usual_scatter for table in tables]),
            digit=decimal_steps(output.T),
            step=np.array(steps, dtype=np.float64),  # None becomes NaN
            time=stacked_times(records),
            line=lambda index: records[index].line,
            delta0=delta0,
        )

    def __len__(self) -> int:
        return int(self.output.shape[1])

    @cached_property
    def scale(self) -> Array:
        """Scale factor in which sizes are told, shape (T,) [output unit / g]."""
        # a scale factor that a fault has ruined must not blow up the sizes told
        quarter = np.ptp(self.output, axis=0) / 4.0
        return np.asarray(np.maximum(np.abs(self.coefficients[:, SCALE_FACTOR]), quarter))

    @cached_property
    def alike(self) -> Array:
        """Readings counted in their spread, shape (n, T): they all have the same noise."""
        return self.plan.alike(self.output)

    @property
    def readings(self) -> Any:
        """How many readings a table has, or shape (T,) where they have gaps."""
        return len(self.output) if self.there is None else self.there.sum(axis=1)

    def known(self, values: Array) -> Array:
        """Values of readings, shape (n, T), with 0 at gaps."""
        return values if self.there is None else np.where(self.there.T, values, 0.0)

    @cached_property
    def residual(self) -> Array:
        """What the coefficients leave of the readings, shape (n, T) [output unit]."""
        return self.known(self.output - multiply(self.table.design, self.coefficients.T))

    @cached_property
    def smallest(self) -> Array:
        """Rounding error of these, shape (T,): readings alike to the last digit have it."""
        of_arithmetic = 4.0 * np.finfo(float).eps * np.abs(self.alike).max(axis=0)
        of_step = np.fmax(self.digit, self.step) / 12.0**0.5
        return np.asarray(np.maximum(of_arithmetic, of_step))

    @cached_property
    def plan(self) -> TablePlan:
        """What follows from angles, strokes, times and spreads."""
        return plan_of(self.table, self.time, self.there)

    @cached_property
    def hours(self) -> Array:
        """Length of each run, shape (D,) [h]; NaN where the times do not tell it."""
        if self.time is None:
            return np.full(1, np.nan)
        moment = self.plan.moment
        by_time = (moment == self.time[: len(moment)]).all(axis=1)
        return np.where(by_time, np.ptp(moment, axis=1) / HOUR, np.nan)

    @cached_property
    def apart(self) -> ReplicateFit:
        """Readings of one angle and one direction, a drift set aside."""
        return self.plan.apart.fit(self.alike)

    def place(self, index: int, reading: int) -> str:
        """Say which reading of a table it is: stroke, angle and line."""
        return reading_name(self.table.record, reading, self.line(index))


def stacked_times(records: Sequence[TumbleRecord], source: Places | None = None) -> Array | None:
    """Times of R records of one plan, shape (R, n) [s]; None where none has any.

    A record without times has a row of NaN. Records with gaps have those of the readings in some
    places, shape (R, n).
    """
    times = [record.time for record in records]
    if all(own is None for own in times):
        return None
    if source is not None:
        times = [None if t is None else t[at] for t, at in zip(times, source, strict=True)]
    nothing = np.full(next(own.size for own in times if own is not None), np.nan)
    return np.array([nothing if own is None else own for own in times])


def of_one_plan(tables: Sequence[PreparedTable]) -> list[list[int]]:
    """Group tables that can be stacked, by their places.

    Those of a plan have the same angles, strokes, mounting, coefficients and ratios of the declared
    scatter.
    """
    return places_of_equals(map(_plan_key, tables))


def _plan_key(table: PreparedTable) -> Hashable:
    record, spread = table.record, spread_of(table)
    unlike = None if spread is None else spread.size.tobytes()
    plan = record.angle.tobytes(), record.stroke.tobytes(), table.mounting
    return *plan, table.estimability.kept, unlike
