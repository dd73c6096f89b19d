"""Columns of outputs that no heading calls so, and the unit of the outputs of a file."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from typing import NamedTuple

from accelcal.arguments.kinds import shown
from accelcal.errors import TableError, located
from accelcal.io.layout.heading_rows import is_part_of_angle
from accelcal.io.layout.output_headings import lone_output
from accelcal.io.layout.parts import Layout
from accelcal.io.layout.separators import split_line
from accelcal.io.values.cells import Column
from accelcal.io.words.headings import Heading, name_and_unit
from accelcal.io.words.vocabulary import OUTPUTS, has_unit, is_missing
from accelcal.units import canonical_unit, conversion_factor, is_output_unit, output_unit

_BEFORE_UNIT = " _/,[("
_ACTUAL = re.compile(r"(?:^|[\W_])(?:act(?:ual)?|meas(?:ured)?|ist|real|mesurée?)(?:[\W_]|$)", re.I)
"""Says that a column is not of what was asked for, as of the chamber."""
_INSTEAD = {
    "temperature": ("temperature", "temperatures"),
    "angle": ("angle", "angles", "position", "positions"),
}
"""What a column with a unit may hold -> roles that tell it otherwise."""


def with_channels(layout: Layout, given: str = "") -> Layout:
    """Take columns for the outputs of accelerometers, where a list of serials names them.

    Serials that the caller lists win over the header line ``# serials``. The table stays the same
    where nothing lists serials, or other columns hold outputs or serials. Raises TableError if a
    serial is the heading of no column.
    """
    header = layout.declared.get("serials")
    names = _listed(given or (header.value if header else ""))
    headings = tuple(_named(heading, names) for heading in layout.headings)
    others = {heading.role for heading in headings if heading.of not in names}
    if not names:
        return layout
    if others & {"serial", *OUTPUTS}:
        unused = f"serials {given} was not used: other columns hold the outputs or the serials"
        return layout.noting(unused) if given else layout
    for place, name in enumerate(names):
        if name in names[:place]:
            remedy = "list each once, and give two columns of one heading different ones"
            raise layout.refuse(f"serials has {shown(name)} twice", remedy)
        if name not in {heading.of for heading in headings}:
            problem = f"no column {shown(name)}, which serials has"
            raise layout.refuse(problem, "list the serials as the headings have them")
    return layout._replace(headings=headings)


def _listed(text: str) -> list[str]:
    """Take a list of serials apart."""
    mark = next((mark for mark in ";,\t" if mark in text), ",")
    return [name for name in split_line(text, mark) if name]


def _named(heading: Heading, names: Sequence[str]) -> Heading:
    """Meaning of a heading that may be one of some names, with a unit behind it."""
    for name in names:
        behind = heading.text.removeprefix(name) if heading.text.startswith(name) else None
        if behind is None or behind[:1] not in ("", *_BEFORE_UNIT):
            continue
        unit = behind.strip(f"{_BEFORE_UNIT}])")
        if not unit or is_output_unit(unit):
            return Heading(heading.text, "serials", unit or None, name)
    return heading


def with_lone_output(layout: Layout) -> Layout:
    """Take a column for the outputs, where no heading says so and only one can be."""
    found = lone_output(layout.headings)
    return layout if found is None else _taken(layout, *found, "outputs")


def with_lone_conditions(layout: Layout) -> Layout:
    """Take columns for temperature and angle, where nothing tells them and one alone has the unit.

    A lone letter is a unit in brackets, or behind a comma, a slash or ``in``; but F may be farad.
    """
    for role, others in _INSTEAD.items():
        if {*layout.declared, *(own.role for own in layout.headings)}.isdisjoint(others):
            units = [_unit_behind(own, role) for own in layout.headings]
            found = [place for place, unit in enumerate(units) if unit]
            actual = [place for place in found if _ACTUAL.search(layout.headings[place].text)]
            found = actual if len(actual) == 1 else found
            behind = [own.text for own in layout.headings[found[0] + 1 :][:1]] if found else []
            if len(found) == 1 and not (role == "angle" and any(map(is_part_of_angle, behind))):
                place = found[0]
                taken = Heading(layout.headings[place].text, role, units[place])
                layout = _taken(layout, place, taken, role)
    return layout


def _unit_behind(heading: Heading, role: str) -> str | None:
    """Unit of what a column may hold behind the name of one that is not known."""
    if heading.role is not None:
        return None
    is_own = partial(has_unit, role)
    unit = name_and_unit(heading.text, is_own, behind_blanks=False)[1]
    if not unit:
        unit = name_and_unit(heading.text, lambda own: is_own(own) and len(own) > 1)[1]
    if not unit and role == "temperature" and len(heading.text) > 1:
        unit = heading.text
    return unit if is_own(unit) and unit.casefold() != "f" else None


def _taken(layout: Layout, place: int, taken: Heading, what: str) -> Layout:
    why = "unit" if taken.unit else "name"
    note = f"column {shown(taken.text)} is taken for the {what}, by its {why}"
    headings = (*layout.headings[:place], taken, *layout.headings[place + 1 :])
    return layout._replace(headings=headings).noting(note)


class Written(NamedTuple):
    """A unit as written."""

    unit: str
    line: int
    in_header: bool = False  # whether a header line has it, which an option replaces
    source: str = ""  # the file or sheet; empty where it is that of the table


def unit_of_outputs(
    written: Iterable[Written], given: str | None, source: str
) -> tuple[str | None, tuple[str, ...]]:
    """Tell the one unit of the outputs.

    That of the caller wins over the one unit of the file, and a note says so. Raises TableError if
    a unit of the file is no output unit, or there are several. Raises InputError if the given one
    is none.
    """
    if given:
        unit, written = output_unit(given), list(written)
        of_table = [(canonical_unit(own.unit), own.line) for own in written if not own.in_header]
        _require_one(of_table, source)
        return unit, notes_of_unit(unit, (own.unit for own in written))
    found = [
        (located(output_unit, own.unit, source=own.source or source, line=own.line), own.line)
        for own in written
    ]
    _require_one(found, source)
    return found[0][0] if found else None, ()


def _require_one(found: Sequence[tuple[str, int]], source: str) -> None:
    for unit, line in found:
        if unit != found[0][0]:
            raise _two_units(found[0][0], unit, line, source)


def _two_units(one: str, other: str, line: int, source: str) -> TableError:
    problem = f"units {one!r} and {other!r} in one table"
    remedy = "give all outputs and their std in one unit"
    return TableError(problem, remedy, source=source, line=line)


def units_written(
    layout: Layout, outputs: Iterable[Column], rows: Column | None = None
) -> Iterator[Written]:
    """List the units that a table writes in the header line, with its outputs and in its rows.

    `rows` is a column of units.
    """
    header = layout.declared.get("unit")
    if header and header.value:
        yield Written(header.value, header.line, in_header=True, source=header.source)
    yield from units_of_columns(layout, outputs)
    if rows is not None:
        yield from _units_of_rows(rows)


def _units_of_rows(column: Column) -> Iterator[Written]:
    """List the units that a column of units has, each where it first stands."""
    first: dict[str, int] = {}
    for cell, line in zip(column.cells, column.lines.tolist(), strict=True):
        first.setdefault(str(cell), line)
    for unit, line in first.items():
        if names_unit(unit):
            yield Written(unit, line)


def names_unit(cell: str) -> bool:
    """Tell whether a cell of a column of units has one, right or wrong."""
    return not is_missing(cell) or is_output_unit(cell)


def units_of_columns(layout: Layout, columns: Iterable[Column]) -> Iterator[Written]:
    """List the units in the headings or cells of some columns."""
    for column in columns:
        if column.unit:
            in_heading = column.unit in column.heading
            line = layout.headings_line if in_heading else int(column.lines[0])
            yield Written(column.unit, line)


def factor_of_std(
    std: Sequence[Written], outputs: Sequence[Written], given: str | None, source: str
) -> float:
    """Factor from the unit of a column std to that of the outputs.

    The unit `given` is the one that the caller asks for. Raises TableError if the unit is none of
    outputs, or that of another quantity.
    """
    beside = [own.unit for own in outputs if not (own.in_header and given)]
    wanted = next(iter(beside), given)
    if not std or not wanted:
        return 1.0
    unit = located(output_unit, std[0].unit, source=source, line=std[0].line)
    factor = conversion_factor(unit, wanted)
    if factor is None:
        raise _two_units(canonical_unit(wanted), unit, std[0].line, source)
    return factor


def notes_of_unit(unit: str, written: Iterable[str]) -> tuple[str, ...]:
    """Say where a table has another unit than the one that is asked for.

    The first that differs is told. The unit that is asked for is in its canonical form.
    """
    for own in written:
        if canonical_unit(own) != unit:
            return (f"the table has outputs in {shown(own)}; they are taken as {unit}, as asked",)
    return ()
