"""Choice of the columns: the form of the table, what they hold, in which units, what is missing."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence, Set
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from accelcal.arguments.kinds import shown
from accelcal.io.engines import NUMERIC, BulkEngineGivesUp, Columns, Engine
from accelcal.io.layout.heading_rows import ANGLE_IN_PARTS
from accelcal.io.layout.output_headings import are_cycles, is_supply
from accelcal.io.layout.parts import Layout
from accelcal.io.values.cells import Column, are_words, counts_rows, numbers
from accelcal.io.values.places import with_parts
from accelcal.io.values.times import has_clock_times, has_times_of_day, one_date, with_year_first
from accelcal.io.words.headings import Heading, hint_of_triad, name_and_unit, split_unit
from accelcal.io.words.vocabulary import ACROSS, UNITS_OF, has_unit, is_unit_of
from accelcal.plural import lines_named
from accelcal.units import scale_of

CONSTANTS = ("temperature", "stroke", "run", "mounting", "clamping", "std", "count")
"""Columns that a header line may stand for."""

_OPTIONAL = (
    *("run", "direction", "time", "date", "serial", "mounting", "clamping", "std", "count"),
    *("unit", "lot"),
)
_ROW_NUMBER = "order"
"""Heading of the sheet of a test: nothing is lost with its numbers where the rows are in them."""

_OF_ONE_READING = ("time", "std", "count")
_OF_ONE_SERIAL = ("std",)  # time and count are those of all accelerometers that a row reads


class Table(NamedTuple):
    """The columns of a table by what they hold."""

    columns: Mapping[str, Column]  # columns with one cell a row, by role
    outputs: tuple[Column, ...]  # columns of readings, one in a long table
    # what those of a wide table stand for, a cell each: their stroke, position, angle, temperature
    # or serial; None for a long table
    across: Column | None
    date: str | None  # date that stands in every row
    decimal: str
    aside: tuple[str, ...]  # headings of the columns that are not used
    notes: tuple[str, ...]  # what was set aside


def choose_columns(layout: Layout, engine: Engine) -> Table:
    """Choose the columns of a table and split its rows.

    Raises TableError if a column is missing, there twice or in the wrong unit, or a row has the
    wrong length.
    """
    roles, across, outputs = _roles(layout)
    # what a row cannot hold once for all of its outputs
    of_one = _OF_ONE_SERIAL if across == "serial" else _OF_ONE_READING
    own = of_one if across else ()
    roles = {name: i for name, i in roles.items() if name not in own}
    _require(layout, roles, across)
    key = [roles[name] for name in ("temperature", "position", "angle", "stroke") if name in roles]
    measured = list(outputs.values()) if across else [roles["output"]]
    needed = max(key if across else key + measured, default=0) + 1
    order = [i for i, own in enumerate(layout.headings) if own.text == _ROW_NUMBER]
    columns = engine(layout, sorted({*roles.values(), *measured, *order}), needed)
    empty = [name for name in _OPTIONAL if name in roles and _is_blank(columns[roles[name]])]
    named = {n: with_year_first(columns[i]) for n, i in roles.items() if n not in empty}
    parts = [named.pop(role) for role in ANGLE_IN_PARTS[1:] if role in named]
    if parts:
        named["angle"] = with_parts(named["angle"], parts)
    date = _take_date(named, timed="time" not in own)
    aside = _aside(layout, columns) | _dates_aside(named, date)
    if {"angle", "position"} <= named.keys() and are_words(named["position"]):
        aside[shown(named.pop("position").heading)] = "names positions beside their angles"
    if "count" in named and counts_rows(numbers(named["count"])):
        aside[shown(named.pop("count").heading)] = "counts the rows"
    decimal = columns[measured[0]].decimal
    by_columns = {*named, *filter(None, [across])}.difference(["date"])
    by_columns |= {"date"} if date else set()
    return Table(
        columns=_constants(layout, decimal, across)
        | {n: c for n, c in named.items() if n != "output"},
        outputs=tuple(columns[i] for i in measured),
        across=_across(layout, across, outputs) if across else None,
        date=date,
        decimal=decimal,
        aside=(*aside, *empty),
        notes=(*_notes(layout, aside, empty, by_columns), *_notes_of_short(layout, measured)),
    )


def places_of(
    layout: Layout, needed: Sequence[str], remedy: str, among: Collection[str] | None = None
) -> dict[str, int]:
    """Index of the column of each role.

    Roles that are needed must be there; only some of them count where `among` lists these. The
    remedy tells what the headings should be. Raises TableError if one of them is missing, a role is
    there twice, or a temperature is in another unit.
    """
    found: dict[str, int] = {}
    for index, heading in enumerate(layout.headings):
        if heading.role and (among is None or heading.role in among):
            _claim(found, heading.role, index, layout)
            if heading.role == "temperature":
                _require_unit(layout, heading)
    for role in needed:
        if role not in found:
            raise layout.refuse(f"no column {role} among {_headings(layout)}", remedy)
    return found


def notes_of_unused(layout: Layout, used: Collection[str]) -> list[str]:
    """Name the columns whose roles are not used, if there are such."""
    names = [own.text for own in layout.headings if own.text and own.role not in used]
    return [f"columns not used: {shown(', '.join(names))}"] if names else []


def _take_date(named: dict[str, Column], *, timed: bool) -> str | None:
    """The one date; dates that have a time of day serve as times, where no column has these."""
    if "date" not in named:
        return None
    timed = timed and "time" not in named and has_times_of_day(named["date"])
    date = one_date(named["date"], timed=timed)
    if timed:
        named["time"] = named.pop("date")
    return date


def _dates_aside(named: dict[str, Column], date: str | None) -> dict[str, str]:
    """Take out the dates where they tell neither the date of the test nor that of its times."""
    if "date" not in named or date or ("time" in named and has_clock_times(named["time"])):
        return {}
    return {shown(named.pop("date").heading): "has no one date, nor clock times beside it,"}


def _notes(
    layout: Layout, aside: Mapping[str, str], empty: Sequence[str], by_columns: Set[str]
) -> Iterator[str]:
    for heading in layout.headings:
        allowed = UNITS_OF.get(heading.role or "")
        if allowed and heading.role != "time" and heading.unit and not _has_right_unit(heading):
            yield f"column {shown(heading.text)} is taken in {allowed[0]}"
    for name, reason in aside.items():
        yield f"column {name} {reason} and was set aside"
    for name in empty:
        yield f"column {name} is empty and was set aside"
    for name in (*CONSTANTS, "date"):
        if name in layout.declared and name in by_columns:
            yield f"header line {name} was set aside: the table has such a column"


def _notes_of_short(layout: Layout, outputs: Sequence[int]) -> Iterator[str]:
    """Say where a row has fewer fields than outputs side by side: any of them may be missing."""
    pairs = zip(layout.rows, layout.lines, strict=True)
    mark, last = layout.separator or "", max(outputs)
    short = [line for row, line in pairs if row.count(mark) < last] if len(outputs) > 1 else []
    if short:
        yield f"the last outputs count as missing in rows that end early ({lines_named(short)})"


def _roles(layout: Layout) -> tuple[dict[str, int], str, dict[float | str, int]]:
    """Index of the heading of each role; what outputs side by side stand for, and theirs."""
    roles: dict[str, int] = {}
    outputs: dict[float | str, int] = {}
    kinds: dict[str, int] = {}
    for index, heading in enumerate(layout.headings):
        if heading.role and heading.of is not None:
            _claim(outputs, heading.of, index, layout)
            kinds.setdefault(ACROSS[heading.role], index)
        elif heading.role:
            _claim(roles, heading.role, index, layout)
            if is_unit_of(heading.role, heading.unit or ""):  # another word may be a remark
                _require_unit(layout, heading)
    if not kinds:
        return roles, "", outputs
    across = _kind_across(layout, roles, kinds)
    if 0 in outputs and across in ("stroke", "position"):
        name = shown(layout.headings[outputs[0]].text)
        angles = ", and headings of head angles have a unit, as '0 deg'"
        remedy = f"{across}s count from 1{angles if across == 'position' else ''}"
        raise layout.refuse(f"column {name} is {across} 0", remedy)
    return roles, across, outputs


def _kind_across(layout: Layout, roles: Mapping[str, int], kinds: Mapping[str, int]) -> str:
    """What outputs side by side stand for; numbers where a stroke but no place is, are positions.

    The `kinds` tell the first heading of each kind; there must be one, and no other column for it.
    """
    across, *others = kinds
    first, has_stroke = kinds[across], "stroke" in roles or "stroke" in layout.declared
    if across == "stroke" and has_stroke and roles.keys().isdisjoint(["position", "angle"]):
        across = "position"
    same = ("position", "angle") if across in ("position", "angle") else (across,)
    other = [roles[name] for name in ("output", *same) if name in roles]
    other += [kinds[name] for name in others]
    if other:
        one, two = (shown(layout.headings[index].text) for index in (other[0], first))
        remedy = f"use {across} and output, or one output column for each {across}"
        raise layout.refuse(f"columns {one} and {two} in one table", remedy)
    return across


def _across(layout: Layout, name: str, outputs: Iterable[float | str]) -> Column:
    """Column of what the headings of the outputs tell."""
    cells = [of if isinstance(of, str) else f"{of:.12g}" for of in outputs]
    lines = np.full(len(cells), layout.headings_line)
    unit = "deg" if name == "angle" else None  # in which headings have it
    across = Column(name, name, unit, cells, lines, layout.source)
    if name == "temperature":
        across = across.without_unit()
        return across._replace(unit=across.unit or "degC")
    return across


def _claim(taken: dict[Any, int], key: str | float, index: int, layout: Layout) -> None:
    if key in taken:
        names = [shown(layout.headings[i].text) for i in (taken[key], index)]
        problem = f"columns {names[0]} and {names[1]} mean the same"
        raise layout.refuse(problem, "keep one and rename the other")
    taken[key] = index


def _has_right_unit(heading: Heading) -> bool:
    return has_unit(heading.role or "", heading.unit or "")


def _require_unit(layout: Layout, heading: Heading) -> None:
    """Demand one of the units that a column may be given in, where it has a unit."""
    allowed = UNITS_OF.get(heading.role or "")
    if allowed and heading.unit and not _has_right_unit(heading):
        problem = f"column {shown(heading.text)} is in {heading.unit}"
        raise layout.refuse(problem, f"give it in {allowed[0]}")


def _require(layout: Layout, roles: Mapping[str, int], across: str) -> None:
    given = {*roles, across}
    one = f"a column temperature or a line '# temperature: 20'{_or_warmth(layout)}"
    wanted = [("temperature", "temperature", one)]
    if not {"position", "angle"} & given:
        numbered = across == "stroke"
        beside = ", or a column stroke if these numbers are positions" if numbered else ""
        wanted += [("position", "position or angle", f"a column position or angle{beside}")]
    if not across:  # before the stroke, which those of each stroke would tell
        wanted += [("output", "output", _remedy_of_outputs(layout))]
    one = f"a column stroke or a line '# stroke: 1'{_or_counter(layout)}"
    wanted += [("stroke", "stroke", one)]
    for name, what, remedy in wanted:
        if name not in given and (name in ("position", "output") or name not in layout.declared):
            problem = f"no column for {what} among {_headings(layout)}"
            raise layout.refuse(problem, f"add {remedy}{_other_command(layout, given)}")


def _or_warmth(layout: Layout) -> str:
    """A column of unknown name in a unit of temperatures; F may be farad."""
    for own in layout.headings:
        unit = name_and_unit(own.text, partial(has_unit, "temperature"))[1]
        if not own.role and has_unit("temperature", unit):
            unit = "degF" if scale_of(unit) == "degF" else unit
            call = shown(f"temperature [{unit}]")
            return f", or call column {shown(own.text)} {call} if it is one"
    return ""


def _or_counter(layout: Layout) -> str:
    """A column of runs may be one of strokes, as the German Lauf is both, and one of cycles too."""
    for own in layout.headings:
        if own.role == "run" or are_cycles(own.text):
            return f", or call column {shown(own.text)} stroke if it counts them"
    return ""


def _other_command(layout: Layout, given: Set[str]) -> str:
    """The command that takes what looks like a table of another one."""
    if hint := hint_of_triad(own.text for own in layout.headings):
        return hint
    timed = "output" in given and {"time", "date"} & given
    if timed and not {"position", "angle", "stroke"} & given:
        return "; a record over time goes to accelcal stability"
    return ""


def _remedy_of_outputs(layout: Layout) -> str:
    """What to add where no column has outputs; unknown ones may be those of accelerometers."""
    remedy = "a column output, or Y1, Y2, ... for the strokes"
    texts = [own.text for own in layout.headings if own.text and not own.role]
    unknown = [split_unit(text)[0] for text in texts if not is_supply(text)]
    if not unknown or len({*unknown}) < len(unknown):  # a serial is listed once
        return remedy
    names = ", ".join(unknown[:3]) + ", ..." * (len(unknown) > 3)
    return f"{remedy}, or a line {shown(f'# serials: {names}')} if these are accelerometers"


def _headings(layout: Layout) -> str:
    return shown(", ".join(heading.text for heading in layout.headings))


def _constants(layout: Layout, decimal: str, across: str) -> dict[str, Column]:
    """Columns that header lines stand for; an error in one names its header line."""
    columns = {}
    size = len(layout.rows)
    for name in CONSTANTS:
        if name in layout.declared and name != across:
            value, line, source = layout.declared[name]
            lines = np.full(size, line)
            own = decimal if decimal in value else "," if "," in value else "."
            columns[name] = Column(name, name, None, [value] * size, lines, source, own)
            if name in NUMERIC:
                columns[name] = columns[name].without_unit()
    return columns


def _is_blank(column: Column) -> bool:
    if not isinstance(column.cells, np.ndarray):
        return not any(column.cells)
    if np.isnan(column.cells).all():
        raise BulkEngineGivesUp  # it does not tell an empty cell from one that says nan
    return False


def _counts_up(column: Column) -> bool:
    """Tell whether whole numbers grow from row to row; rows may have been left out."""
    cells = [*map(str, column.cells)]
    return all(map(str.isdecimal, cells)) and all(int(a) < int(b) for a, b in pairwise(cells))


def _aside(layout: Layout, columns: Columns) -> dict[str, str]:
    """Names of the columns that are not used, with the reason."""
    reasons = {}
    for index, heading in enumerate(layout.headings):
        is_used = index in columns and (heading.text != _ROW_NUMBER or _counts_up(columns[index]))
        if not is_used:
            name = shown(heading.text) if heading.text else f"{index + 1} without heading"
            reasons[name] = "is of one reading, not of a row," if heading.role else "is not known"
    return reasons
