"""What stands above a table: header lines, and cells of a form, of which some declare."""

from __future__ import annotations

import csv
import re
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from accelcal.arguments.kinds import shown
from accelcal.errors import TableError
from accelcal.io.layout.header_lines import (
    BEGINS_PAIR,
    PAIR,
    TESTED,
    Declared,
    declarations_in,
    declare,
    header_line,
    is_any_unit,
    key_and_unit,
    keys_and_values,
    notes_of_keys,
)
from accelcal.io.layout.separators import Line
from accelcal.io.words.headings import Heading, read_heading, split_unit
from accelcal.io.words.vocabulary import KEYS, KINDS_OF, LONGEST, begins_number, canonical_key
from accelcal.plural import lines_named
from accelcal.units import is_output_unit

_MARKS = "\t;|,"
_IN_CELLS = re.compile(r"([^,;\t]+)[,;\t](.*)")
_QUOTED = re.compile(r'"((?:[^"]|"")*)"')
_COMMA = re.compile(r"[0-9],[0-9]|.,\s")
"""A comma of a number or of language, behind which no program would begin a cell."""
_NUMBER = re.compile(r"[-+\u2212\u2013]?[0-9]+(?:[.,][0-9]+)?(?:[eE][-+]?[0-9]+)?")
_DECIMALS = re.compile(r"[0-9][.,][0-9]")
_DIGIT = re.compile("[0-9]")
_SAYS = re.compile("[0-9#:=]")
"""A label that has its value itself, or is none."""
SIGNS = (":", "=", "\uff1a")
"""What may stand in a cell of its own between a key and its value."""
_LISTS = ("serials", "runs")
_LABVIEW_CHANNELS = "***End_of_Header***"
"""Line of LabVIEW below which a second header tells of the channels, with words of its own."""
_COMMENT = re.compile(
    r"(?:comments?|notes?|remarks?|kommentare?|bemerkung(?:en)?|anmerkung(?:en)?|hinweise?"
    r"|commentaires?|remarques?|комментари[йи]|примечани[ея])\s*[:=]\s*\S.*",
    re.IGNORECASE,
)
"""A cell with the beginning of a comment, which goes on to the end of its row."""

INSTRUMENT = re.compile(
    r"(?<![^\W_])(?:dmm\d*|daq\d*|nanovolt\w*|\w*(?:volt|multi|thermo)-?m[eè]t(?:er|re)s?"
    r"|\w*kopf|head|(?:rotary|rate|turn)[ _]?table|drehtisch|\w*(?:chamber|kammer)|oven|ofen"
    r"|instruments?|equipment|(?:mess)?ger[äa]te?|power supply|netzteil|cal\w* due"
    r"|keysight|agilent|keithley|fluke|hewlett|hp|3458a?|34[49]\d\da?|2182a?|8508a?)(?![^\W_])",
    re.IGNORECASE,
)
"""A word for what is no accelerometer: an instrument, its maker or its model."""

MODEL = re.compile(
    r"(?:(?:digital|model|mod[eè]le|modell|type?|maker?|manufacturer|hersteller|instrument|ger[äa]t)"
    r"\W+)+",
    re.IGNORECASE,
)
"""What stands before the model of an instrument, or of the accelerometer."""

_TITLE = re.compile(r"\W*(?:tumble|calibration|test)\b", re.IGNORECASE)
"""What makes a title of the word for an instrument, as in ``Head calibration``."""

_QUANTITY = re.compile(r"\s[+-]?[0-9]+(?:[.,][0-9]+)?(?:[eE][+-]?[0-9]+)?(?:\s+|(?=°))(\S+)")


class Said(NamedTuple):
    """What a cell of a form says, alone or with the next one that has its value."""

    key: str  # canonical key; empty where it declares nothing
    value: str  # what it declares, or the words of an instrument or anything else
    behind: str = ""  # what stands before a serial number, and may be another instrument
    # whether that is in rows above, so that the serial number is the first of its row
    is_first: bool = False


