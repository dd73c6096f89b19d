"""Where the headings of a table are: the rows that name its columns, and those that tell more."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from itertools import product
from types import MappingProxyType
from typing import NamedTuple

from accelcal.arguments.kinds import shown
from accelcal.errors import TableError
from accelcal.io.layout.header_lines import header_line, uncommented
from accelcal.io.layout.heading_rows import (
    are_headings,
    blocks_of_columns,
    joined,
    numbers_alone,
    over_time,
    read_headings,
    tell_places,
)
from accelcal.io.layout.output_headings import tells_direction
from accelcal.io.layout.rows_above import is_of_numbers
from accelcal.io.layout.separators import (
    MARKS,
    UNITS_ABOVE,
    Line,
    cells_of_headings,
    filled,
    headings_with_units,
    known,
)
from accelcal.io.words.headings import Heading, hint_of_triad, read_heading
from accelcal.io.words.vocabulary import COLUMNS, UNITS_OF

_NUMBERED: Mapping[str | None, str] = MappingProxyType(
    {
        "stroke": "stroke {}",
        "position": "position {}",
        "angle": "{} {}",
        "temperature": "T={} {}",
        "serial": "S/N {}",
    }
)
"""What numbers side by side stand for -> the heading of one, with its unit."""


def named_below(above: Sequence[str], row: Sequence[str]) -> tuple[Heading, ...] | None:
    """Join a row of numbers, before which stands what they are, and the names below it.

    None where the rows are no such headings.

    Examples
    --------
    >>> rows = ["stroke", "", "1", "2"], ["temperature", "position"]
    >>> [(cell.role, cell.of) for cell in named_below(*rows)][1:]
    [('position', None), ('strokes', 1), ('strokes', 2)]
    >>> named_below(["T [K]", "293.15", "333.15"], ["position"])[1][0::3]
    ('T [K] 293.15', '293.15 K')
    """
    names = [cell for cell in row if cell]
    told = [cell for cell in above[: len(names)] if cell]
    if len(told) != 1 or [*row[: len(names)]] != names:
        return None
    numbers = above[len(names) :]
    headings = _numbered_by(told[0], numbers)
    if not headings or not COLUMNS.keys() >= {read_heading(name).role for name in names}:
        return None
    cells = read_headings([*names, *headings])
    if not (tell_places(cells) and are_headings(cells)):
        return None
    texts = [*names, *(f"{told[0]} {own}" for own in numbers)]
    return tuple(own._replace(text=text) for own, text in zip(cells, texts, strict=True))


def _numbered_by(name: str, numbers: Sequence[str]) -> list[str]:
    """Headings that numbers side by side are, by the name before them; none by another name.

    Examples
    --------
    >>> _numbered_by("Temp [K]", ["293.15", ""]), _numbered_by("Table", ["1"])
    (['T=293.15 K', ''], [])
    """
    what = read_heading(name)
    form, unit = _NUMBERED.get(what.role), what.unit or UNITS_OF.get(what.role or "", ("",))[0]
    return [form.format(own, unit) if own else "" for own in numbers] if form else []


def labels_of_blocks(row: Sequence[str], lead: int, width: int) -> tuple[Heading, ...]:
    """What a row above blocks of columns tells of each: its temperature or serial; else nothing.

    The first `lead` columns belong to all blocks. A cell may stand in each column of its block, and
    numbers may have their name before them.

    Examples
    --------
    >>> [own.of for own in labels_of_blocks(["20 °C", "", "", "60 °C"], 0, 3)]
    [20.0, 60.0]
    >>> [own[0::3] for own in labels_of_blocks(["T [K]", "293.15", "", "333.15", ""], 1, 2)]
    [('293.15', '293.15 K'), ('333.15', '333.15 K')]
    """
    names, cells = [cell for cell in row[:lead] if cell], row[lead:]
    own = [
        "" if i % width and cell == cells[i - i % width] else cell for i, cell in enumerate(cells)
    ]
    starts = [place for place, cell in enumerate(own) if cell]
    texts = [own[place] for place in starts]
    if len(names) > 1:
        return ()
    told = _numbered_by(names[0], texts) if names else texts
    labels = [read_heading(cell) for cell in told]
    is_apart = len(starts) > 1 and starts[0] < width
    is_apart = is_apart and starts == [*range(starts[0], len(starts) * width, width)]
    if not is_apart or {own.role for own in labels} not in ({"temperatures"}, {"serials"}):
        return ()
    return tuple(own._replace(text=text) for own, text in zip(labels, texts, strict=True))


def with_merged_names(texts: Sequence[str], above: Sequence[str]) -> tuple[Heading, ...]:
    """Headings whose first ones stand in the row above, as cells merged over both do; else nothing.

    Examples
    --------
    >>> [cell.role for cell in with_merged_names(["", "Y1", "Y2", "Y1", "Y2"], ["J"])][:2]
    ['position', 'strokes']
    """
    size = len(above)
    known = all(read_heading(cell).role in COLUMNS for cell in above)
    merged = size and known and not any(texts[:size])
    return read_headings([*above, *texts[size:]]) if merged else ()


_PREAMBLE_LINES = 200

_Marks = Sequence[str | None]
_AreHeadings = Callable[[Sequence[Heading]], bool]


class FoundHeadings(NamedTuple):
    """Headings of a table, and where they stand among its lines."""

    cells: tuple[Heading, ...]
    separator: str | None
    lines: tuple[int, ...]  # which tell them
    below: int  # index of the first line below them
    labels: tuple[Heading, ...] = ()
    notes: tuple[str, ...] = ()


def find_headings(lines: list[str], name: str, remedy: str) -> FoundHeadings:
    """Find the headings of a table with all rows that tell more of them.

    Raises TableError if there are none.
    """
    first = _first_headings(lines, name, remedy)
    return _with_row_above(lines, _in_rows(lines, _below_numbers(lines, first)))


def headings_of(lines: list[str]) -> FoundHeadings | None:
    """Find the first headings, if there are such."""
    with suppress(TableError):
        return _first_headings(lines, "", "")
    return None


def _first_headings(lines: list[str], name: str, remedy: str) -> FoundHeadings:
    above: list[Line] = []
    commented = None
    for number, line in filled(lines):
        if len(above) > _PREAMBLE_LINES:
            break
        bare = uncommented(line)
        found = None
        if bare is None or not header_line(bare)[0]:
            found = _headings(line if bare is None else bare, number)
        found = found or (_below_directions(lines, number) if bare is None else None)
        if bare is None and found:
            return found
        if commented and (bare is None or are_units(commented, line)):
            return commented._replace(below=number - 1)  # as numpy.savetxt writes them
        commented = found or commented
        above.append((number, line))
    return _find_over_time(above, name, remedy)


def are_units(headings: FoundHeadings, line: str) -> bool:
    """Whether a row tells the units of headings, of which the first may be ``% RH``."""
    row = cells_of_headings(line, headings.separator)
    return headings_with_units(headings.cells, row) is not None


def _find_over_time(above: list[Line], name: str, remedy: str) -> FoundHeadings:
    """Where no row tells more, headings between blanks and tabs, or the last of time and output."""
    for number, line in above:
        if "\t" in line and (found := _split_best(line, number, [None], are_headings)):
            return found
    for number, line in reversed(above):
        if found := _headings(line, number, over_time):
            return found
    raise _no_headings(above, name, remedy)


def _below_numbers(lines: list[str], top: FoundHeadings) -> FoundHeadings:
    """Take headings below a row of numbered outputs, or of what blocks of columns are of."""
    texts, is_alone, start = [c.text for c in top.cells], numbers_alone(top.cells), top.below
    if start == len(lines) or not (is_alone or len({*texts}) < len(texts)):
        return top
    own = _headings(lines[start], start + 1)
    if own is None or own.separator != top.separator:
        return top
    blocks = blocks_of_columns([cell.text for cell in own.cells])
    return own if is_alone or (blocks[1] and labels_of_blocks(texts, *blocks)) else top


def _in_rows(lines: list[str], own: FoundHeadings) -> FoundHeadings:
    """Take the rows above or below headings that tell more of the outputs."""
    first, last = own.lines[0], own.lines[-1]
    if below := _named_below(lines, own):
        return below
    near = lines[max(first - 3, 0) : last + 1]
    alone = tell_places(own.cells) and not numbers_alone(own.cells)
    if alone and not tells_direction(" ".join(near)):
        return own
    for start, end in ((first, last + 1), (first - 1, last), (first - 2, last)):
        if found := _joined(lines, start, end, own.separator):
            return found._replace(below=max(end, own.below))
    return own


def _named_below(lines: list[str], own: FoundHeadings) -> FoundHeadings | None:
    """Take a row below numbers that names the columns beside them, as pandas writes it."""
    first = own.lines[0]
    for start, end in ((first, own.below + 1), (first - 1, first)):
        if start > 0 and end <= len(lines):
            row = [cells_of_headings(lines[number - 1], own.separator) for number in (start, end)]
            if cells := named_below(*row):
                return own._replace(cells=cells, lines=(start, end), below=max(end, own.below))
    return None


def _with_row_above(lines: list[str], own: FoundHeadings) -> FoundHeadings:
    """Take the row above headings that has their units, or tells what blocks of them are of."""
    texts, first = [cell.text for cell in own.cells], own.lines[0]
    row = cells_of_headings(lines[first - 2], own.separator) if first > 1 else []
    lead, width = blocks_of_columns(texts)
    if merged := with_merged_names(texts, row[:lead]):
        row[:lead] = [""] * lead
    labels = labels_of_blocks(row, lead, width) if width else ()
    cells = headings_with_units(own.cells, row)
    if cells is None and (not labels or len(labels) != -(-(len(own.cells) - lead) // width)):
        return own
    notes = (UNITS_ABOVE.format(first - 1),) if cells else ()
    taken = own._replace(cells=cells or merged or own.cells, labels=labels, notes=notes)
    return taken._replace(lines=(first - 1, *own.lines))


def _below_directions(lines: list[str], last: int) -> FoundHeadings | None:
    """Headings that a line holds with one or two above it, where one tells directions alone."""
    if not tells_direction(" ".join(lines[max(last - 3, 0) : last])):
        return None
    marks: list[str | None] = [mark for mark in MARKS if mark in lines[last - 1]]
    ways = product(marks, (last - 1, last - 2))
    return next(filter(None, (_joined(lines, start, last, mark) for mark, start in ways)), None)


def _joined(lines: list[str], start: int, end: int, separator: str | None) -> FoundHeadings | None:
    """Headings that the rows from one line to another tell together."""
    rows = lines[max(start - 1, 0) : end]
    if start < 1 or any(uncommented(row) is not None for row in rows):
        return None
    cells = joined([cells_of_headings(row, separator) for row in rows])
    if cells is None:
        return None
    return FoundHeadings(cells, separator, tuple(range(start, end + 1)), end)


def _headings(line: str, number: int, are: _AreHeadings = are_headings) -> FoundHeadings | None:
    """Headings that a line holds, split by the separator that gives the most known words.

    Blanks are one only where no other gives headings, nor can be one: they stand within headings
    too.
    """
    marks: list[str | None] = [mark for mark in MARKS if mark in line]
    blanks = [None] if len(line.split()) > 1 and {*marks} <= {","} else []
    return _split_best(line, number, marks, are) or _split_best(line, number, blanks, are)


def _split_best(line: str, number: int, marks: _Marks, are: _AreHeadings) -> FoundHeadings | None:
    split = [(read_headings(cells_of_headings(line, own)), own) for own in marks]
    told = [own for own in split if are(own[0])]
    if not told:
        return None
    cells, separator = max(told, key=lambda own: known(own[0]))
    return FoundHeadings(cells, separator, (number,), number)


def _no_headings(above: list[Line], name: str, remedy: str) -> TableError:
    table = [(number, line) for number, line in above if uncommented(line) is None]
    if not above:
        return TableError("the file is empty", remedy, source=name)
    if not table:
        return TableError("header lines, but no table", remedy, source=name)
    place = next((i for i, (_, line) in enumerate(table) if is_of_numbers(line)), 1)
    number, line = table[max(place - 1, 0)]  # a form may stand above the headings
    problem = f"no column headings in {shown(line.strip())}"
    if place == 0:
        problem = "numbers where the column headings belong"
    remedy += hint_of_triad(re.split(r"[,;|\t]", line))
    return TableError(problem, remedy, source=name, line=number)
