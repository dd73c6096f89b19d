"""Reading of stability records: time, output and, where there are such columns, the rest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import PurePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from accelcal.arguments.kinds import shown
from accelcal.arrays import Array, Mask
from accelcal.errors import InputError, TableError
from accelcal.io.columns import notes_of_unused, places_of
from accelcal.io.declarations import declared_by_caller, serial_of_file
from accelcal.io.engines import by_an_engine, split_rows
from accelcal.io.files.text import Source, read_text
from accelcal.io.layout.facts_beside import notes_of_facts
from accelcal.io.layout.output_columns import unit_of_outputs, units_written, with_lone_output
from accelcal.io.layout.parts import Layout, read_layout
from accelcal.io.layout.rearranged import with_units_below
from accelcal.io.values.cells import Column, labels, numbers
from accelcal.io.values.markers import (
    notes_of_scale,
    refuse_constant,
    refuse_markers,
    refuse_other_temperatures,
)
from accelcal.io.values.times import in_seconds, times
from accelcal.io.words.headings import Heading, name_and_unit
from accelcal.pace import is_in_days
from accelcal.plural import counted, lines_named, listed, were
from accelcal.stability.record import Launch, StabilityRecord
from accelcal.units import size_of

__all__ = ["read_stability", "read_stability_records"]

_OWN_HEADINGS = {"launch": "run", "start": "run", "input": "input", "acceleration": "input"}
_ROLES = ("time", "date", "output", "temperature", "run", "input", "serial", "unit")
_REMEDY = "name the columns time and output, and, where there are such, temperature and launch"


_LARGEST = 1e30
"""Outputs beyond it, and below its inverse, are none [output unit]."""

_SHORTEST = 1e-9
"""Steps of time below it are none [s]."""

_FEWEST = 8
"""Different outputs below which two launches may agree in all samples by chance."""

_IN_DAYS = "name the column 'time [d]', or 'time [s]' if it is in seconds, or write dates"

Roles = dict[str, Column]


def read_stability_records(
    sources: Sequence[Source], *, overrides: Mapping[str, str | None] | None = None
) -> StabilityRecord:
    """Read one record of launches from several files.

    Parameters
    ----------
    sources : sequence of path, "-" or file object
        The files; each is a launch, or several where it has a column launch.
    overrides : mapping of str to str, optional
        ``unit`` and ``serial`` that win over the header; None leaves the header's.

    Returns
    -------
    StabilityRecord
        Launches in the order of the files.

    Raises
    ------
    TableError
        If a file is unusable; the message names the line and the remedy.
    InputError
        If the files are of several accelerometers or units.
    """
    records = [read_stability(source, overrides=overrides) for source in sources]
    if len(records) == 1:
        return records[0]
    for what in ("serial", "unit"):
        found = sorted({str(getattr(r, what)) for r in records if getattr(r, what) is not None})
        if len(found) > 1:
            raise InputError(f"{what} {listed(found)} in one test; give files of one {what}")
    _refuse_copies(records)
    return StabilityRecord(
        launches=tuple(_renamed(own, record) for record in records for own in record.launches),
        unit=next((record.unit for record in records if record.unit), None),
        serial=next((record.serial for record in records if record.serial), None),
        source=f"{records[0].source} and {len(records) - 1} more",
        notes=tuple(f"{record.source}: {note}" for record in records for note in record.notes),
    )


def _refuse_copies(records: Sequence[StabilityRecord]) -> None:
    """Refuse a launch that is in two files: sigma_L would have more degrees of freedom than it has.

    Few different outputs, as of a coarse step, may agree by chance.
    """
    seen: dict[bytes, StabilityRecord] = {}
    for record in records:
        for launch in record.launches:
            before = seen.setdefault(launch.output.tobytes(), record)
            if before is not record and np.unique(launch.output).size >= _FEWEST:
                told = f"the samples of launch {shown(launch.label)}"
                problem = f"{told} are those of {before.source}"
                raise InputError(f"{record.source}: {problem}; give each file once")


def read_stability(
    source: Source, *, overrides: Mapping[str, str | None] | None = None
) -> StabilityRecord:
    r"""Read a stability record.

    Parameters
    ----------
    source : path, "-" or file object
        A table with the columns time [s, or ISO 8601] and output, and optionally temperature
        [degC], launch (or run) and input, the applied acceleration [g]; ``"-"`` is standard input.
    overrides : mapping of str to str, optional
        ``unit`` and ``serial`` that win over the header; None leaves the header's.

    Returns
    -------
    StabilityRecord
        One launch, or one for each name in the column launch.

    Raises
    ------
    TableError
        If the table is unusable; the message names the line and the remedy.
    InputError
        If `overrides` are no declarations of it.

    Examples
    --------
    >>> import io
    >>> import accelcal
    >>> accelcal.read_stability(io.StringIO("time,output_mA\n0,1.30\n1,1.31\n2,1.30\n"))
    <StabilityRecord <table>: 1 launch, 3 samples>
    """
    text = read_text(source)
    layout = with_units_below(read_layout(text, _REMEDY))
    _refuse_tumble_test(layout)
    layout = with_lone_output(layout._replace(headings=_own_headings(layout)))
    given = declared_by_caller(overrides, ("unit", "serial"))
    columns = _columns(layout)
    output = numbers(columns["output"])
    kept = ~np.isnan(output)
    notes = [*layout.notes, *notes_of_facts(text.beside, layout.declared)]
    notes += notes_of_unused(layout, _ROLES)
    if not kept.all():
        missing = columns["output"].lines[~kept]
        notes.append(f"{were(missing, 'missing output')} left out ({lines_named(missing)})")
    columns = {name: column.take(kept) for name, column in columns.items()}
    refuse_markers([columns["output"]], output[kept, None])
    _require_size(output[kept], columns["output"])
    refuse_constant(output[kept], layout.source, columns["output"].lines, "a real output has noise")
    written = units_written(layout, [columns["output"]], columns.get("unit"))
    unit, of_unit = unit_of_outputs(written, given.get("unit"), layout.source)
    serial, of_serial = serial_of_file(layout, columns.get("serial"), given.get("serial"))
    return StabilityRecord(
        launches=tuple(_launches(columns, output[kept])),
        unit=unit,
        serial=serial,
        source=layout.source,
        notes=(*notes, *of_unit, *of_serial, *notes_of_scale(columns.get("temperature"))),
    )


def _refuse_tumble_test(layout: Layout) -> None:
    """Refuse readings of an accelerometer that was turned: nothing of them is drift or noise."""
    roles = [heading.role for heading in layout.headings]
    places = [i for i, role in enumerate(roles) if role in ("position", "angle")]
    if "stroke" not in roles or not places:
        return
    rows = split_rows(layout, max(places) + 1)
    if any(row[i] != rows[0][i] for i in places for row in rows):
        remedy = "give it to accelcal fit, or here a record of the accelerometer at rest"
        raise layout.refuse("a table of strokes and positions, as of a tumble test", remedy)


def _renamed(launch: Launch, record: StabilityRecord) -> Launch:
    stem = PurePath(record.source).stem
    name = f"{stem}: {launch.label}" if len(record.launches) > 1 else stem
    return replace(launch, label=name)


def _own_headings(layout: Layout) -> tuple[Heading, ...]:
    """Headings with their meaning here; dates are the times where no other heading has these."""
    told = tuple(map(_own_heading, layout.headings))
    if any(heading.role == "time" for heading in told):
        return told
    return tuple(own._replace(role="time") if own.role == "date" else own for own in told)


def _own_heading(heading: Heading) -> Heading:
    """Give a heading that only a stability record has its meaning."""
    if heading.role is not None:
        return heading
    name, unit = name_and_unit(heading.text, lambda unit: size_of(unit, "acceleration") is not None)
    role = _OWN_HEADINGS.get(name.split(" ")[0].casefold())
    return heading._replace(role=role, unit=unit or None)


def _columns(layout: Layout) -> Roles:
    places = places_of(layout, ("time", "output"), _REMEDY, among=_ROLES)
    needed = max(places["time"], places["output"]) + 1
    columns = by_an_engine(layout, lambda own: own(layout, sorted(places.values()), needed))
    return {name: columns[index] for name, index in places.items()}


def _launches(columns: Roles, output: Array) -> list[Launch]:
    values: dict[str, NDArray[Any]] = {"time": _seconds(columns), "output": output}
    if "temperature" in columns:
        values["temperature"] = numbers(columns["temperature"])
        refuse_other_temperatures(columns["temperature"], values["temperature"])
    if "input" in columns:
        values["input"] = _applied(columns["input"])
        remedy = "write the applied acceleration of every sample [g]"
        columns["input"].check(~np.isnan(values["input"]), "{} is missing", remedy)
    if "run" not in columns:
        return [_launch("1", np.ones(output.size, dtype=bool), values, columns["time"])]
    run, names = labels(columns["run"])
    return [_launch(name, run == i, values, columns["time"]) for i, name in enumerate(names)]


def _applied(column: Column) -> Array:
    size = size_of(column.unit or "g", "acceleration")
    if size is None:
        raise column.refuse(0, f"{{}} in {column.unit}", "give it in g, mg or ug")
    return numbers(column) * size


def _launch(name: str, chosen: Mask, values: Mapping[str, NDArray[Any]], column: Column) -> Launch:
    """One launch; its times must increase."""
    parts = {key: array[chosen] for key, array in values.items()}
    lines = column.lines[chosen]
    if lines.size < 3:
        problem = f"launch {shown(name)} has {counted(lines.size, 'sample')}"
        remedy = "a launch has at least 3; one launch in the file needs no column launch"
        raise TableError(problem, remedy, source=column.source, line=int(lines[0]))
    back = np.flatnonzero(np.diff(parts["time"]) < _SHORTEST)
    if back.size:
        problem = f"{column.heading} does not increase in launch {shown(name)}"
        remedy = (
            "sort the samples, write the time with more digits, or with its zone where the clock"
            " was put back, and give each launch its name"
        )
        line = int(lines[back[0] + 1])
        raise TableError(problem, remedy, source=column.source, line=line)
    time = parts.pop("time")
    return Launch(name, time - time[0], **parts)


def _seconds(columns: Roles) -> Array:
    column = columns["time"]
    launch = labels(columns["run"])[0] if "run" in columns else None
    found = times(column, columns.get("date"), launch)
    if found.dtype.kind != "f":
        seconds: Array = (found - found[0]) / np.timedelta64(1, "s")
        return seconds
    launches = [found] if launch is None else [found[launch == i] for i in np.unique(launch)]
    if not column.unit and all(map(is_in_days, launches)):
        raise column.refuse(0, "{} may count days, as a spreadsheet does with dates", _IN_DAYS)
    return in_seconds(column, found)


def _require_size(output: Array, column: Column) -> None:
    """Refuse none at all, and outputs whose squares cannot be calculated with."""
    if output.size == 0:
        raise TableError("all outputs are missing", "write the outputs", source=column.source)
    column.check(np.abs(output) <= _LARGEST, "{} is too large", "write it in another unit")
    if np.abs(output).max() < 1.0 / _LARGEST:
        problem, remedy = "{} is too small, as all others", "write the outputs in another unit"
        raise column.refuse(0, problem, remedy)