_NOTHING = Said("", "")
_ENDS = ("", "serial")
"""Keys of what a serial number behind it may be of, or is not of; it is of nothing in between."""


def declarations_above(
    above: Sequence[Line], name: str, separator: str | None, headings: Sequence[Heading]
) -> tuple[dict[str, Declared], list[str]]:
    """Take what header lines and rows of a form declare above a table.

    The lines are those that are not blank, with their numbers; separator and headings are those of
    the table below. Values are by canonical key, or by the key as written where a header line has
    another one; with them come notes. Raises TableError if a key is declared twice with different
    values, or a reading stands above the headings.
    """
    _refuse_readings(above, name, separator, len(headings))
    declared: dict[str, Declared] = {}
    unsure: list[tuple[Declared, Said]] = []
    aside: list[int] = []
    for number, said in _said(_each_with_its_value(above, separator), separator):
        new = Declared(said.value, number, name)
        if not said.key:
            aside.append(number)
        elif said.key == "comment":
            before = f"{declared[said.key].value}; " if said.key in declared else ""
            declared[said.key] = new._replace(value=before + said.value)
        elif said.behind:
            unsure.append((new, said))
        else:
            declare(declared, said.key, new)
    told: list[str] = []
    if unsure and not {"serial", "serials"} & {*declared, *(own.role for own in headings)}:
        others = [own for own in unsure if not names_instrument(own[1].behind)]
        likely = [own for own in others if own[1].is_first] or others
        told = [_note_of_serial(likely) if likely else note_of_instrument(unsure[0][0].value)]
        if len({own.value for own, _ in likely}) == 1:
            declared["serial"] = likely[0][0]
            unsure = [own for own in unsure if own[0].value != likely[0][0].value]
    lines = lines_named(sorted({*aside, *(own.line for own, _ in unsure)}))
    aside += [own.line for own, _ in unsure]
    notes = [f"text above the headings was set aside ({lines})"] if aside else []
    return declared, [*notes, *told, *notes_of_keys(declared)]


def _refuse_readings(above: Sequence[Line], name: str, separator: str | None, size: int) -> None:
    """Refuse rows of as many numbers as there are headings below them, some with decimals."""
    for number, line in above:
        if not begins_number(line.lstrip(' "')):
            continue
        cells = line.split() if separator is None else _cells(line, separator)
        is_row = len(cells) == size > 2 and any(map(_DECIMALS.search, cells))
        if is_row and all(map(_NUMBER.fullmatch, cells)):
            problem, remedy = "a row of numbers above the column headings", "write it below them"
            raise TableError(problem, remedy, source=name, line=number)


def _note_of_serial(unsure: Sequence[tuple[Declared, Said]]) -> str:
    """Tell what becomes of serial numbers that may be those of other instruments."""
    serials = dict.fromkeys(own.value for own, _ in unsure)
    names = shown(", ".join(serials))
    if len(serials) > 1:
        which = "nothing tells which is that of the accelerometer"
        return f"serials {names} above the headings were set aside: {which}"
    own, said = unsure[0]
    where = f"stands behind {shown(said.behind)} (line {own.line})"
    return f"serial {names} {where} and is taken for that of the accelerometer"


def names_instrument(text: str) -> bool:
    """Whether a text begins with what an instrument is called, and does not tell its serial.

    Titles of a test, and quantities such as ``Oven temperature 20 degC``, are no names.

    Examples
    --------
    >>> names_instrument("Model: DMM 6500"), names_instrument("Head calibration of QA-2000")
    (True, False)
    """
    name = MODEL.sub("", text)
    found, quantity = INSTRUMENT.match(name), _QUANTITY.search(name)
    if found is None or TESTED.search(text) or _TITLE.match(name, found.end()):
        return False
    return not (quantity and is_any_unit(quantity[1])) and "serial" not in map(
        canonical_key, text.split()
    )


def note_of_instrument(serial: str) -> str:
    """Tell that a serial number is not taken for that of the accelerometer."""
    remedy = "give --serial, write it above the table as '# serial: ...', or call it 'DUT S/N'"
    return f"serial {shown(serial)} may be that of an instrument and is not used; {remedy}"


