"""Lines of a table split into cells, and units of its columns in a row of their own."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence

from accelcal.io.words.headings import Heading, read_heading, split_unit
from accelcal.io.words.vocabulary import MISSING, is_unit_of
from accelcal.units import is_same_unit

MARKS = ("\t", ";", "|", ",")
"""What may stand between cells, beside blanks."""

_BLANKS = re.compile(r"(?<=[\])])\s+|\s+(?![\[(])")  # between headings; one before a unit is none

Line = tuple[int, str]
"""A line with its number."""

Recognise = Callable[[str], Heading]
"""Tells the meaning of a heading; its role is None where the column is not used."""


def filled(lines: Sequence[str]) -> Iterator[Line]:
    """Lines that are not blank, with their numbers."""
    return ((n, line) for n, line in enumerate(lines, 1) if line.strip(" \t,;|"))


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
    marks: list[str | None] = [mark for mark in MARKS if mark in line]
    if not marks and recognise(line).role:
        return (recognise(line),), ","
    split = {mark: tuple(map(recognise, _words(line, mark))) for mark in marks or [None]}
    best = max(split, key=lambda mark: known(split[mark]))
    return split[best], best


def known(cells: Sequence[Heading]) -> int:
    """Count the headings whose meaning is known."""
    return sum(cell.role is not None for cell in cells)


def cells_of_headings(line: str, separator: str | None) -> list[str]:
    """Split headings without the empty cells behind the last one."""
    cells = _words(line.strip(" "), separator)  # a tab may stand before the first heading
    while cells and not cells[-1]:
        cells.pop()
    return cells


def _words(line: str, separator: str | None) -> list[str]:
    """Split headings; between blanks, a unit in brackets belongs to the word before it."""
    if separator is None:
        return _BLANKS.split(line.replace('"', "").strip())
    return split_line(line, separator)


_NO_UNIT = MISSING | {"1"}
_WORDED = (None, "date", "time")  # columns whose units may be any words, such as hh:mm:ss
UNITS_ABOVE = "the units stand above the headings (line {})"
UNITS_BELOW = "the units stand below the headings (line {})"


def headings_with_units(
    headings: Sequence[Heading], row: Sequence[str]
) -> tuple[Heading, ...] | None:
    """Join headings and their units.

    None where the row, which is below or above them, holds something else.
    """
    if any(row[len(headings) :]):
        return None
    missing = len(headings) - len(row)
    units = [cell.strip("[] ()") for cell in (*row, *[""] * missing)]
    pairs = list(zip(headings, units, strict=False))
    if not all(_may_be_unit(*pair) for pair in pairs) or not any(_is_unit(*pair) for pair in pairs):
        return None
    return tuple(_with_unit(*pair) for pair in pairs)


def _is_unit(heading: Heading, cell: str) -> bool:
    if cell.casefold() in _NO_UNIT or heading.role is None:
        return False
    is_told = heading.unit is None or is_same_unit(heading.unit, cell)
    return is_told and is_unit_of(heading.role, cell)


def _may_be_unit(heading: Heading, cell: str) -> bool:
    told = heading.unit or split_unit(heading.text)[1]
    roles = [heading.role] if heading.role else ["temperature", "output"]
    is_other = told and any(is_unit_of(role, cell) and is_unit_of(role, told) for role in roles)
    is_other = is_other and not is_same_unit(told, cell)
    worded = heading.role in _WORDED and not (any(map(str.isdigit, cell)) or is_other)
    is_merged = cell == heading.text  # one cell over both rows
    return is_merged or worded or cell.casefold() in _NO_UNIT or _is_unit(heading, cell)


def _with_unit(heading: Heading, cell: str) -> Heading:
    text = f"{heading.text} [{cell}]"
    if heading.unit is None and _is_unit(heading, cell):
        return heading._replace(text=text, unit=cell)
    is_told = heading.role is None and cell.casefold() not in _NO_UNIT
    return read_heading(text) if is_told and not heading.unit else heading
