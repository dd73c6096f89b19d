"""Records of one plan, which can be calibrated together."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import replace
from operator import attrgetter, is_
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from accelcal.arrays import Array, Ints, Mask, Places
from accelcal.calibrate.gaps import beside_gaps, without_gaps
from accelcal.estimate.at_positions import as_read_there, at_positions
from accelcal.estimate.declared_scatter import is_weighted
from accelcal.estimate.launch import SAME_LEVEL
from accelcal.estimate.same_head import refuse_head_of_others
from accelcal.estimate.tables import PreparedTable, is_usable
from accelcal.gates.stack import stacked_times
from accelcal.numerics.grouping import places_of_equals
from accelcal.record import TumbleRecord, naming
from accelcal.reference import (
    declared_fixture_angle,
    level_of,
    reference_temperature_of,
    usual_reference,
)

if TYPE_CHECKING:
    from accelcal.results.head_calibration import HeadCalibration

_AT_A_TIME = 2000
"""Records of a plan that are calibrated together, at the memory of all their calibrations."""

_WITH_GAPS = 250
"""The same of records that lack readings, each its own: more are not quicker, and need memory."""

_NUMBERS = 2**22
"""Most of the squares of their readings in a table, as each has matrices of its own."""

_LONG = 1000
"""Readings of a record from which on one row alone is long enough for numpy to be quick."""

_of_tables = ("outputs", "temperatures", "recorded")
_of_plan = attrgetter("angle", "clamping", "stroke", "run", "mounting", "std", "count")


class OnePlan(NamedTuple):
    """Readings of R records with the same angles, strokes, runs, mountings and declarations.

    Attributes
    ----------
    records : sequence of TumbleRecord
        The records.
    outputs : tuple of ndarray, shape (R, n)
        Readings of each table [output unit].
    temperatures : tuple of ndarray, shape (R, n)
        Temperatures of each table, NaN where unknown and at gaps [degC].
    recorded : tuple of ndarray, shape (R, n)
        The same with those unknown at the mean of their table [degC].
    levels : ndarray, shape (R, tables)
        Mean temperature of each table, NaN where unknown [degC].
    masks : tuple of ndarray of bool
        Which readings of a record are of each table.
    runs : tuple of int
        Index of the run of each table.
    shared : TumbleRecord
        The first record, or one with the readings that any of them has.
    there : tuple of ndarray of bool, shape (R, n), or None
        Which readings of each table a record has, others being in the places of those that it
        lacks; None where no record lacks any.
    source : ndarray of int, shape (R, n), or None
        Places in each record of the readings of `shared`, where records lack any.
    """

    records: Sequence[TumbleRecord]
    outputs: tuple[Array, ...]
    temperatures: tuple[Array, ...]
    recorded: tuple[Array, ...]
    levels: Array
    masks: tuple[Mask, ...]
    runs: tuple[int, ...]
    shared: TumbleRecord
    there: tuple[Mask, ...] | None = None
    source: Places | None = None

    def can_be_stacked(self) -> Mask:
        """Tell which records can be calibrated with others, shape (R,), see `plans_of`."""
        usable = np.all([is_usable(y) for y in self.outputs], axis=0)
        return np.asarray(usable & (not is_weighted(self.records[0])))

    @property
    def at_a_time(self) -> int:
        """How many of the records are calibrated together."""
        if self.there is None:
            return _AT_A_TIME
        readings = max(int(own.shape[1]) for own in self.there)
        return min(_WITH_GAPS, _NUMBERS // readings**2)

    def moves(self) -> bool:
        """Whether a temperature of any record moves within a run."""
        return any(bool((np.ptp(own, axis=1) > 0.0).any()) for own in self.recorded)

    def times(self, tables: Sequence[int]) -> Array | None:
        """Times of the readings of some tables of one plan, table after table [s].

        None where no record has any; a row of NaN where one has none.
        """
        whole = stacked_times(self.records, self.source)
        if whole is None:
            return None
        return np.asarray(np.concatenate([whole[:, self.masks[t]] for t in tables]))

    def run_labels(self, record: int) -> list[str]:
        """Labels of the runs of all tables of one record."""
        labels = self.records[record].run_labels
        return [labels[run] for run in self.runs]

    def line(self, table: int, record: int) -> Ints | None:
        """Lines of the source with the readings of a table of one record."""
        line = self.records[record].line
        return None if line is None else line[self.masks[table]]

    @classmethod
    def of(cls, records: Sequence[TumbleRecord]) -> OnePlan:
        """Stack the readings of records of one plan, see `plans_of`."""
        output, temperature = (
            np.concatenate([getattr(record, name) for record in records]).reshape(len(records), -1)
            for name in ("output", "temperature")
        )
        return cls._of(records, records[0], output, temperature)

    @classmethod
    def with_gaps(cls, records: Sequence[TumbleRecord]) -> OnePlan:
        """Stack the readings of records that lack some of one plan, see `beside_gaps`."""
        shared, source, there = without_gaps(records)
        readings = [(record.output, record.temperature) for record in records]
        whole = [[own[at] for own in pair] for pair, at in zip(readings, source, strict=True)]
        output, temperature = map(np.array, zip(*whole, strict=True))
        plan = cls._of(records, shared, output, temperature)
        own = tuple(there[:, mask] for mask in plan.masks)
        known = tuple(np.where(*each, np.nan) for each in zip(own, plan.temperatures, strict=True))
        return plan._replace(there=own, source=source, temperatures=known)

    @classmethod
    def _of(
        cls,
        records: Sequence[TumbleRecord],
        shared: TumbleRecord,
        output: Array,
        temperature: Array,
    ) -> OnePlan:
        masks = tuple(shared.table_masks())
        temperatures = tuple(_of_table(temperature, mask) for mask in masks)
        levels = np.stack([level_of(t) for t in temperatures], axis=1)
        outputs = tuple(_of_table(output, mask) for mask in masks)
        recorded = tuple(map(_known_everywhere, temperatures, levels.T))
        runs = tuple(int(shared.run[mask.argmax()]) for mask in masks)
        return cls(records, outputs, temperatures, recorded, levels, masks, runs, shared)

    def references(self, given: float | None = None) -> Array:
        """T0 of each record, shape (R,), see `reference_temperature_of`; NaN where unknown."""
        if given is not None:
            return np.full(len(self.records), reference_temperature_of(self.records[0], given))
        declared = [record.reference_temperature for record in self.records]
        found = np.array(declared, dtype=np.float64)  # None becomes NaN
        if not np.isnan(found).any():
            return found
        return np.where(np.isnan(found), usual_reference(self._levels_of_runs()), found)

    def _levels_of_runs(self) -> Array:
        """Level of each run of each record, shape (R, runs)."""
        tables: dict[int, list[Array]] = {}
        for run, own in zip(self.runs, self.temperatures, strict=True):
            tables.setdefault(run, []).append(own)
        return np.stack([level_of(np.concatenate(tables[i], axis=1)) for i in sorted(tables)], 1)

    def of_records(self, places: Places) -> OnePlan:
        """Return some of the records; one alone has no gaps."""
        records = [self.records[i] for i in places.tolist()]
        if self.there is not None and len(records) == 1:
            return OnePlan.of(records)
        return self._replace(
            records=records,
            shared=records[0] if self.there is None else self.shared,
            there=self.there and tuple(own[places] for own in self.there),
            source=None if self.source is None else self.source[places],
            levels=self.levels[places],
            **{name: tuple(own[places] for own in getattr(self, name)) for name in _of_tables},
        )

    def at_true_angles(
        self, head: HeadCalibration, tables: Sequence[PreparedTable], delta0: float
    ) -> OnePlan:
        """Take the known errors of the head out of the readings.

        The records have Y(th) in place of Y(th + e), e the error of the position, and the
        uncertainty that is left of the head as the declared one.

        Raises
        ------
        InputError
            If a record names another head, or a position of the test is none of the head.

        Notes
        -----
        The coefficients that make the difference are those of the readings that it makes.
        """
        refuse_head_of_others(head, self.records)
        first = self.records[0]
        whole = np.empty((len(self.records), len(first)))
        for table, mask, readings in zip(tables, self.masks, self.outputs, strict=True):
            with naming(first):
                error, _ = head.at(table.head)
            true = table.record.angle + np.rad2deg(error)
            whole[:, mask] = as_read_there(table, readings, true, delta0)
        apparatus = replace(first.apparatus, head_uncertainty=head.uncertainty)
        records = [
            replace(record, output=output, apparatus=apparatus)
            for record, output in zip(self.records, whole, strict=True)
        ]
        outputs = tuple(whole[:, mask] for mask in self.masks)
        return self._replace(records=records, outputs=outputs)


def _of_table(values: Array, mask: Mask) -> Array:
    """Values of one table in all records, in the order in memory that numpy is quick with."""
    if mask.size < _LONG:
        return values[:, mask]  # column by column: the records of one reading lie side by side
    return values.compress(mask, axis=1)


def _known_everywhere(temperature: Array, level: Array) -> Array:
    """Temperatures of a table, the mean where they are unknown."""
    known = np.isfinite(temperature)
    return temperature if known.all() else np.where(known, temperature, level[:, None])


def plans_of(
    records: Sequence[TumbleRecord], delta0: float | None, *, gaps: bool = False
) -> list[tuple[Places, OnePlan]]:
    """Group records that can be calibrated together, with the fixture angle of all [rad].

    None is the one that each record declares. A plan comes with the places of its records; those of
    many records come in parts of two thousand. A record is alone where its readings are none of an
    accelerometer, so that it harms no other, or have a say in their weights. With `gaps`, those
    that nearly have one plan are together too, see `beside_gaps`.

    Notes
    -----
    Where temperatures repeat, shifts from run to run come from the runs of one level, so the runs
    that share a level, and those that were reached by heating, are a part of the plan.
    """
    found = []
    records = list(_at_positions(records, delta0))
    for places, whole in _groups(records, delta0, gaps=gaps):
        most = whole.at_a_time
        keys = zip(whole.can_be_stacked().tolist(), _level_keys(whole.levels), places, strict=True)
        for own in places_of_equals(key if good else place for good, key, place in keys):
            for start in range(0, len(own), most):
                rows = np.array(own[start : start + most])
                part = whole if len(rows) == len(places) else whole.of_records(rows)
                found.append((np.array(places)[rows], part))
    return found


def _groups(
    records: Sequence[TumbleRecord], delta0: float | None, *, gaps: bool
) -> Iterator[tuple[list[int], OnePlan]]:
    """Places of the records of each plan, then of those that lack readings, and their stacks."""
    lone: list[int] = []
    for places in places_of_equals(_plan_keys(records, delta0)):
        if gaps and len(places) == 1:
            lone += places
        else:
            yield places, OnePlan.of([records[i] for i in places])
    keys = ((beside_gaps(records[i]) or i, *_declared(records[i], delta0)) for i in lone)
    for same in places_of_equals(keys):
        own = [records[lone[i]] for i in same]
        stacked = OnePlan.of(own) if len(own) == 1 else OnePlan.with_gaps(own)
        yield [lone[i] for i in same], stacked


def _declared(record: TumbleRecord, delta0: float | None) -> Sequence[Hashable]:
    """What is declared of two records of one plan alike."""
    fixture = declared_fixture_angle(record) if delta0 is None else None
    return len(record.run_labels), record.apparatus, record.unit, fixture


def _at_positions(records: Sequence[TumbleRecord], delta0: float | None) -> Iterator[TumbleRecord]:
    """Bring each record to the nominal angles of its positions."""
    exact: Array | None = None
    for record in records:
        # Neighbours mostly have the very same angles, so that one look at them does for all.
        if record.angle is exact and record.clamping is None:
            yield record
            continue
        there = at_positions(record, delta0)
        exact = record.angle if there is record and record.clamping is None else None
        yield there


def _plan_keys(records: Sequence[TumbleRecord], delta0: float | None) -> Iterator[Hashable]:
    """What must be equal for two records to have one plan, for each of the records."""
    before: Sequence[object] = ()
    content: Hashable = None
    for record in records:
        arrays = _of_plan(record)
        # The reader of many tables gives neighbours the very same arrays. Where it does, their
        # content need not be looked at.
        if not (before and all(map(is_, arrays, before))):
            before = arrays
            content = tuple(None if a is None else (a.dtype, a.tobytes()) for a in arrays)
        yield content, *_declared(record, delta0)


def _level_keys(levels: Array) -> list[bytes]:
    """What counts of the temperatures of each record: which differ, and in which direction."""
    step = levels[:, None, :] - levels[:, :, None]
    sign = np.sign(step) * (np.abs(step) > SAME_LEVEL)
    order = np.sort(levels, axis=1)  # NaN come last
    breaks = np.diff(order, axis=1) > SAME_LEVEL
    rank = np.argsort(np.argsort(levels, axis=1), axis=1)
    level = np.concatenate([np.zeros((len(levels), 1)), np.cumsum(breaks, axis=1)], axis=1)
    group = np.where(np.isnan(levels), np.nan, np.take_along_axis(level, rank, axis=1))
    whole = np.concatenate([np.nan_to_num(sign).reshape(len(levels), -1), group], axis=1)
    keys = np.nan_to_num(whole, nan=-9.0).astype(np.int8)
    found: list[bytes] = keys.view(f"V{keys.shape[1]}")[:, 0].tolist()
    return found