def _each_with_its_value(above: Sequence[Line], separator: str | None) -> Iterator[Line]:
    """Write a row of labels, whose values stand in the row below, as a line for each."""
    rows = deque(above)
    while rows:
        number, line = rows.popleft()
        is_next = bool(rows) and rows[0][0] == number + 1
        pairs = _pairs(_cells(line, separator), _cells(rows[0][1], separator)) if is_next else []
        yield from [(rows[0][0], pair) for pair in pairs] or [(number, line)]
        if pairs:
            rows.popleft()


def _pairs(labels: list[str], values: list[str]) -> list[str]:
    """Labels with their values; none unless two are keys, with digits in the values alone."""
    others = [name for name in labels if not canonical_key(split_unit(name)[0])]  # than T0
    if len(labels) != len(values) or any(map(_SAYS.search, others)):
        return []
    pairs = list(zip(labels, values, strict=True))
    of_keys = [value for name, value in pairs if label(name)[0]]
    is_row = len(of_keys) > 1 and all(map(_DIGIT.search, of_keys))
    return [f"{name}: {value}" for name, value in pairs] if is_row else []


def _said(above: Iterable[Line], separator: str | None) -> Iterator[tuple[int, Said]]:
    """What the lines above the headings say, with their numbers."""
    of_channels = False
    behind, last = "", 0
    for number, line in above:
        behind, last = behind if number == last + 1 else "", number
        pairs = keys_and_values(line)
        of_channels = of_channels or line.startswith(_LABVIEW_CHANNELS)
        if pairs is not None:
            told = [Said(*(pair if pair[0] else _in_cells(pair[1]))) for pair in pairs]
        else:
            told = [_NOTHING] if of_channels else said_in_row(line, separator, behind)
        for said in told:
            if said.key in _ENDS:
                behind = "" if said.key else said.value
            yield number, said


def _in_cells(text: str) -> tuple[str, str]:
    """Key and value of a header line in a cell each, or a comment."""
    match = _IN_CELLS.fullmatch(text)
    is_pair = match and not BEGINS_PAIR.match(match[2].strip())
    key, value = header_line(f"{match[1]}: {match[2]}") if match and is_pair else ("", "")
    return (key, value) if key in KEYS else ("comment", text)


def said_in_row(line: str, separator: str | None, above: str = "") -> list[Said]:
    """Take the declarations of a row apart.

    The value of a key is in its own cell, behind a colon, or in the next cell that is not empty;
    the unit of a number may be in the cell behind it. A comment goes on to the end of the row.
    Where the row does not have the separator of the table below, another one counts. What it stands
    below may be an instrument.

    Examples
    --------
    >>> [said[:2] for said in said_in_row("Serial;A-7;;Temperature, °C:;20", ";")]
    [('serial', 'A-7'), ('temperature', '20 °C')]
    >>> [said[:2] for said in said_in_row("Tumble test;;Seriennummer:;;Datum: 31.05.2024", ";")]
    [('', 'Tumble test'), ('', ''), ('date', '31.05.2024')]
    >>> [said[1:] for said in said_in_row("Voltmeter;HP;S/N;123;DUT;AL-15;S/N;A-7", ";")[1::2]]
    [('123', 'Voltmeter HP', False), ('A-7', '', False)]
    """
    cells = deque(_cells(line, separator))
    roles = [read_heading(cell).role for cell in cells]
    if ("output", "unit") in pairwise(roles) and not any(map(is_output_unit, cells)):
        return [_NOTHING]  # headings of a form of facts, such as Parameter, Value, Unit, Remark
    _drop_empty(cells)
    found: list[Said] = []
    behind = above
    while cells:
        cell, has_gap = cells.popleft(), _drop_empty(cells)
        if _COMMENT.fullmatch(cell):
            return [*found, _NOTHING]
        key, value, unit = label(cell)
        name, text = re.split("[:=]", cell)[0].strip(), cell
        if key in _LISTS:
            value = ",".join(filter(None, [value, *cells]))
            cells.clear()
        elif not value and cells and not (_is_label(cells[0]) or _names(key, cells, has_gap)):
            value = _value(key, cells)
            text = f"{cell} {value}"
        if key == "serial":
            is_own = TESTED.fullmatch(unit) or canonical_key(split_unit(name)[0]) != key
            is_first = not (unit or any(own.key in _ENDS for own in found))
            said, behind = Said(key, value, "" if is_own else unit or behind, is_first), ""
        elif key:
            is_kind = unit and not (is_any_unit(unit) or any(map(str.isdecimal, value)))
            is_kind = is_kind and key in KINDS_OF  # as Temp (Type T)
            is_none = is_kind or (key == "date" and not _DIGIT.search(value))
            said = _NOTHING if is_none else Said(key, f"{value} {unit}".strip())
        else:
            behind = "" if TESTED.fullmatch(name) else text
            said = Said("", behind)
        found.append(said if said.value else _NOTHING)
    return found


