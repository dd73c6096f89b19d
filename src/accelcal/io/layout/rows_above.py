"""Rows above a table that are no header lines: cells of a form, of which some declare."""

from __future__ import annotations

import csv
import re
from collections import deque

from accelcal.io.layout.header_lines import BEGINS_PAIR, declarations_in
from accelcal.io.words.vocabulary import KINDS_OF, LONGEST, canonical_key, name_and_unit
from accelcal.units import UNITS, is_output_unit, size_of

_MARKS = "\t;|,"
_PAIR = re.compile(r"([^:=]+)[:=](.*)")
_QUOTED = re.compile(r'"((?:[^"]|"")*)"')
_COMMA = re.compile(r"[0-9],[0-9]|.,\s")
"""A comma of a number or of language, behind which no program would begin a cell."""
_NUMBER = re.compile(r"[-+\u2212\u2013]?[0-9]+(?:[.,][0-9]+)?(?:[eE][-+]?[0-9]+)?")
_LISTS = ("serials", "runs")
_COMMENT = re.compile(
    r"(?:comments?|notes?|remarks?|kommentare?|bemerkung(?:en)?|anmerkung(?:en)?|hinweise?"
    r"|commentaires?|remarques?|комментари[йи]|примечани[ея])\s*[:=]\s*\S.*",
    re.IGNORECASE,
)
"""A cell with the beginning of a comment, which goes on to the end of its row."""
_INSTRUMENT = re.compile(
    r"(?:volt|multi|thermo)[ -]?(?:meter|mètre)|dmm|вольтметр|мультиметр|термометр"
    r"|netzteil|(?:supply|\boven|chamber|kammer|logger)\b",
    re.IGNORECASE,
)
"""What has a serial number of its own in a stand."""
_TESTED = re.compile(
    r"acc[ée]l[ée]ro|beschleunigung|акселеро|\bdut\b|prüfling|\b(?:in|im|with|mit)\b", re.IGNORECASE
)
"""An accelerometer, or a test in or with an instrument."""


def declared_in_row(line: str, separator: str | None) -> list[tuple[str, str]]:
    """Take the declarations of a row apart.

    The value of a key is in its own cell, behind a colon, or in the next cell that is not empty;
    the unit of a number may be in the cell behind it. A comment goes on to the end of the row, and
    a serial number behind the name of another instrument is that of the instrument.

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
    >>> declared_in_row("Serial;A-7;Voltmeter;S/N;123", ";")
    [('serial', 'A-7'), ('', ''), ('', '')]
    """
    cells = deque(_cells(line, separator))
    found: list[tuple[str, str]] = []
    of_instrument = False
    while cells:
        cell = cells.popleft()
        if _COMMENT.fullmatch(cell):
            return [*found, ("", "")]
        key, value, unit = label(cell)
        if key in _LISTS:
            value = ",".join(filter(None, [value, *cells]))
            cells.clear()
        elif not value and cells and not _is_label(cells[0]):
            value = _value(key, cells)
        if key == "serial" and of_instrument:
            key, of_instrument = "", False
        elif key or _TESTED.search(f"{cell} {value}"):
            of_instrument = False
        elif _INSTRUMENT.search(f"{cell} {value}"):
            of_instrument = label(_INSTRUMENT.split(cell)[-1].strip())[0] != "serial"
        found.append((key, f"{value} {unit}".strip()) if key and value else ("", ""))
    return found


def label(cell: str) -> tuple[str, str, str]:
    """Take a text such as ``Temperature, °C: 20`` for a key.

    Parameters
    ----------
    cell : str
        The text.

    Returns
    -------
    key : str
        One of `accelcal.io.words.vocabulary.KEYS`, empty for an unknown one.
    value : str
        What stands behind its colon.
    unit : str
        The unit of the key.

    Examples
    --------
    >>> label("Temperature, °C: 20"), label("T0 [degC]"), label("Friday, 31 May")
    (('temperature', '20', '°C'), ('reference_temperature', '', 'degC'), ('', '', ''))
    """
    pair = _PAIR.fullmatch(cell)
    name, value = (pair[1].strip(), pair[2].strip()) if pair else (cell, "")
    bare, unit = name_and_unit(name, _is_unit, behind_blanks=False)
    return canonical_key(bare) or "", value, unit


def _cells(line: str, separator: str | None) -> list[str]:
    text = line.strip(" ,;\t")
    mark = separator if separator and separator in text else None
    bare = _QUOTED.sub(lambda cell: cell[1].replace('""', '"'), text)
    if _is_one(text if mark else bare, mark):
        return declarations_in(bare)
    mark = mark or next((mark for mark in _MARKS if mark in text), "\t")
    long = len(text) > csv.field_size_limit()
    cells = text.split(mark) if long else next(csv.reader([text], delimiter=mark))
    if mark == ",":
        cells = _with_commas(cells)
    return [cell.strip() for cell in cells if cell.strip()]


def _is_one(text: str, mark: str | None) -> bool:
    """Tell whether a row is a key, perhaps with its unit behind a comma, a colon and the value."""
    pair = _PAIR.fullmatch(text)
    if pair is None:
        return False
    key = label(text)[0]
    if mark:
        return mark in pair[1] and key in KINDS_OF
    first = re.split(f"[{''.join(_MARKS)}]", text, maxsplit=1)[0]
    return bool(key) or not label(first)[0]


def _with_commas(cells: list[str]) -> list[str]:
    """Cells of which a value behind a colon has commas, as 20,5 and Friday, 31 May have them."""
    parts: list[list[str]] = []
    for cell in cells:
        goes_on = parts and BEGINS_PAIR.match(parts[-1][0][:LONGEST])
        if goes_on and _COMMA.fullmatch(f"{parts[-1][-1][-1:]},{cell[:1]}") and not _begins(cell):
            parts[-1].append(cell)
        else:
            parts.append([cell])
    return [",".join(part) for part in parts]


def _is_label(cell: str) -> bool:
    """Tell whether a cell has a key, or its colon; one letter is rather a unit, or a name."""
    return len(cell) > 1 and (cell[-1] in ":=" or bool(label(cell)[0]))


def _begins(cell: str) -> bool:
    """Tell whether a cell begins something of its own."""
    return bool(BEGINS_PAIR.match(cell.strip())) or _is_label(cell.strip())


def _value(key: str, cells: deque[str]) -> str:
    value = cells.popleft()
    if key and cells and _NUMBER.fullmatch(value) and _is_unit(cells[0]):
        value = f"{value} {cells.popleft()}"
    return value


def _is_unit(text: str) -> bool:
    return is_output_unit(text) or size_of(text, *UNITS) is not None
