"""From the cells of many ordinary tables to records: the rules of the reader, for all at once.

The rules are those of `readings`, `runs` and `tables`. A table that breaks one, or of which they
have more to say than the plain reading, gets no record here.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from itertools import groupby, repeat, starmap
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from accelcal.arrays import Ints, Mask
from accelcal.geometry import MOUNTINGS
from accelcal.io.engines import MAY_BE_DECIMALS
from accelcal.io.ordinary.cell_blocks import CellBlock
from accelcal.io.ordinary.plans import (
    PLANNED,
    Leading,
    Parts,
    Plans,
    Stretches,
    leading_of,
    parts_of,
    read_plans,
    without_gaps,
)
from accelcal.io.readings import FEWEST_IN_TURN
from accelcal.io.values.markers import FARTHEST, are_markers
from accelcal.io.values.places import notes_of_minutes
from accelcal.pace import LATEST, QUICKEST
from accelcal.record import TumbleRecord


class Rules(NamedTuple):
    """What must be the same for tables that are read together."""

    roles: tuple[str, ...]  # what the columns hold
    positions: int  # number of positions in a full turn
    factor: float  # unit of the times [s]


class Plain(NamedTuple):
    """An ordinary table, its cells not yet read."""

    body: bytes  # the rows
    rows: int  # their number
    line: int  # of the first
    # fields of the record that the rows do not hold: those that most tables have in common, and
    # those of the table itself, which win
    declared: Mapping[str, Any]
    own: Mapping[str, Any]


class Group(NamedTuple):
    """Ordinary tables that are read together."""

    rules: Rules  # what is the same for them
    tables: list[Plain]
    cells: CellBlock  # their cells, table below table


def records_of(group: Group) -> list[tuple[TumbleRecord, ...] | None]:
    """Make the records of a group.

    One for each serial of a table; None where the general reader must read it.
    """
    tables = Stretches.of(np.array([table.rows for table in group.tables]))
    parts = parts_of(group.cells.codes.get("serial"), tables)
    readings, odd_part = _readings(group, parts)
    leading = leading_of(parts.rows, group.cells.columns(PLANNED))
    planned = group.cells.some(PLANNED, leading.places)
    plans = read_plans(planned, leading.rows, group.rules.positions)
    odd_table = _odd_turns(plans, leading, parts, group)
    odd_table[parts.table[odd_part | plans.odd[leading.of]]] = True
    good = np.flatnonzero(~odd_table[parts.table])
    values = {
        **_of_tables(group, parts, good),
        "line": _lines(group, tables, parts, good),
        **_of_readings(readings, parts.rows.some(good)),
        **_of_plans(plans, leading, good),
    }
    records: list[list[TumbleRecord]] = [[] for _ in group.tables]
    for table, record in zip(parts.table[good].tolist(), _filled(values, good.size), strict=True):
        records[table].append(record)
    pairs = zip(odd_table.tolist(), records, strict=True)
    return [None if bad else tuple(own) for bad, own in pairs]


# -- what is odd -----------------------------------------------------------------------------------


def _readings(group: Group, parts: Parts) -> tuple[dict[str, Any], Mask]:
    """Columns of the readings themselves, and which parts have odd ones, or an odd serial."""
    cells = group.cells
    own = {role: values for role, values in cells.numbers.items() if role not in PLANNED}
    numbers, odd_row = without_gaps(own)
    output, std, count = numbers["output"], numbers.get("std"), numbers.get("count")
    time = numbers["time"] * group.rules.factor if "time" in numbers else None
    odd_row |= are_markers(output)
    if std is not None:
        odd_row |= std < 0.0
    if count is not None:
        odd_row |= count < 1.0
    same = parts.rows.lowest(output) == parts.rows.highest(output)
    odd = parts.rows.any(odd_row) | parts.again | (same & (parts.rows.size > 1))
    odd |= _has_far(output, parts.rows) | _may_count(output, parts.rows)
    odd |= False if count is None else _may_count(count, parts.rows)
    odd |= _may_be_split(numbers["output"][parts.rows.start], group.rules.roles)
    if time is not None:
        odd |= parts.rows.any(_goes_back(time, parts.rows))
        odd |= ~(parts.rows.highest(np.abs(time)) <= LATEST)
        odd |= parts.rows.highest(time) - parts.rows.lowest(time) < QUICKEST * (parts.rows.size - 1)
    if "serial" in cells.labels:
        odd |= cells.odd_labels("serial", parts.code)
    # a table with clampings is left to the general reader
    return {"output": output, "time": time, "std": std, "count": count, "clamping": None}, odd


def _has_far(output: Any, rows: Stretches) -> Mask:
    """Tell which may have an output far larger than all others, and so than their sum."""
    size = np.abs(output)
    highest = rows.highest(size)
    with np.errstate(over="ignore"):
        is_far = highest > FARTHEST * rows.lowest(size)
        return np.asarray(is_far & (highest > np.add.reduceat(0.5 * size, rows.start)))


def _may_be_split(first: Any, roles: Sequence[str]) -> Any:
    """Tell which may have decimals in the next column, by their first outputs."""
    behind = roles[roles.index("output") + 1 :][:1]
    return (np.abs(first) < 1000.0) & (first % 1.0 == 0.0) & bool({*behind} & {*MAY_BE_DECIMALS})


def _may_count(values: Any, rows: Stretches) -> Mask:
    """Tell which may count their rows, by the first and last one."""
    first, last = values[rows.start], values[rows.start + rows.size - 1]
    return np.asarray(last - first == rows.size - 1)


def _goes_back(time: Any, rows: Stretches) -> Mask:
    """Mask of the rows with a time before that of the row above."""
    back: Mask = np.concatenate([[False], time[1:] < time[:-1]])
    back[rows.start] = False
    return back


def _odd_turns(plans: Plans, leading: Leading, parts: Parts, group: Group) -> Mask:
    """Tables whose angles may be radians or minutes, or whose turn may have fewer positions."""
    first = np.searchsorted(parts.table, np.arange(len(group.tables)))
    odd = np.zeros(first.size, dtype=bool)
    if "angle" in group.cells.numbers:
        low = np.minimum.reduceat(leading.rows.lowest(plans.angle)[leading.of], first)
        high = np.maximum.reduceat(leading.rows.highest(plans.angle)[leading.of], first)
        odd |= (high - low >= 1.5) & (np.maximum(high, -low) <= 2.0001 * np.pi)
        minutes = np.array([*map(bool, map(notes_of_minutes, leading.rows.cut(plans.angle)))])
        odd[parts.table[minutes[leading.of]]] = True
    if "position" in group.cells.numbers:
        last = np.maximum.reduceat(leading.rows.highest(plans.position)[leading.of], first)
        odd |= (last >= FEWEST_IN_TURN) & (last < group.rules.positions)
    return odd


# -- fields of the records -------------------------------------------------------------------------


def _of_tables(group: Group, parts: Parts, good: Ints) -> dict[str, list[Any]]:
    """Fields that are declared for a table, and the serials of its rows."""
    tables = [group.tables[table] for table in parts.table[good].tolist()]
    values = {**_declared(tables), **{n: [t.own[n] for t in tables] for n in group.tables[0].own}}
    if "serial" in group.cells.labels:
        serials = group.cells.labels["serial"]
        values["serial"] = [serials[i] for i in parts.code[good].tolist()]
    return values


def _declared(tables: Sequence[Plain]) -> dict[str, list[Any]]:
    """Fields that most tables have in common."""
    found: dict[str, list[Any]] = {}
    for declared, run in groupby(tables, key=attrgetter("declared")):
        count = sum(1 for _ in run)
        for name, value in declared.items():
            found.setdefault(name, []).extend(repeat(value, count))
    return found


def _lines(group: Group, tables: Stretches, parts: Parts, good: Ints) -> list[Ints]:
    """Lines of each record, cut from one count as those of many files are the same."""
    if not good.size:
        return []
    above = np.array([table.line for table in group.tables]) - tables.start
    rows = parts.rows.some(good)
    first = above[parts.table[good]] + rows.start
    low = int(first.min())
    return Stretches(first - low, rows.size).cut(np.arange(low, int((first + rows.size).max())))


def _of_readings(readings: Mapping[str, Any], rows: Stretches) -> dict[str, list[Any]]:
    unknown = [None] * rows.size.size
    return {name: unknown if own is None else rows.cut(own) for name, own in readings.items()}


def _of_plans(plans: Plans, leading: Leading, good: Ints) -> dict[str, list[Any]]:
    """Fields of a plan; records of one plan have the same arrays, whatever their temperatures."""
    names = ("angle", "stroke", "position", "run", "mounting")
    shared = leading_of(leading.rows, [getattr(plans, name) for name in names])
    places, own = shared.of[leading.of[good]].tolist(), leading.of[good].tolist()
    columns = {name: getattr(plans, name)[shared.places] for name in names}
    columns["mounting"] = np.array(MOUNTINGS)[columns["mounting"]]
    temperature = leading.rows.cut(plans.temperature)
    values = {"temperature": [temperature[i] for i in own]}
    values["run_labels"] = [plans.run_labels[i] for i in own]
    for name, column in columns.items():
        cut = shared.rows.cut(column)
        values[name] = [cut[i] for i in places]
    return values


def _filled(values: Mapping[str, Sequence[Any]], number: int) -> list[TumbleRecord]:
    """Make records of fields that have passed all checks of a record here."""
    records = [object.__new__(TumbleRecord) for _ in range(number)]
    for name, own in values.items():
        put = getattr(TumbleRecord, name).__set__
        deque(starmap(put, zip(records, own, strict=True)), maxlen=0)
    return records