def label(cell: str) -> tuple[str, str, str]:
    """Take a text such as ``Temperature, °C: 20`` for a key.

    Key, value and unit are empty where there is none.

    Examples
    --------
    >>> label("Temperature, °C: 20"), label("T0 [degC]"), label("Friday, 31 May")
    (('temperature', '20', '°C'), ('reference_temperature', '', 'degC'), ('', '', ''))
    """
    pair = PAIR.fullmatch(cell)
    name, value = (pair[1].strip(), pair[2].strip()) if pair else (cell, "")
    key, unit = key_and_unit(name)
    return key, value, unit


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
    return [cell for cell in map(str.strip, cells) if cell not in SIGNS]


def _drop_empty(cells: deque[str]) -> bool:
    """Drop the empty cells before the next one that is not; tell whether there were such."""
    size = len(cells)
    while cells and not cells[0]:
        cells.popleft()
    return len(cells) < size


def _is_one(text: str, mark: str | None) -> bool:
    """Tell whether a row is a key, perhaps with its unit behind a comma, a colon and the value."""
    pair = PAIR.fullmatch(text)
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
        begins = BEGINS_PAIR.match(cell.strip()) or _is_label(cell.strip())
        if goes_on and _COMMA.fullmatch(f"{parts[-1][-1][-1:]},{cell[:1]}") and not begins:
            parts[-1].append(cell)
        else:
            parts.append([cell])
    return [",".join(part) for part in parts]


def _is_label(cell: str) -> bool:
    """Tell whether a cell has a key, or its colon; one letter is rather a unit, or a name.

    The serial of something else, as ``DMM S/N``, is a key as well.
    """
    is_serial = canonical_key(cell.rpartition(" ")[2]) == "serial"
    return len(cell) > 1 and (cell[-1] in ":=" or is_serial or bool(label(cell)[0]))


def _names(key: str, cells: Sequence[str], has_gap: bool) -> bool:
    """Tell whether a cell behind a serial that is empty names what the next cell is of.

    One with a digit may be the serial itself, but not where a cell is empty before it and one
    stands behind it alone.
    """
    first, *others = filter(None, cells)
    if key != "serial" or not others or _is_label(others[0]):
        return False
    may_be_serial = any(map(str.isdecimal, first))
    return not may_be_serial or (has_gap and [*others] == [cells[1]])


def _value(key: str, cells: deque[str]) -> str:
    value = cells.popleft()
    _drop_empty(cells)
    if key and cells and _NUMBER.fullmatch(value) and is_any_unit(cells[0]):
        value = f"{value} {cells.popleft()}"
    return value


def is_of_numbers(line: str) -> bool:
    """Tell a row of readings: most of its cells begin as numbers do."""
    cells = re.split(r"[;\t]|,(?!\d)|\s+", line.strip())
    numbers = [cell for cell in cells if begins_number(cell) or cell == "-"]
    return 2 * len(numbers) > len(cells)
