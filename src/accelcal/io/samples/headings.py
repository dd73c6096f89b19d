"""What stands above a stream of samples: header lines and column headings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import NamedTuple

from accelcal.arguments.axes import AXES
from accelcal.arguments.kinds import shown
from accelcal.arrays import Ints
from accelcal.errors import TableError
from accelcal.io.columns import notes_of_unused, places_of
from accelcal.io.declarations import declared_temperature
from accelcal.io.files.text import refuse_document
from accelcal.io.layout.header_lines import (
    Declared,
    declare,
    keys_and_values,
    uncommented,
    unquoted,
)
from accelcal.io.layout.output_columns import (
    Written,
    names_unit,
    unit_of_outputs,
    units_written,
    with_channels,
    with_lone_output,
)
from accelcal.io.layout.parts import Layout
from accelcal.io.layout.separators import (
    UNITS_BELOW,
    Recognise,
    headings_with_units,
    split_headings,
    split_line,
)
from accelcal.io.triad import triad_heading
from accelcal.io.values.cells import Column
from accelcal.io.words.headings import Heading, read_heading, split_unit
from accelcal.io.words.vocabulary import KEYS
from accelcal.units import canonical_unit, scale_of, size_of

ACROSS_AXES = ("a_p", "a_o")
"""Accelerations across the input axis of one accelerometer."""


class StreamForm(NamedTuple):
    """What the columns of a stream are."""

    recognise: Recognise
    outputs: tuple[str, ...]  # roles of the columns of outputs
    remedy: str  # what the headings should be

    @property
    def roles(self) -> tuple[str, ...]:
        """Roles of the columns that are used, or refused."""
        return (*self.outputs, "temperature", "time", *ACROSS_AXES, "serial", "unit")


def _of_accelerometer(text: str) -> Heading:
    name, unit = split_unit(text.strip())
    known = read_heading(text)
    role = name.casefold() if name.casefold() in ACROSS_AXES else known.role
    used = role if role in (*ONE_ACCELEROMETER.roles, "serials") else None
    return Heading(text, used, known.unit or unit or None, known.of if used == "serials" else None)


def _of_triad(text: str) -> Heading:
    own, known = triad_heading(text), read_heading(text)
    if own.role in (*TRIAD.outputs, "temperature"):
        return own
    return known if known.role in ("time", "serial", "unit") else Heading(text, None)


ONE_ACCELEROMETER = StreamForm(
    _of_accelerometer,
    ("output",),
    "name the columns in the first row: output, and temperature where it is known",
)

TRIAD = StreamForm(
    _of_triad,
    tuple(AXES),
    "name the columns of the channels in the first row: x, y, z, as the calibration has them",
)


_USED = ("unit", "serial", "temperature", "serials")
_TEXTS = ("time", "serial", "unit")
_LOCAL_G = ("g", "g_local")
_JSON_LINES = 5
"""Lines in which a document says what it is."""


def _meaning(key: str, value: str) -> str | float:
    """What a header line says, however it is spelled."""
    if key == "temperature":
        with suppress(ValueError):
            return float(value.removesuffix("degC"))
    return canonical_unit(value) if key == "unit" else value


@dataclass(frozen=True, slots=True)
class SampleHeadings:
    """Header lines and column headings of a stream."""

    layout: Layout  # header lines and headings, without rows
    columns: Mapping[str, int]  # index of the column of each role
    units: Mapping[str, str]  # of each role, where a heading or header line gives it
    line: int  # of the first sample
    row: str = ""  # the first rows of samples, where they were read to know what they are
    notes: tuple[str, ...] = ()
    unit_of_rows: Written | None = None  # that a column of units has

    @property
    def output_unit(self) -> str | None:
        """Unit of the outputs, None where nothing tells it."""
        return self.units.get("output")

    @property
    def scale(self) -> str:
        """Scale of the temperatures in a column."""
        return scale_of(self.units.get("temperature"))

    @property
    def source(self) -> str:
        """Name of the file."""
        return self.layout.source

    @property
    def numeric(self) -> dict[str, int]:
        """Index of the columns that hold numbers."""
        return {role: index for role, index in self.columns.items() if role not in _TEXTS}

    @property
    def texts(self) -> dict[str, int]:
        """Index of the columns that hold texts."""
        return {role: index for role, index in self.columns.items() if role in _TEXTS}

    @property
    def serial(self) -> str | None:
        """Serial number that a header line declares."""
        written = self.layout.declared.get("serial")
        return written.value if written else None

    @property
    def temperature(self) -> float | None:
        """Temperature that a header line declares for all samples [degC]."""
        return declared_temperature(self.layout, ".")

    def refuse_declaration(self, comment: str, line: int) -> None:
        """Refuse a comment between the samples that declares other than the header lines do.

        Raises TableError if it has another unit, serial or temperature, and no column tells that.
        """
        declared = self.layout.declared
        for key, value in keys_and_values(comment.strip("\r\n")) or ():
            if key in self.columns:
                continue
            above = declared[key].value if key in declared else ""
            if key == "unit":
                above = self.output_unit or above
            if key in _USED and value and _meaning(key, value) != _meaning(key, above):
                problem = f"header line {shown(f'{key}: {value}')} between the samples"
                remedy = "write it above the headings, and other samples into a file of their own"
                raise TableError(problem, remedy, source=self.source, line=line)

    def in_unit(self, unit: str | None) -> SampleHeadings:
        """Take the unit of the outputs of a caller, where nothing written tells it."""
        if unit is None or self.output_unit:
            return self
        return replace(self, units={**self.units, "output": canonical_unit(unit)})

    def of_serial(self, serial: str | None, unit: str | None = None) -> SampleHeadings:
        """Take the outputs of one accelerometer, where those of several stand side by side.

        The unit takes the place of that of a header line. Raises TableError if there is no column
        of this serial, its unit contradicts a header line, or there is a column of serials and none
        is given.
        """
        if "serial" in self.columns and serial is None:
            raise self.layout.refuse("a column serial", "choose one by its serial")
        channels = _channels(self.layout)
        if "output" in self.columns or not channels:
            return self
        if serial not in channels:
            missing = "" if serial is None else f", none of {serial}"
            problem = f"outputs of {', '.join(channels)}{missing}"
            raise self.layout.refuse(problem, "choose one of these by its serial")
        columns = {**self.columns, "output": channels.pop(serial)}
        others = shown(", ".join(channels))
        told = (f"outputs of {others} are set aside",) if channels else ()
        units = _units(self.layout, columns, ["output"], self.unit_of_rows, unit)
        return replace(self, columns=columns, units=units, notes=(*self.notes, *told))


def read_sample_headings(
    readline: Callable[[], str], source: str, form: StreamForm, unit: str | None = None
) -> SampleHeadings:
    """Read a stream up to its first sample.

    The headings may stand in a comment, as numpy.savetxt writes them. The unit of the outputs takes
    the place of that of a header line. Raises TableError if there is no column of outputs, or
    headings or header lines contradict each other.
    """
    declared, commented, row, line = _down_to_headings(readline, source, form)
    bare = _whole(row.strip(" \r\n"))
    braces = bare.startswith(("{", "["))
    below = [readline() for _ in range(_JSON_LINES)] if braces else []
    refuse_document("".join([bare, *below]), source)
    above = not _has_outputs(bare, form) and _has_outputs(commented, form)
    headings, separator = split_headings(commented if above else bare, form.recognise)
    place, row = (line, row) if above else (line + 1, readline())
    notes: tuple[str, ...] = ()
    if told := _with_units_below(headings, row, separator, form):
        headings, place, row, notes = told, place + 1, "", (UNITS_BELOW.format(place),)
    layout = Layout(source, declared, headings, line, separator, [], (), ())
    if form is ONE_ACCELEROMETER:
        layout = with_lone_output(with_channels(layout))
        _refuse_triad(layout)
    columns = places_of(layout, () if _channels(layout) else form.outputs, form.remedy, form.roles)
    of_rows: Written | None = None
    if "unit" in columns:
        of_rows, row = first_unit(row, place, readline, columns["unit"], separator)
    units = _units(layout, columns, form.outputs, of_rows, unit)
    notes = (*notes, *layout.notes, *notes_of_unused(layout, (*form.roles, "serials")))
    if (scale := scale_of(units.get("temperature"))) != "degC":
        notes = (*notes, f"temperatures are converted from {scale} to degC")
    return SampleHeadings(layout, columns, units, place, row, notes, of_rows)


def _whole(row: str) -> str:
    """Take off the quotes in which all of a row stands, and not those of its cells."""
    return row[1:-1] if row.count('"') == 2 and row[0] == row[-1] == '"' else row


def _down_to_headings(
    readline: Callable[[], str], source: str, form: StreamForm
) -> tuple[dict[str, Declared], str, str, int]:
    """Header lines, the last comment, and the first row with its line."""
    declared: dict[str, Declared] = {}
    commented = ""
    line = 0
    while row := readline():
        line += 1
        bare = row.strip("\r\n")
        pairs = keys_and_values(bare)
        if pairs is not None:
            commented = uncommented(bare) or ""
            for key, value in pairs:
                if key in KEYS and value:
                    declare(declared, key, Declared(value, line, source))
        elif unquoted(bare):
            return declared, commented, row, line
    raise TableError("no samples", form.remedy, source=source)


def _refuse_triad(layout: Layout) -> None:
    """Refuse x, y and z, of which y would pass for the output Y."""
    axes = {TRIAD.recognise(own.text).role: own.role for own in layout.headings}
    if axes.get("y") == "output" and {"x", "z"} <= set(axes):
        remedy = "name the column of this accelerometer output, or give the calibration of a triad"
        raise layout.refuse("columns x, y and z of a triad", remedy)


def _channels(layout: Layout) -> dict[str, int]:
    """Index of the column of outputs of each accelerometer, where they stand side by side."""
    named = [(str(own.of), i) for i, own in enumerate(layout.headings) if own.role == "serials"]
    channels = dict(named)
    if len(channels) < len(named):
        raise layout.refuse("two columns of one serial", "keep one and rename the other")
    return channels


def _with_units_below(
    headings: tuple[Heading, ...], row: str, separator: str | None, form: StreamForm
) -> tuple[Heading, ...] | None:
    """Headings with the units of the row below; None where it holds samples."""
    cells = split_line(row.rstrip("\r\n"), separator)
    pairs = list(zip(headings, cells, strict=False))
    own = [each.role in ACROSS_AXES and bool(acceleration_unit(cell)) for each, cell in pairs]
    others = ["" if is_own else cell for is_own, cell in zip(own, cells, strict=False)]
    general = [h._replace(role="output") if h.role in form.outputs else h for h in headings]
    told = headings_with_units(general, others + cells[len(others) :])
    if told is None:
        return None
    units = [f" [{cell}]" if is_own else "" for is_own, cell in zip(own, cells, strict=False)]
    units += [""] * (len(told) - len(units))
    return tuple(form.recognise(each.text + unit) for each, unit in zip(told, units, strict=True))


def _has_outputs(line: str, form: StreamForm) -> bool:
    headings = split_headings(line, form.recognise)[0] if line else ()
    return any(heading.role in (*form.outputs, "serials") for heading in headings)


def _units(
    layout: Layout,
    columns: Mapping[str, int],
    outputs: Sequence[str],
    of_rows: Written | None,
    given: str | None,
) -> dict[str, str]:
    """Unit of each role; that of the outputs by the role ``output``."""
    named = {role: layout.headings[index].unit for role, index in columns.items()}
    units = {role: unit for role, unit in named.items() if unit}
    for role, unit in units.items():
        if role in ACROSS_AXES and not acceleration_unit(unit):
            raise layout.refuse(f"{role} in {unit}", "give it in g, mg, ug or m/s^2")
    own = [units.pop(role) for role in outputs if role in units]
    written = [Written(unit, layout.headings_line) for unit in own]
    if not given or not (own or of_rows):
        written += [told._replace(line=layout.headings_line) for told in units_written(layout, ())]
    written += [of_rows] if of_rows else []
    found, _ = unit_of_outputs(written, None, layout.source)
    return {**units, "output": found} if found else units


def acceleration_unit(unit: str) -> tuple[float, bool] | None:
    """Tell how many g or m/s^2 a unit of an acceleration is, and whether these are m/s^2.

    Examples
    --------
    >>> acceleration_unit("m/s2"), acceleration_unit("mg"), acceleration_unit("V")
    ((1.0, True), (0.001, False), None)
    """
    if canonical_unit(unit) == "m/s^2":
        return 1.0, True
    size = 1.0 if unit in _LOCAL_G else size_of(unit, "acceleration")
    return None if size is None else (size, False)


_MOST_ROWS = 1000
"""Rows that are looked through for the first unit."""

_REMEDY = "write all outputs in one unit, or samples that differ into a file of their own"


def first_unit(
    row: str, line: int, readline: Callable[[], str], place: int, separator: str | None
) -> tuple[Written | None, str]:
    """Look for the unit that a column of units has first.

    The first row may be read already, and `place` is the index of the column. Returns the rows that
    were read as well; no unit where none of them has one.
    """
    rows = [row or readline()]
    while rows[-1] and len(rows) <= _MOST_ROWS:
        bare = rows[-1].rstrip("\r\n")
        cells = [] if bare.lstrip(' \t"').startswith("#") else split_line(bare, separator)
        unit = "".join(cells[place : place + 1])
        if names_unit(unit):
            return Written(unit, line + len(rows) - 1), "".join(rows)
        rows.append(readline())
    return None, "".join(rows)


def refuse_other_units(cells: Sequence[str], lines: Ints, unit: str | None, source: str) -> None:
    """Refuse samples that a column of units gives another unit than the others."""
    others = {cell for cell in {*cells} if names_unit(cell) and canonical_unit(cell) != unit}
    if others:
        at = next(i for i, cell in enumerate(cells) if cell in others)
        above = f"after samples in {unit}" if unit else "after samples without one"
        column = Column("unit", "unit", None, cells, lines, source)
        raise column.refuse(at, f"{{}} {above}", _REMEDY)
