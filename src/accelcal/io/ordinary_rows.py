"""From the cells of many ordinary tables to records: the rules of the reader, for all at once.

The rules are those of `readings`, `runs` and `tables`. A table that breaks one, or of which they
have more to say than the plain reading, gets no record here.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.geometry import MOUNTINGS, is_mounting
from accelcal.io.cell_blocks import CellBlock
from accelcal.io.readings import (
    FEWEST_IN_TURN,
    MARKERS,
    MAXIMUM_ANGLE,
    MAXIMUM_TEMPERATURE,
)
from accelcal.io.runs import LEVEL_GAP
from accelcal.record import TumbleRecord

__all__ = ["Group", "Plain", "records_of"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

_MOST = 10_000  # strokes, positions: more are no ordinary test


class Plain(NamedTuple):
    """An ordinary table, its cells not yet read.

    Attributes
    ----------
    body : bytes
        The rows.
    rows, line : int
        Their number, and the line of the first.
    roles : tuple of str
        What the columns hold.
    factor : float
        Unit of the times [s].
    fields : mapping of str to object
        Fields of the record that the rows do not hold.
    """

    body: bytes
    rows: int
    line: int
    roles: tuple[str, ...]
    factor: float
    fields: Mapping[str, Any]


class Group(NamedTuple):
    """Ordinary tables with the same columns.

    Attributes
    ----------
    tables : list of Plain
        The tables.
    cells : CellBlock
        Their cells, table below table.
    """

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
    starts = np.concatenate([[0], np.cumsum(rows)[:-1]])
    table = np.repeat(np.arange(rows.size), rows)
    columns = _columns(group, table, starts)
    odd = np.logical_or.reduceat(columns.pop("odd"), starts) | _odd_turns(columns, group, starts)
    parts = _parts(columns.pop("serial"), table)
    runs = _runs(columns, group.cells, parts)
    odd[parts.table[runs.odd | _repeated(columns, runs, parts) | _all_equal(columns, parts)]] = True
    odd |= np.bincount(parts.table[parts.again], minlength=rows.size) > 0
    columns["run"] = runs.of_row
    return _records(group, columns, parts, runs, odd)


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


def _columns(group: Group, table: Ints, starts: Ints) -> dict[str, Any]:
    """Arrays of the record by name, and which rows are odd."""
    numbers, codes = group.cells.numbers, group.cells.codes
    positions = np.array([t.fields["positions"] for t in group.tables])[table]
    odd: Mask = ~np.logical_and.reduce([np.isfinite(values) for values in numbers.values()])
    numbers = {role: np.where(odd, 1.0, values) for role, values in numbers.items()}
    temperature, stroke = numbers["temperature"], numbers["stroke"]
    odd |= (temperature < -273.15) | (temperature > MAXIMUM_TEMPERATURE)
    odd |= ~_is_whole(stroke, _MOST) | np.isin(np.abs(numbers["output"]), MARKERS)
    odd |= (numbers.get("std", stroke) < 0.0) | (numbers.get("count", stroke) < 1.0)
    position, angle, misplaced = _places(numbers, positions)
    mounting, unknown = _mounting(group.cells, stroke.size)
    factor = np.array([t.factor for t in group.tables])[table]
    line = np.array([t.line for t in group.tables])[table] + np.arange(table.size) - starts[table]
    return {
        "output": numbers["output"],
        "angle": angle,
        "temperature": temperature,
        "stroke": stroke.astype(np.int64),
        "mounting": mounting,
        "position": position,
        "time": numbers["time"] * factor if "time" in numbers else None,
        "std": numbers.get("std"),
        "count": numbers.get("count"),
        "clamping": None,  # a table with such a column is left to the general reader
        "line": line,
        "serial": codes.get("serial", np.zeros(stroke.size, dtype=np.int64)),
        "odd": odd | misplaced | unknown | _is_empty(group.cells, stroke.size),
    }


def _is_whole(values: Floats, most: Any) -> Mask:
    return np.asarray((values >= 1.0) & (values <= most) & (values == np.floor(values)))


def _places(numbers: Mapping[str, Floats], positions: Ints) -> tuple[Ints, Floats, Any]:
    """Position, head angle, and which rows have none that is ordinary."""
    if "position" not in numbers:
        angle = numbers["angle"]
        return np.zeros(angle.size, dtype=np.int64), angle, np.abs(angle) > MAXIMUM_ANGLE
    odd = ~_is_whole(numbers["position"], np.minimum(positions + 1, _MOST))
    position = np.where(odd, 1, numbers["position"]).astype(np.int64)
    nominal = (position - 1) * 360.0 / positions
    if "angle" not in numbers:
        return position, nominal, odd
    angle = numbers["angle"]
    away = np.abs(np.mod(angle - nominal + 180.0, 360.0) - 180.0) > 180.0 / positions
    return position, angle, odd | away | (np.abs(angle) > MAXIMUM_ANGLE)


def _mounting(cells: CellBlock, size: int) -> tuple[NDArray[np.str_], Any]:
    """Mounting of each row, and which rows have none that is known."""
    if "mounting" not in cells.codes:
        return np.full(size, MOUNTINGS[0]), False
    names = [name.casefold() for name in cells.labels["mounting"]]
    names = [name + "+" if name in ("o", "p") else name for name in names]
    good = is_mounting(np.array(names))
    known = np.array([name if ok else MOUNTINGS[0] for name, ok in zip(names, good, strict=True)])
    return known[cells.codes["mounting"]], ~good[cells.codes["mounting"]]


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
        positions = np.array([table.fields["positions"] for table in group.tables])
        odd |= (last >= FEWEST_IN_TURN) & (last < positions)
    return odd


def _parts(serial: Ints, table: Ints) -> _Parts:
    first = np.concatenate([[True], (table[1:] != table[:-1]) | (serial[1:] != serial[:-1])])
    start = np.flatnonzero(first)
    end = np.append(start[1:], table.size)
    return _Parts(
        of_row=np.cumsum(first) - 1,
        start=start,
        end=end,
        table=table[start],
        code=serial[start],
        again=_met_before(table[start], serial[start]),
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
        labels = [f"{round(mean) + 0.0:g}" for mean in means.tolist()]
    first = np.searchsorted(owner, np.arange(parts.start.size + 1))
    return _Runs(run - first[parts.of_row], first, labels, odd)


def _levels(temperature: Floats, parts: _Parts, odd: Mask) -> Ints:
    """Levels of temperature, as `runs` splits them; parts with a wide level become odd."""
    order = np.lexsort((temperature, parts.of_row))
    ordered = temperature[order]
    jump = np.diff(ordered) > LEVEL_GAP
    jump[parts.start[1:] - 1] = True  # rows of a part stay together in this order
    level = np.concatenate([[0], np.cumsum(jump)])
    first = np.concatenate([[0], np.flatnonzero(jump) + 1])
    last = np.append(first[1:], order.size) - 1
    wide = ordered[last] - ordered[first] > LEVEL_GAP
    odd[parts.of_row[order][first[wide]]] = True
    found = np.empty(order.size, dtype=np.int64)
    found[order] = level
    return found


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
        place = np.unique(columns["angle"], return_inverse=True)[1]
    mounting = np.searchsorted(MOUNTINGS, columns["mounting"])
    key = parts.of_row
    size = 1
    for code in (runs.of_row, mounting, np.minimum(columns["stroke"], _MOST), place):
        span = int(code.max()) + 1
        key = key * span + code
        size *= span
    key = np.sort(key)
    odd = np.zeros(parts.start.size, dtype=bool)
    odd[key[1:][key[1:] == key[:-1]] // size] = True
    return odd


def _all_equal(columns: Mapping[str, Any], parts: _Parts) -> Mask:
    low = np.minimum.reduceat(columns["output"], parts.start)
    high = np.maximum.reduceat(columns["output"], parts.start)
    return np.asarray((low == high) & (parts.end - parts.start > 1))


# -- records ---------------------------------------------------------------------------------------


def _records(
    group: Group, columns: Mapping[str, Any], parts: _Parts, runs: _Runs, odd: Mask
) -> list[tuple[TumbleRecord, ...] | None]:
    found: list[list[TumbleRecord]] = [[] for _ in group.tables]
    arrays = {name: array for name, array in columns.items() if array is not None}
    absent = dict.fromkeys(columns.keys() - arrays.keys())
    for array in arrays.values():
        array.setflags(write=False)
    serials = group.cells.labels.get("serial")
    bounds = zip(parts.start.tolist(), parts.end.tolist(), strict=True)
    of_table, of_serial, first = parts.table.tolist(), parts.code.tolist(), runs.first.tolist()
    for index, (start, end) in enumerate(bounds):
        table = of_table[index]
        if odd[table]:
            continue
        values = {name: array[start:end] for name, array in arrays.items()}
        values |= absent | group.tables[table].fields
        values["run_labels"] = tuple(runs.labels[first[index] : first[index + 1]])
        if serials is not None:
            values["serial"] = serials[of_serial[index]]
        found[table].append(_checked_record(values))
    return [None if odd[table] else tuple(found[table]) for table in range(len(found))]


def _checked_record(values: Mapping[str, Any]) -> TumbleRecord:
    """Make a record of values that have passed all its checks here, in a fraction of the time."""
    record = object.__new__(TumbleRecord)
    for name, value in values.items():
        object.__setattr__(record, name, value)
    return record
