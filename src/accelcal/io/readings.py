"""The rules: from the columns of a table to readings, one entry each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from accelcal.arguments.kinds import shown
from accelcal.arrays import Array, Ints, Mask, Places
from accelcal.errors import TableError
from accelcal.geometry import MOUNTINGS, is_mounting
from accelcal.io.columns import Table
from accelcal.io.layout.output_headings import are_cycles
from accelcal.io.values.cells import Column, counts_rows, labels, numbers, refuse_thousands
from accelcal.io.values.markers import all_outputs, notes_of_far, refuse_markers, temperatures_of
from accelcal.io.values.places import (
    MAXIMUM_ANGLE,
    notes_of_minutes,
    places_of_rows,
    strokes_by_direction,
    strokes_of_rows,
)
from accelcal.io.values.times import days, in_seconds, notes_of_midnight, times
from accelcal.io.words.vocabulary import mounting_written
from accelcal.numerics.grouping import Grouped, distinct, median
from accelcal.pace import too_quick
from accelcal.units import degrees_in

FEWEST_IN_TURN = 5
"""Positions from 1 to the return, where a turn is to be told from a few."""

_ALONG, _DOWN = 0.5, 0.25
"""Parts of the span of all outputs: more than the one along a row, less than the other down it."""

_OTHER = {"stroke": ("position", "Y1, Y2"), "position": ("stroke", "J1, J2")}
"""What numbered columns may be of -> what else they may be, and how to call them if not."""


@dataclass(frozen=True, slots=True)
class Readings:
    """All readings of a file, one entry a reading, by the names of a `TumbleRecord`."""

    source: str  # name of the file
    output: Array
    temperature: Array
    angle: Array
    position: Ints
    stroke: Ints
    line: Ints
    mounting: NDArray[np.str_]
    time: NDArray[Any] | None  # seconds, dates of UTC, or clock times counted from a midnight
    day: NDArray[np.datetime64] | None  # days of the times as written; None where they have none
    clamping: Array | None
    std: Array | None
    count: Array | None
    lot: NDArray[np.str_] | None  # lot of the unit, as written
    run: Ints | None  # index into the labels
    serial: Ints | None  # index into the serials
    run_labels: tuple[str, ...]  # empty without such a column, as the serials are
    serials: tuple[str, ...]
    missing: Ints  # line of each missing reading
    missing_serial: Ints | None  # serial of each missing reading
    stroke_notes: tuple[str, ...]  # how strokes were counted, where not as the table numbers them

    def select(self, chosen: Mask | Places) -> Readings:
        """Keep the readings where a mask is true, or at some places."""
        kept: dict[str, Any] = {}
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray) and not item.name.startswith("missing"):
                kept[item.name] = value[chosen]
        return replace(self, **kept)

    def of_each_serial(self) -> Iterator[Readings]:
        """Divide them by accelerometer, in the order of `serials`."""
        if self.serial is None or self.missing_serial is None:
            yield self
            return
        count = len(self.serials)
        each = zip(_of_each(self.serial, count), _of_each(self.missing_serial, count), strict=True)
        for own, missing in each:
            yield replace(self.select(own), missing=self.missing[missing])

    def refuse(self, index: int, problem: str, remedy: str) -> TableError:
        """Make the error of one reading."""
        return TableError(problem, remedy, source=self.source, line=int(self.line[index]))


def read_readings(table: Table, positions: int) -> Readings:
    """Turn the columns of a table into readings.

    They are in the order of the file; missing readings are left out. `positions` is the number in a
    full turn. Raises TableError at the first cell that breaks a rule.
    """
    outputs = np.stack([numbers(column) for column in table.outputs], axis=1)
    first, across = table.outputs[0], table.across
    present = ~np.isnan(outputs)
    _refuse_no_readings(table.outputs, outputs)
    serial, serials = _labels(table.columns, "serial")
    missing_row, missing_output = np.nonzero(~present)
    missing_serial = _at(serial, missing_row)
    kept: Mask = np.any(present, axis=1)
    if not kept.all():
        _refuse_texts(table.columns, ~kept)
    columns = {name: column.take(kept) for name, column in table.columns.items()}
    by_row, run_labels = _by_row(columns, int(kept.sum()))
    by_row |= _where(columns, positions)
    by_row |= {"line": first.lines[kept], "serial": _at(serial, np.nonzero(kept)[0])}
    row, output = np.nonzero(present[kept])
    if across and across.role == "temperature":  # level after level, as they were met
        output, row = np.nonzero(present[kept].T)
    values: dict[str, Any] = {name: _at(array, row) for name, array in by_row.items()}
    if across:
        of_columns = _where({across.role: across}, positions)
        values |= {name: array[output] for name, array in of_columns.items()}
    if across and across.role == "serial":
        own, serials = labels(across)
        values["serial"], missing_serial = own[output], own[missing_output]
    if across and across.role == "direction":
        strokes, stroke_notes = _by_direction(columns, across, output, values)
    else:
        strokes, stroke_notes = _by_direction(columns, columns.get("direction"), row, values)
    values["stroke"] = strokes
    return Readings(
        **values,
        source=first.source,
        output=outputs[kept][row, output],
        run_labels=run_labels,
        serials=serials,
        missing=first.lines[missing_row],
        missing_serial=missing_serial,
        stroke_notes=stroke_notes,
    )


def _refuse_texts(columns: Mapping[str, Column], missing: Mask) -> None:
    """Refuse a text in a row without outputs: it is of the rows below, and no missing reading.

    Where each row tells its temperature, it is a remark.
    """
    if "temperature" in columns and distinct(columns["temperature"].lines).size > 1:
        return
    for name in ("temperature", "position", "angle", "stroke"):
        if name in columns:
            column = columns[name].take(missing)
            try:
                numbers(column)
            except TableError as error:
                remedy = "repeat the headings below what is of another temperature or run"
                problem, line = f"{error.problem}, and its row has no output", error.line
                raise TableError(problem, remedy, source=column.source, line=line) from None


def _by_direction(
    columns: Mapping[str, Column], direction: Column | None, place: Ints, values: Mapping[str, Any]
) -> tuple[Ints, tuple[str, ...]]:
    """Strokes of the readings, whose directions are in some places of a column, if there is one."""
    if direction is None:
        return values["stroke"], ()
    cycles = "stroke" in columns and are_cycles(columns["stroke"].heading)
    number, angle = values["stroke"], values["angle"]
    return strokes_by_direction(direction, number, place, angle, cycles=cycles)


def notes_of_readings(readings: Readings, positions: int) -> Iterator[str]:
    """Say what was understood of all readings, and which of them are doubtful."""
    yield from _notes_of_turn(readings, positions)
    yield from notes_of_minutes(readings.angle)
    yield from notes_of_far(readings.output, readings.line)
    yield from notes_of_midnight(readings.time, readings.line)
    yield from readings.stroke_notes


def _notes_of_turn(readings: Readings, positions: int) -> list[str]:
    """Say where a turn of fewer positions than declared would hold all readings.

    That is where positions 1 to a last one occur and the rest of the turn, as declared, never does.
    """
    last = int(readings.position.max(initial=0))
    met = distinct(readings.position)
    whole = met.size == last >= FEWEST_IN_TURN and met[0] == 1
    if not whole or last >= positions:
        return []
    return [
        f"positions {last + 1} to {positions + 1} never occur in a turn of {positions}; if position"
        f" {last} is the return to 1, declare '# positions: {last - 1}'"
    ]


def notes_of_pace(time: NDArray[Any] | None) -> list[str]:
    """Say where times are in another unit than s, such as the days of a spreadsheet.

    The times are numbers [s] or as in `Readings`.
    """
    said = "" if time is None or time.dtype.kind != "f" else too_quick(time)
    return [f"{said}; name the unit of the time in its heading, such as time [d]"] if said else []


def refuse_swapped(table: Table, readings: Readings) -> None:
    """Refuse numbered columns of strokes that differ as positions do, while the rows do not.

    And those of positions that differ as strokes do, while the rows do as positions. Raises
    TableError if outputs of one position span most of all outputs, and those of one stroke a small
    part.
    """
    across = table.across
    numbered = [own.heading for own in table.outputs if own.heading[:1].isdigit()]
    if across is None or across.role not in _OTHER or len(numbered) < len(table.outputs):
        return
    span = float(np.ptp(readings.output))
    column = readings.stroke if across.role == "stroke" else readings.position
    groups = (readings.line, column) if across.role == "stroke" else (column, readings.line)
    along = _spread(readings.output, groups[0]) / span if span else 0.0
    if along < _ALONG or span < _DOWN * np.abs(readings.output).max():
        return  # readings of one position differ by noise alone
    if _spread(readings.output, groups[1]) < _DOWN * span:
        (other, meant), names = _OTHER[across.role], shown(", ".join(numbered))
        problem = f"columns {names} differ as {other}s do, and rows as {across.role}s"
        remedy = f"call the first column {across.role}, or these {meant}, ... if they are"
        line = int(across.lines[0])
        remedy = f"{remedy} {across.role}s indeed"
        raise TableError(problem, remedy, source=readings.source, line=line)


def _spread(output: Array, group: Ints) -> float:
    """Median of the spans of the outputs of each group."""
    groups, index = np.unique(group, return_inverse=True)
    top, low = np.full(groups.size, -np.inf), np.full(groups.size, np.inf)
    np.maximum.at(top, index, output)
    np.minimum.at(low, index, output)
    return median(top - low)


def _where(columns: Mapping[str, Column], positions: int) -> dict[str, NDArray[Any]]:
    """Fields of `Readings` that tell where a reading was taken, as far as columns hold them."""
    found: dict[str, NDArray[Any]] = {}
    if "temperature" in columns:
        found["temperature"] = temperatures_of(columns["temperature"])
    if "position" in columns or "angle" in columns:
        found["position"], found["angle"] = places_of_rows(columns, positions)
    if "stroke" in columns:
        found["stroke"] = strokes_of_rows(columns["stroke"])
    return found


def _by_row(
    columns: Mapping[str, Column], size: int
) -> tuple[dict[str, NDArray[Any] | None], tuple[str, ...]]:
    """Other fields of `Readings` that each row holds once, and the run labels."""
    run, run_labels = _labels(columns, "run")
    time = _time(columns)
    return {
        "mounting": _mounting(columns.get("mounting"), size),
        "time": time,
        "day": None if time is None else days(columns["time"], time),
        "clamping": _clamping(columns.get("clamping")),
        "std": _not_below(columns, "std", 0.0),
        "count": _not_below(columns, "count", 1.0),
        "lot": np.array([*map(str, columns["lot"].cells)]) if "lot" in columns else None,
        "run": run,
    }, run_labels


def _of_each(index: Ints, count: int) -> list[Places]:
    """Places of each value of an index below `count`, in their order."""
    return Grouped(np.arange(count), index, np.bincount(index, minlength=count)).parts


def _at(values: NDArray[Any] | None, index: Ints) -> NDArray[Any] | None:
    return None if values is None else values[index]


def _refuse_no_readings(columns: Sequence[Column], outputs: Array) -> None:
    """Refuse numbers with thousands marks, markers, row numbers, and none at all."""
    refuse_thousands(columns)
    refuse_markers(columns, outputs)
    output = columns[0]
    if len(columns) == 1 and counts_rows(outputs[:, 0]):
        raise output.refuse(0, "{} and those below count the rows", "call another column output")
    present = ~np.isnan(outputs)
    if not present.any():
        problem = f"{all_outputs(present.size)} missing"
        line = int(output.lines[0])
        raise TableError(problem, "write at least one", source=output.source, line=line)


def _labels(columns: Mapping[str, Column], name: str) -> tuple[Ints | None, tuple[str, ...]]:
    return labels(columns[name]) if name in columns else (None, ())


def _mounting(column: Column | None, size: int) -> NDArray[np.str_]:
    if column is None:
        return np.full(size, MOUNTINGS[0])
    index, names = labels(column)
    canonical = [mounting_written(name) for name in names]
    good = is_mounting(np.array(canonical))
    column.check(good[index], "{} is unknown", f"it is one of {', '.join(MOUNTINGS)}")
    return np.array(canonical)[index]


def _clamping(column: Column | None) -> Array | None:
    if column is None:
        return None
    values = numbers(column) * degrees_in(column.unit or "")
    column.check(~np.isnan(values), "{} is missing", "write the clamping in every row [deg]")
    column.check(np.abs(values) <= MAXIMUM_ANGLE, "{} is no angle of a head", "write degrees")
    return values


def _time(columns: Mapping[str, Column]) -> NDArray[Any] | None:
    if "time" not in columns:
        return None
    column = columns["time"]
    values = times(column, columns.get("date"), _labels(columns, "serial")[0])
    if values.dtype.kind == "f":
        return in_seconds(column, values)
    return values


def _not_below(columns: Mapping[str, Column], name: str, least: float) -> Array | None:
    if name not in columns:
        return None
    values = numbers(columns[name])
    columns[name].check(~(values < least), "{} is too small", f"it is {least:g} or more")
    return values
