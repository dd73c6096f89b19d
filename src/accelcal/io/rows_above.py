"""Rows above a table that are no header lines: cells of a form, of which some declare."""

from __future__ import annotations

import csv
import re
from collections import deque

from accelcal.io.header_lines import declarations_in
from accelcal.io.vocabulary import LONGEST, canonical_key, split_unit
from accelcal.units import UNITS, is_output_unit, size_of

_MARKS = "\t;|,"
_PAIR = re.compile(r"([^:=]+)[:=](.*)")
_BEFORE_UNIT = re.compile(r"(.+?)(?:\s*[/,]|\s(?:in|en|в)(?=\s))\s*(\S.*)")
_NUMBER = re.compile(r"[-+\u2212]?[0-9]+(?:[.,][0-9]+)?(?:[eE][-+]?[0-9]+)?")
_LISTS = ("serials", "runs")


def declared_in_row(line: str, separator: str | None) -> list[tuple[str, str]]:
    """Take the declarations of a row apart.

    The value of a key is in its own cell, behind a colon, or in the next cell that is not empty;
    the unit of a number may be in the cell behind it.

    Parameters
    ----------
    line : str
        The row.
    separator : str or None
        Separator of the table below. Where the row does not have it, another one counts.

    Returns
    -------
    list of tuple of str
        Canonical key and value; both are empty for a text that declares nothing.

    Examples
    --------
    >>> declared_in_row("Serial;A-7;;Temperature, °C:;20", ";")
    [('serial', 'A-7'), ('temperature', '20 °C')]
    >>> declared_in_row("Tumble test;;Seriennummer:;;Datum: 31.05.2024", ";")
    [('', ''), ('', ''), ('date', '31.05.2024')]
    """
    cells = deque(_cells(line, separator))
    found = []
    while cells:
        key, value, unit = _label(cells.popleft())
        if key in _LISTS:
            value = ",".join(filter(None, [value, *cells]))
            cells.clear()
        elif not value and cells and not _is_label(cells[0]):
            value = _value(key, cells)
        found.append((key, f"{value} {unit}".strip()) if key and value else ("", ""))
    return found


def _cells(line: str, separator: str | None) -> list[str]:

    text = line.strip(" ,;\t")
    mark = separator if separator and separator in text else None
    if mark is None and _PAIR.fullmatch(text):  # of which a comma may be a decimal mark
        return declarations_in(text[1:-1] if text[0] == text[-1] == '"' else text)
    mark = mark or next((mark for mark in _MARKS if mark in text), "\t")
    long = len(text) > csv.field_size_limit()
    cells = text.split(mark) if long else next(csv.reader([text], delimiter=mark))
    return [cell.strip() for cell in cells if cell.strip()]


def _label(cell: str) -> tuple[str, str, str]:
    """Key that a cell has, empty for an unknown one, the value beside it, and the unit."""
    pair = _PAIR.fullmatch(cell)
    label, value = (pair[1].strip(), pair[2].strip()) if pair else (cell, "")
    name, unit = split_unit(label)
    behind = _BEFORE_UNIT.fullmatch(label) if len(label) <= LONGEST else None
    if behind and not canonical_key(name):
        name, unit = behind.groups()
    return canonical_key(name) or "", value, unit


def _is_label(cell: str) -> bool:
    """Tell whether a cell has a key; one letter is rather a unit, as g is, or a name."""
    return len(cell) > 1 and bool(_label(cell)[0])


def _value(key: str, cells: deque[str]) -> str:
    value = cells.popleft()
    if key and cells and _NUMBER.fullmatch(value) and _is_unit(cells[0]):
        value = f"{value} {cells.popleft()}"
    return value


def _is_unit(text: str) -> bool:
    return is_output_unit(text) or size_of(text, *UNITS) is not None
