"""Lines of a table split into cells, by the mark or the blanks between them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence

from accelcal.io.words.headings import Heading

MARKS = ("\t", ";", "|", ",")
"""What may stand between cells, beside blanks."""

_BLANKS = re.compile(r"(?<=[\])])\s+|\s+(?![\[(])")  # between headings; one before a unit is none

Recognise = Callable[[str], Heading]
"""Tells the meaning of a heading; its role is None where the column is not used."""


def filled(lines: Sequence[str]) -> Iterator[tuple[int, str]]:
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
