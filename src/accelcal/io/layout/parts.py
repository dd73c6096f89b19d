"""The parts of a table file: header lines, headings with their separator, and rows."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import product
from typing import NamedTuple

from accelcal.arguments.kinds import shown
from accelcal.errors import TableError
from accelcal.io.files.encodings import ENCODINGS
from accelcal.io.files.text import SourceText, refuse_document
from accelcal.io.layout.block_labels import labels_of_blocks, with_merged_names
from accelcal.io.layout.directions import tells_direction
from accelcal.io.layout.facts_beside import with_facts
from accelcal.io.layout.header_lines import Declared, header_line, refuse_declaration, uncommented
from accelcal.io.layout.heading_rows import (
    are_headings,
    blocks_of_columns,
    joined,
    numbers_alone,
    over_time,
    read_headings,
    tell_places,
)
from accelcal.io.layout.pivot_names import named_below
from accelcal.io.layout.rows_above import declarations_above, is_of_numbers
from accelcal.io.layout.unit_rows import UNITS_ABOVE, headings_with_units
from accelcal.io.layout.wide_blanks import with_tabs
from accelcal.io.words.headings import Heading
from accelcal.io.words.wording import hint_of_triad, lines_named, were

_MARKS = ("\t", ";", "|", ",")  # between cells, beside blanks
_BLANKS = re.compile(r"(?<=[\])])\s+|\s+(?![\[(])")  # between headings; one before a unit is none
_WIDE_BLANKS = re.compile(r" {2,}")
_PREAMBLE_LINES = 200
_HEADINGS_REMEDY = "the first row names the columns: temperature, position, stroke, output"
_EXCEL_ERROR = r"#(N/A|DIV/0!|VALUE!|REF!|NAME\?|NUM!|NULL!)"

NO_READINGS = ("column headings but no readings", "add a row for each reading")
"""Problem and remedy of a table without rows."""

_AreHeadings = Callable[[Sequence[Heading]], bool]

Recognise = Callable[[str], Heading]
"""Tells the meaning of a heading; its role is None where the column is not used."""


class Layout(NamedTuple):
    """A table taken apart, its cells still text.

    Attributes
    ----------
    source : str
        Name of the file.
    declared : mapping of str to Declared
        Header lines by canonical key, or by the key as written where it is not known.
    headings : tuple of Heading
        One entry a column.
    headings_line : int
        Line of the headings.
    separator : str or None
        ``","``, ``";"``, ``"|"`` or tab; None for runs of blanks.
    rows : list of str
        Lines of the table that are not blank.
    lines : sequence of int
        Line number of each row.
    notes : tuple of str
        What was set aside.
    labels : tuple of Heading
        What stands above each of several blocks of columns.
    """

    source: str
    declared: Mapping[str, Declared]
    headings: tuple[Heading, ...]
    headings_line: int
    separator: str | None
    rows: list[str]
    lines: Sequence[int]
    notes: tuple[str, ...]
    labels: tuple[Heading, ...] = ()

    def some(self, places: Sequence[int]) -> Layout:
        """Take some rows alone."""
        lines = [self.lines[place] for place in places]
        return self._replace(rows=[self.rows[place] for place in places], lines=lines)

    def refuse(self, problem: str, remedy: str) -> TableError:
        """Make the error of the headings."""
        return TableError(problem, remedy, source=self.source, line=self.headings_line)


class _Headings(NamedTuple):
    cells: tuple[Heading, ...]
    separator: str | None
    lines: tuple[int, ...]  # which tell them
    below: int  # index of the first line below them
    labels: tuple[Heading, ...] = ()
    notes: tuple[str, ...] = ()


def read_layout(source: SourceText, remedy: str = _HEADINGS_REMEDY) -> Layout:
    """Take a table apart.

    Raises
    ------
    TableError
        If there are no headings, no rows, or a key is declared twice with different values.
    """
    refuse_document(source.text, source.name)
    lines = _with_tabs(source.text)
    if source.encoding in ENCODINGS:
        remedy = f"{remedy}; the text is not UTF-8: export it so, if these letters are not its own"
    headings = _in_rows(lines, _below_numbers(lines, _find_headings(lines, source.name, remedy)))
    headings = _with_row_above(lines, headings)
    above = [item for item in _filled(lines[: headings.below]) if item[0] not in headings.lines]
    declared, aside = declarations_above(above, source.name, headings.separator, headings.cells)
    declared, beside = with_facts(declared, source, {own.role for own in headings.cells})
    rows, numbers, comments = _rows(lines, headings, source)
    if comments:
        aside.append(f"{were(comments, 'comment line')} set aside ({lines_named(comments)})")
    return Layout(
        source=source.name,
        declared=declared,
        headings=headings.cells,
        headings_line=headings.lines[-1],
        separator=headings.separator,
        rows=rows,
        lines=[number + source.skipped for number in numbers] if source.skipped else numbers,
        notes=(*headings.notes, *aside, *beside),
        labels=headings.labels,
    )


def split_line(line: str, separator: str | None) -> list[str]:
    """Split a line into cells without surrounding blanks.

    Quotes around a cell are taken off; None separates by runs of blanks.

    Examples
    --------
    >>> split_line('20; "a;b" ;1', ";")
    ['20', 'a;b', '1']
    """
    if separator is None:
        return line.replace('"', "").split()
    if '"' not in line:
        return [cell.strip() for cell in line.split(separator)]
    import csv

    reader = csv.reader([line], delimiter=separator, skipinitialspace=True)
    try:
        return [cell.strip() for cell in next(reader)]
    except csv.Error:  # a cell of more than 128 KiB
        return line.split(separator)


def split_headings(line: str, recognise: Recognise) -> tuple[tuple[Heading, ...], str | None]:
    """Split headings by the separator that gives the most known ones.

    `recognise` tells the meaning of a heading. The separator is a comma, a semicolon, a bar or a
    tab; None for runs of blanks.
    """
    marks: list[str | None] = [mark for mark in _MARKS if mark in line]
    if not marks and recognise(line).role:
        return (recognise(line),), ","
    split = {mark: tuple(map(recognise, _words(line, mark))) for mark in marks or [None]}
    best = max(split, key=lambda mark: _known(split[mark]))
    return split[best], best


def _filled(lines: Sequence[str]) -> Iterator[tuple[int, str]]:
    """Lines that are not blank, with their numbers."""
    return ((n, line) for n, line in enumerate(lines, 1) if line.strip(" \t,;|"))


def _with_tabs(text: str) -> list[str]:
    """Lines whose cells two blanks or more separate, one being a part of them, with tabs instead.

    The first row has as many cells as the headings then, none more, and none fits single blanks. If
    only this gives headings, none has fewer. Cells of a row that has fewer stand where those of the
    others do; the last are missing where the cells of the others do not stand below one another.
    """
    lines = text.split("\n")
    if "  " not in text or "\t" in text:
        return lines
    plain = headings_of(lines)
    if plain and plain.separator is not None:
        return lines
    wide = [_WIDE_BLANKS.sub("\t", line.strip(" ")) for line in lines]
    headings = headings_of(wide)
    if headings is None or headings.separator != "\t":
        return lines
    size = len(headings.cells)
    rows = [(row.count("\t") + 1, row) for _, row in _filled(wide[headings.below :])]
    short = [row for n, row in rows if n < size]
    odd = any(plain is None or len(row.split()) == len(plain.cells) for row in short)
    if not rows or odd or not rows[0][0] == size >= max(rows)[0]:
        return lines
    return [*wide[: headings.below], *with_tabs(lines[headings.below :], size)]


def headings_of(lines: list[str]) -> _Headings | None:
    """Find the first headings, if there are such."""
    with suppress(TableError):
        return _find_headings(lines, "", "")
    return None


def _find_headings(lines: list[str], name: str, remedy: str) -> _Headings:
    above: list[tuple[int, str]] = []
    commented = None
    for number, line in _filled(lines):
        if len(above) > _PREAMBLE_LINES:
            break
        bare = uncommented(line)
        found = None
        if bare is None or not header_line(bare)[0]:
            found = _headings(line if bare is None else bare, number)
        found = found or (_below_directions(lines, number) if bare is None else None)
        if bare is None and found:
            return found
        if bare is None and commented:  # headings as numpy.savetxt writes them
            return commented._replace(below=number - 1)
        commented = found or commented
        above.append((number, line))
    return _find_over_time(above, name, remedy)


def _find_over_time(above: list[tuple[int, str]], name: str, remedy: str) -> _Headings:
    """Where no row tells more, headings between blanks and tabs, or the last of time and output."""
    for number, line in above:
        if "\t" in line and (found := _split_best(line, number, [None], are_headings)):
            return found
    for number, line in reversed(above):
        if found := _headings(line, number, over_time):
            return found
    raise _no_headings(above, name, remedy)


def _below_numbers(lines: list[str], top: _Headings) -> _Headings:
    """Take headings below a row of numbered outputs, or of what blocks of columns are of."""
    texts, is_alone, start = [c.text for c in top.cells], numbers_alone(top.cells), top.below
    if start == len(lines) or not (is_alone or len({*texts}) < len(texts)):
        return top
    own = _headings(lines[start], start + 1)
    if own is None or own.separator != top.separator:
        return top
    blocks = blocks_of_columns([cell.text for cell in own.cells])
    return own if is_alone or (blocks[1] and labels_of_blocks(texts, *blocks)) else top


def _in_rows(lines: list[str], own: _Headings) -> _Headings:
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


def _named_below(lines: list[str], own: _Headings) -> _Headings | None:
    """Take a row below numbers that names the columns beside them, as pandas writes it."""
    first = own.lines[0]
    for start, end in ((first, own.below + 1), (first - 1, first)):
        if start > 0 and end <= len(lines):
            row = [_split_headings(lines[number - 1], own.separator) for number in (start, end)]
            if cells := named_below(*row):
                return own._replace(cells=cells, lines=(start, end), below=max(end, own.below))
    return None


def _with_row_above(lines: list[str], own: _Headings) -> _Headings:
    """Take the row above headings that has their units, or tells what blocks of them are of."""
    texts, first = [cell.text for cell in own.cells], own.lines[0]
    row = _split_headings(lines[first - 2], own.separator) if first > 1 else []
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


def _below_directions(lines: list[str], last: int) -> _Headings | None:
    """Headings that a line holds with one or two above it, where one tells directions alone."""
    if not tells_direction(" ".join(lines[max(last - 3, 0) : last])):
        return None
    marks: list[str | None] = [mark for mark in _MARKS if mark in lines[last - 1]]
    ways = product(marks, (last - 1, last - 2))
    return next(filter(None, (_joined(lines, start, last, mark) for mark, start in ways)), None)


def _joined(lines: list[str], start: int, end: int, separator: str | None) -> _Headings | None:
    """Headings that the rows from one line to another tell together."""
    rows = lines[max(start - 1, 0) : end]
    if start < 1 or any(uncommented(row) is not None for row in rows):
        return None
    cells = joined([_split_headings(row, separator) for row in rows])
    if cells is None:
        return None
    return _Headings(cells, separator, tuple(range(start, end + 1)), end)


def _headings(line: str, number: int, are: _AreHeadings = are_headings) -> _Headings | None:
    """Headings that a line holds, split by the separator that gives the most known words.

    Blanks are one only where no other gives headings, nor can be one: they stand within headings
    too.
    """
    marks: list[str | None] = [mark for mark in _MARKS if mark in line]
    blanks = [None] if len(line.split()) > 1 and {*marks} <= {","} else []
    return _split_best(line, number, marks, are) or _split_best(line, number, blanks, are)


def _split_best(
    line: str, number: int, separators: Sequence[str | None], are: _AreHeadings
) -> _Headings | None:
    split = [(read_headings(_split_headings(line, own)), own) for own in separators]
    told = [own for own in split if are(own[0])]
    if not told:
        return None
    cells, separator = max(told, key=lambda own: _known(own[0]))
    return _Headings(cells, separator, (number,), number)


def _known(cells: Sequence[Heading]) -> int:
    return sum(cell.role is not None for cell in cells)


def _split_headings(line: str, separator: str | None) -> list[str]:
    cells = _words(line.strip(" "), separator)  # a tab may stand before the first heading
    while cells and not cells[-1]:
        cells.pop()
    return cells


def _words(line: str, separator: str | None) -> list[str]:
    """Split headings; between blanks, a unit in brackets belongs to the word before it."""
    if separator is None:
        return _BLANKS.split(line.replace('"', "").strip())
    return split_line(line, separator)


def _rows(
    lines: list[str], headings: _Headings, source: SourceText
) -> tuple[list[str], Sequence[int], list[int]]:
    """Rows with their line numbers, and the lines of comments between them."""
    blank = ' \t"' + (headings.separator or "")
    start, end = headings.below, len(lines)
    while end > start and not lines[end - 1].strip(blank):
        end -= 1
    rows, numbers = lines[start:end], range(start + 1, end + 1)
    kept: Sequence[int] = numbers  # a list takes 40 bytes a row
    if not all(row.strip(blank) for row in rows):
        kept = [n for n, row in zip(numbers, rows, strict=True) if row.strip(blank)]
    comments = list(_comments(lines, kept, source)) if any("#" in row for row in rows) else []
    if comments:
        kept = sorted(set(kept).difference(comments))
    if not kept:
        raise TableError(*NO_READINGS, source=source.name, line=headings.lines[-1])
    if len(kept) < len(rows):
        rows = [lines[n - 1] for n in kept]
    return rows, kept, [n + source.skipped for n in comments]


def _comments(lines: list[str], numbers: Sequence[int], source: SourceText) -> Iterator[int]:
    for number in numbers:
        line = lines[number - 1]
        text = uncommented(line)
        if text is None or re.match(_EXCEL_ERROR, line.strip(' \t"')):
            continue
        refuse_declaration(text, source.name, number + source.skipped)
        yield number


def _no_headings(above: list[tuple[int, str]], name: str, remedy: str) -> TableError:
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
