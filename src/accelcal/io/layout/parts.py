"""The parts of a table file: header lines, headings with their separator, and rows."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from accelcal.errors import TableError
from accelcal.io.files.encodings import ENCODINGS
from accelcal.io.files.text import SourceText, refuse_document
from accelcal.io.layout.facts_beside import with_facts
from accelcal.io.layout.found_headings import FoundHeadings, are_units, find_headings, headings_of
from accelcal.io.layout.header_lines import Declared, refuse_declaration, uncommented
from accelcal.io.layout.rows_above import declarations_above
from accelcal.io.layout.separators import filled
from accelcal.io.words.headings import Heading
from accelcal.plural import lines_named, were

_WIDE_BLANKS = re.compile(r" {2,}")
_HEADINGS_REMEDY = "the first row names the columns: temperature, position, stroke, output"
_WIDE_COMMA = "\uff0c"  # of Chinese text
_WIDE_CELL = re.compile(r"[^ ]+(?: [^ ]+)*")
_EXCEL_ERROR = r"#(N/A|DIV/0!|VALUE!|REF!|NAME\?|NUM!|NULL!)"

NO_READINGS = ("column headings but no readings", "add a row for each reading")
"""Problem and remedy of a table without rows."""


class Layout(NamedTuple):
    """A table taken apart, its cells still text."""

    source: str
    # header lines by canonical key, or by the key as written where it is not known
    declared: Mapping[str, Declared]
    headings: tuple[Heading, ...]  # one entry a column
    headings_line: int  # line of the headings
    separator: str | None  # ``","``, ``";"``, ``"|"`` or tab; None for runs of blanks
    rows: list[str]  # lines of the table that are not blank
    lines: Sequence[int]  # line number of each row
    notes: tuple[str, ...]  # what was set aside
    labels: tuple[Heading, ...] = ()  # what stands above each of several blocks of columns

    def some(self, places: Sequence[int]) -> Layout:
        """Take some rows alone."""
        lines = [self.lines[place] for place in places]
        return self._replace(rows=[self.rows[place] for place in places], lines=lines)

    def noting(self, *notes: str) -> Layout:
        """Add notes."""
        return self._replace(notes=(*self.notes, *notes))

    def refuse(self, problem: str, remedy: str) -> TableError:
        """Make the error of the headings."""
        return TableError(problem, remedy, source=self.source, line=self.headings_line)


def read_layout(source: SourceText, remedy: str = _HEADINGS_REMEDY) -> Layout:
    """Take a table apart.

    Raises TableError if there are no headings, no rows, or a key is declared twice with different
    values.
    """
    refuse_document(source.text, source.name)
    lines = _with_tabs(source.text)
    if source.encoding in ENCODINGS:
        remedy = f"{remedy}; the text is not UTF-8: export it so, if these letters are not its own"
    headings = find_headings(lines, source.name, remedy)
    above = [item for item in filled(lines[: headings.below]) if item[0] not in headings.lines]
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


def _with_tabs(text: str) -> list[str]:
    """Lines whose cells two blanks or more separate, one being a part of them, with tabs instead.

    The first row has as many cells as the headings then, none more, and none fits single blanks. If
    only this gives headings, none has fewer. Cells of a row that has fewer stand where those of the
    others do; the last are missing where the cells of the others do not stand below one another.
    """
    lines = text.split("\n")
    if _WIDE_COMMA in text and headings_of(lines) is None:
        lines = text.replace(_WIDE_COMMA, ",").split("\n")
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
    rows = [(row.count("\t") + 1, row) for _, row in filled(wide[headings.below :])]
    short = [row for n, row in rows if n < size]
    odd = any(plain is None or len(row.split()) == len(plain.cells) for row in short)
    if not rows or odd or not rows[0][0] == size >= max(rows)[0]:
        return lines
    return [*wide[: headings.below], *_between_tabs(lines[headings.below :], size)]


def _between_tabs(lines: Sequence[str], size: int) -> Iterator[str]:
    r"""Put tabs between the cells of rows that two blanks or more separate.

    A row of fewer cells has them in the columns of the others.

    Examples
    --------
    >>> list(_between_tabs(["0   1.35  1.36", "45        0.96"], 3))
    ['0\t1.35\t1.36', '45\t\t0.96']
    """
    found = [list(_WIDE_CELL.finditer(line)) for line in lines]
    whole = [[cell.span() for cell in cells] for cells in found if len(cells) == size]
    columns = [(min(a for a, _ in own), max(b for _, b in own)) for own in zip(*whole, strict=True)]
    for cells in found:
        row = [""] * len(cells)
        for place, cell in zip(_places(cells, columns), cells, strict=True):
            row += [""] * (place + 1 - len(row))
            row[place] = cell.group()
        yield "\t".join(row)


def _places(cells: Sequence[re.Match[str]], columns: Sequence[tuple[int, int]]) -> Sequence[int]:
    """Columns in which cells stand: the first ones, where there are as many or nothing tells."""
    over = [
        place
        for cell in cells
        for place, (start, end) in enumerate(columns)
        if cell.start() < end and start < cell.end()
    ]
    told = len(over) == len(set(over)) == len(cells) < len(columns)
    return over if told else range(len(cells))


def _rows(
    lines: list[str], headings: FoundHeadings, source: SourceText
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
    has_signs = any("#" in row or "%" in row for row in rows)
    comments = [*_comments(lines, kept, headings, source)] if has_signs else []
    if comments:
        kept = sorted(set(kept).difference(comments))
    if not kept:
        raise TableError(*NO_READINGS, source=source.name, line=headings.lines[-1])
    if len(kept) < len(rows):
        rows = [lines[n - 1] for n in kept]
    return rows, kept, [n + source.skipped for n in comments]


def _comments(
    lines: list[str], numbers: Sequence[int], headings: FoundHeadings, source: SourceText
) -> Iterator[int]:
    for number in numbers:
        line = lines[number - 1]
        text = uncommented(line)
        if text is None or re.match(_EXCEL_ERROR, line.strip(' \t"')):
            continue
        if number == numbers[0] and are_units(headings, line):
            continue
        refuse_declaration(text, source.name, number + source.skipped)
        yield number
