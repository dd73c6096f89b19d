"""From the cells of many ordinary tables to records: the rules of the reader, for all at once.

The rules are those of `readings`, `runs` and `tables`. A table that breaks one, or of which they
have more to say than the plain reading, gets no record here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.geometry import MOUNTINGS
from accelcal.grouping import distinct, grouped
from accelcal.io.cell_blocks import CellBlock
from accelcal.io.readings import (
    FEWEST_IN_TURN,
    MARKERS,
    MAXIMUM_ANGLE,
    MAXIMUM_TEMPERATURE,
)
from accelcal.io.runs import LEVEL_GAP
from accelcal.record import TumbleRecord

__all__ = ["Group", "Plain", "Rules", "records_of"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

_MOST = 10_000  # strokes, positions: more are no ordinary test


class Rules(NamedTuple):
    """What must be the same for tables that are read together.

    Attributes
    ----------
    roles : tuple of str
        What the columns hold.
    positions : int
        Number of positions in a full turn.
    factor : float
        Unit of the times [s].
    """

    roles: tuple[str, ...]
    positions: int
    factor: float


class Plain(NamedTuple):
    """An ordinary table, its cells not yet read.

    Attributes
    ----------
    body : bytes
        The rows.
    rows, line : int
        Their number, and the line of the first.
    fields : mapping of str to object
        Fields of the record that the rows do not hold.
    """

    body: bytes
    rows: int
    line: int
    fields: Mapping[str, Any]


class Group(NamedTuple):
    """Ordinary tables that are read together.

    Attributes
    ----------
    rules : Rules
        What is the same for them.
    tables : list of Plain
        The tables.
    cells : CellBlock
        Their cells, table below table.
    """

    rules: Rules
    tables: list[Plain]
    cells: CellBlock


def records_of(group: Group) -> list[tuple[TumbleRecord, ...] | None]:
    """Make the records of a group.

    Parameters
    ----------
    group : Group
        Tables with the same columns.

    Returns
    -------
    list of tuple of TumbleRecord, or None
        Records of each table, one a serial; None where the general reader must read it.
    """
    rows = np.array([table.rows for table in group.tables])
    starts = np.cumsum(rows) - rows
    parts = _parts(group.cells.codes.get("serial"), rows, starts)
    columns, odd_row = _columns(group)
    odd = np.logical_or.reduceat(odd_row, starts) | _odd_turns(columns, group, starts)
    runs = _runs(columns, group.cells, parts)
    odd[parts.table[runs.odd | _repeated(columns, runs, parts) | _all_equal(columns, parts)]] = True
    odd |= np.bincount(parts.table[parts.again], minlength=rows.size) > 0
    line = np.array([table.line for table in group.tables])
    arrays = {
        **columns,
        "mounting": np.array(MOUNTINGS)[columns["mounting"]],
        "run": runs.of_row,
        "line": np.repeat(line - starts, rows) + np.arange(runs.of_row.size),
    }
    return _records(group, arrays, parts, runs, odd)


class _Parts(NamedTuple):
    """Stretches of rows of one accelerometer."""

    of_row: Ints
    start: Ints
    end: Ints
    table: Ints
    code: Ints  # of its serial
    again: Mask  # serial that the table had before


class _Runs(NamedTuple):
    """Runs of all parts, one after the other."""

    of_row: Ints  # of each row, within its part
    first: Ints  # the first run of each part, and the number of all
    labels: list[str]
    odd: Mask  # parts whose runs need the general reader


# -- rows ------------------------------------------------------------------------------------------


def _columns(group: Group) -> tuple[dict[str, Any], Mask]:
    """Arrays of the record by name, mountings by number, and which rows are odd."""
    numbers = group.cells.numbers
    odd: Mask = ~np.logical_and.reduce([np.isfinite(values) for values in numbers.values()])
    if odd.any():
        numbers = {role: np.where(odd, 1.0, values) for role, values in numbers.items()}
    temperature, stroke, output = (numbers[role] for role in ("temperature", "stroke", "output"))
    odd |= (temperature < -273.15) | (temperature > MAXIMUM_TEMPERATURE)
    odd |= ~_is_whole(stroke, _MOST) | _is_marker(output)
    if "std" in numbers:
        odd |= numbers["std"] < 0.0
    if "count" in numbers:
        odd |= numbers["count"] < 1.0
    position, angle, misplaced = _places(numbers, group.rules.positions)
    mounting, unknown = _mounting(group.cells, stroke.size)
    columns = {
        "output": output,
        "angle": angle,
        "temperature": temperature,
        "stroke": np.clip(stroke, 1, _MOST).astype(np.int64),  # odd rows may hold anything
        "mounting": mounting,
        "position": position,
        "time": numbers["time"] * group.rules.factor if "time" in numbers else None,
        "std": numbers.get("std"),
        "count": numbers.get("count"),
        "clamping": None,  # a table with such a column is left to the general reader
    }
    return columns, odd | misplaced | unknown | _is_empty(group.cells, stroke.size)


def _is_whole(values: Floats, most: float) -> Mask:
    return np.asarray((values >= 1.0) & (values <= most) & (values == np.floor(values)))


def _is_marker(output: Floats) -> Any:
    """Tell which readings may be what loggers write for a missing one."""
    size = np.abs(output)
    return np.isin(size, MARKERS) if size.max() >= min(MARKERS) else False


def _places(numbers: Mapping[str, Floats], positions: int) -> tuple[Ints, Floats, Any]:
    """Position, head angle, and which rows have none that is ordinary."""
    if "position" not in numbers:
        angle = numbers["angle"]
        return np.zeros(angle.size, dtype=np.int64), angle, np.abs(angle) > MAXIMUM_ANGLE
    odd = ~_is_whole(numbers["position"], min(positions + 1, _MOST))
    position = np.where(odd, 1, numbers["position"]).astype(np.int64)
    nominal = (position - 1) * 360.0 / positions
    if "angle" not in numbers:
        return position, nominal, odd
    angle = numbers["angle"]
    away = np.abs(np.mod(angle - nominal + 180.0, 360.0) - 180.0) > 180.0 / positions
    return position, angle, odd | away | (np.abs(angle) > MAXIMUM_ANGLE)


def _mounting(cells: CellBlock, size: int) -> tuple[Ints, Any]:
    """Mounting of each row as a place in `MOUNTINGS`, and which rows have none that is known."""
    if "mounting" not in cells.codes:
        return np.zeros(size, dtype=np.int64), False
    names = [name.casefold() for name in cells.labels["mounting"]]
    names = [name + "+" if name in ("o", "p") else name for name in names]
    place = np.array([MOUNTINGS.index(name) if name in MOUNTINGS else -1 for name in names])
    of_row = place[cells.codes["mounting"]]
    return np.maximum(of_row, 0), of_row < 0


def _is_empty(cells: CellBlock, size: int) -> Mask:
    empty = np.zeros(size, dtype=bool)
    for role, names in cells.labels.items():
        if "" in names:
            empty |= cells.codes[role] == names.index("")
    return empty


# -- tables ----------------------------------------------------------------------------------------


def _odd_turns(columns: Mapping[str, Any], group: Group, starts: Ints) -> Mask:
    """Tables whose angles may be radians, or whose turn may have fewer positions than declared."""
    angle = columns["angle"]
    low, high = np.minimum.reduceat(angle, starts), np.maximum.reduceat(angle, starts)
    odd = np.zeros(starts.size, dtype=bool)
    if "angle" in group.cells.numbers:
        odd |= (high - low >= 1.5) & (np.maximum(high, -low) <= 2.0001 * np.pi)
    if "position" in group.cells.numbers:
        last = np.maximum.reduceat(columns["position"], starts)
        odd |= (last >= FEWEST_IN_TURN) & (last < group.rules.positions)
    return odd


def _parts(serial: Ints | None, rows: Ints, starts: Ints) -> _Parts:
    table = np.arange(rows.size)
    if serial is None:
        nothing = np.zeros_like(table)
        return _Parts(np.repeat(table, rows), starts, starts + rows, table, nothing, nothing > 0)
    first = np.concatenate([[True], serial[1:] != serial[:-1]])
    first[starts] = True
    start = np.flatnonzero(first)
    table = np.repeat(table, rows)[start]
    return _Parts(
        of_row=np.cumsum(first) - 1,
        start=start,
        end=np.append(start[1:], serial.size),
        table=table,
        code=serial[start],
        again=_met_before(table, serial[start]),
    )


def _met_before(group: Ints, code: Ints) -> Mask:
    """Mask of the entries whose group had their code before."""
    order = np.lexsort((code, group))  # stable
    again = np.zeros(order.size, dtype=bool)
    same = (group[order][1:] == group[order][:-1]) & (code[order][1:] == code[order][:-1])
    again[order[1:][same]] = True
    return again


# -- parts -----------------------------------------------------------------------------------------


def _runs(columns: Mapping[str, Any], cells: CellBlock, parts: _Parts) -> _Runs:
    """Runs in the order of the rows; parts in which one comes back are odd."""
    named = "run" in cells.codes
    odd = np.zeros(parts.start.size, dtype=bool)
    code = cells.codes["run"] if named else _levels(columns["temperature"], parts, odd)
    change = np.concatenate([[True], code[1:] != code[:-1]])
    change[parts.start] = True
    start = np.flatnonzero(change)
    owner = parts.of_row[start]
    odd[owner[_met_before(owner, code[start])]] = True
    run = np.cumsum(change) - 1
    if named:
        labels = [cells.labels["run"][i] for i in code[start].tolist()]
    else:
        odd |= _goes_back(columns["time"], parts)
        means = np.bincount(run, weights=columns["temperature"]) / np.bincount(run)
        degrees = (np.rint(means) + 0.0).tolist()  # + 0.0 makes -0 a 0
        label = {degree: f"{degree:g}" for degree in set(degrees)}
        labels = [label[degree] for degree in degrees]
    first = np.searchsorted(owner, np.arange(parts.start.size + 1))
    return _Runs(run - first[parts.of_row], first, labels, odd)


def _levels(temperature: Floats, parts: _Parts, odd: Mask) -> Ints:
    """Levels of temperature, as `runs` splits them; parts with a wide level become odd."""
    change = np.concatenate([[True], temperature[1:] != temperature[:-1]])
    change[parts.start] = True
    start = np.flatnonzero(change)  # of stretches of one temperature, to be put in order
    owner, value = parts.of_row[start], temperature[start]
    order = np.lexsort((value, owner))
    ordered = value[order]
    jump = (np.diff(ordered) > LEVEL_GAP) | (owner[1:] > owner[:-1])  # owners are in order
    first = np.concatenate([[0], np.flatnonzero(jump) + 1])
    last = np.append(first[1:], order.size) - 1
    odd[owner[first[ordered[last] - ordered[first] > LEVEL_GAP]]] = True
    level = np.empty(order.size, dtype=np.int64)
    level[order] = np.concatenate([[0], np.cumsum(jump)])
    return np.repeat(level, np.diff(start, append=temperature.size))


def _goes_back(time: Floats | None, parts: _Parts) -> Mask:
    """Parts whose rows are not in the order of time."""
    if time is None:
        return np.zeros(parts.start.size, dtype=bool)
    back = np.concatenate([[False], time[1:] < time[:-1]])
    back[parts.start] = False
    return np.asarray(np.logical_or.reduceat(back, parts.start))


def _repeated(columns: Mapping[str, Any], runs: _Runs, parts: _Parts) -> Mask:
    """Parts that have a reading twice."""
    place = columns["position"]
    if not place.any():
        place = _codes(columns["angle"], parts.end[0])
    key = parts.of_row
    size = 1
    for code in (runs.of_row, columns["mounting"], columns["stroke"], place):
        span = int(code.max()) + 1
        key = key * span + code
        size *= span
    odd = np.zeros(parts.start.size, dtype=bool)
    odd[_met_twice(key) // size] = True
    return odd


def _codes(values: Floats, few: int) -> Ints:
    """Number the values so that equal ones have one number; all are mostly among the first few."""
    known = distinct(values[:few])
    code = np.minimum(np.searchsorted(known, values), known.size - 1)
    return code if (known[code] == values).all() else grouped(values)[1]


def _met_twice(key: Ints) -> Ints:
    if key.max() < 8 * key.size:  # counting is quicker than sorting
        return np.flatnonzero(np.bincount(key) > 1)
    key = np.sort(key)
    return np.asarray(key[1:][key[1:] == key[:-1]])


def _all_equal(columns: Mapping[str, Any], parts: _Parts) -> Mask:
    low = np.minimum.reduceat(columns["output"], parts.start)
    high = np.maximum.reduceat(columns["output"], parts.start)
    return np.asarray((low == high) & (parts.end - parts.start > 1))


# -- records ---------------------------------------------------------------------------------------


def _records(
    group: Group, arrays: Mapping[str, Any], parts: _Parts, runs: _Runs, odd: Mask
) -> list[tuple[TumbleRecord, ...] | None]:
    good = np.flatnonzero(~odd[parts.table])
    of_table = parts.table[good].tolist()
    rows = list(map(slice, parts.start[good].tolist(), parts.end[good].tolist()))
    records = [object.__new__(TumbleRecord) for _ in rows]
    for name, array in arrays.items():
        _fill(records, name, [None] * len(rows) if array is None else _cut(array, rows))
    fields = [group.tables[table].fields for table in of_table]
    for name in group.tables[0].fields:
        _fill(records, name, [own[name] for own in fields])
    _fill(records, "run_labels", _labels_of(runs, good))
    if "serial" in group.cells.labels:
        serials = group.cells.labels["serial"]
        _fill(records, "serial", [serials[i] for i in parts.code[good].tolist()])
    found: list[list[TumbleRecord]] = [[] for _ in group.tables]
    for table, record in zip(of_table, records, strict=True):
        found[table].append(record)
    return [None if bad else tuple(own) for bad, own in zip(odd.tolist(), found, strict=True)]


def _cut(array: NDArray[Any], rows: Sequence[slice]) -> list[NDArray[Any]]:
    array.setflags(write=False)
    return [array[own] for own in rows]


def _labels_of(runs: _Runs, parts: Ints) -> list[tuple[str, ...]]:
    first = runs.first.tolist()
    return [tuple(runs.labels[first[i] : first[i + 1]]) for i in parts.tolist()]


def _fill(records: Sequence[TumbleRecord], name: str, values: Sequence[Any]) -> None:
    """Set a field of new records, whose values have passed all checks of a record here."""
    put = getattr(TumbleRecord, name).__set__
    for record, value in zip(records, values, strict=True):
        put(record, value)
