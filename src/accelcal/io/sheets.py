"""Sheets of a workbook as parts of one table, and the facts that sheets beside them tell."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import NamedTuple, TypeVar

from accelcal.arguments.kinds import shown
from accelcal.errors import TableError
from accelcal.io.columns import CONSTANTS
from accelcal.io.files.csv_text import in_quotes
from accelcal.io.files.text import SourceText
from accelcal.io.layout.header_lines import Declared
from accelcal.io.layout.parts import Layout
from accelcal.io.words.headings import read_heading
from accelcal.io.words.vocabulary import COLUMNS, KEYS, with_hyphen
from accelcal.plural import are

_NUMBER = r"([+\-\u2212\u2013]?\d+(?:[.,]\d+)?)"
_TEMPERATURE = re.compile(rf"(?:^|[\s_=(]){_NUMBER}[\s_]*(?:°[\s_]?C|℃|deg[\s_]?C)(?!\w)", re.I)
_RUN = re.compile(rf"(?:{'|'.join(COLUMNS['run'])})[\s_.-]*\d", re.I)
_COPY = re.compile(r"\s*\(\d+\)$")
_RANGE = re.compile(r"(?:-|\u2013|\bto|\bbis|\.)[\s_]*$", re.I)

Found = TypeVar("Found")


class Sheet(NamedTuple):
    """Text of a table, or of a sheet that has one, and its rows."""

    text: SourceText
    layout: Layout  # what `layout_of` makes of it, or some of its rows


def with_name_of_sheet(layout: Layout, sheet: str) -> Layout:
    """Take the temperature or the serial from the name of a sheet whose rows do not tell it.

    The name tells one temperature with its unit, or a serial as a heading of outputs does, such as
    ``SN A-7``. It is empty for what is no sheet.

    Examples
    --------
    >>> [_temperature(name) for name in ("60 °C", "T=-40,5 degC again", "20 - 60 °C", "60", "2 C")]
    ['60', '-40.5', None, None, None]
    """
    known = {heading.role for heading in layout.headings}.union(layout.declared)
    heading = read_heading(sheet)
    serial = str(heading.of) if heading.role == "serials" else None
    for key, value, unit in (("temperature", _temperature(sheet), " degC"), ("serial", serial, "")):
        if value is not None and known.isdisjoint([key, f"{key}s"]):
            here = Declared(value, layout.headings_line, layout.source)
            note = f"{key} {value}{unit} is told by the name of the sheet {shown(sheet)}"
            layout = layout._replace(declared={**layout.declared, key: here}).noting(note)
    return layout


def _temperature(sheet: str) -> str | None:
    """Number of degC in the name of a sheet, if it tells one and no range."""
    found = list(_TEMPERATURE.finditer(sheet))
    if len(found) != 1 or _RANGE.search(sheet[: found[0].start(1)]):
        return None
    return with_hyphen(found[0][1].replace(",", "."))


def may_be_units(first: str, second: str) -> bool:
    """Tell whether the names of two sheets may be serials: words with digits that differ.

    The number of a run, or of a copy as Excel writes it, is none.

    Examples
    --------
    >>> [may_be_units("60 up", own) for own in ("60 down", "60 up (2)", "A-7", "cooling")]
    [False, False, True, False]
    >>> may_be_units("Run 1", "Run 2"), may_be_units("A-7", "A-8")
    (False, True)
    """
    one, other = _numbered(first), _numbered(second)
    return bool(one and other and one != other)


def _numbered(sheet: str) -> set[str]:
    """Words of the name of a sheet that have digits."""
    if _RUN.match(sheet):
        return set()
    words = _COPY.sub("", sheet).split()
    return {word for word in words if any(map(str.isdecimal, word))}


def require_same_columns(sheets: Sequence[Layout]) -> None:
    """Refuse sheets whose headings differ."""
    first, *others = sheets
    for sheet in others:
        if (sheet.headings, sheet.separator) != (first.headings, first.separator):
            problem = f"its columns are not those of {first.source}"
            remedy = "name one of the sheets, as here, or give all the same columns in one order"
            raise TableError(problem, remedy, source=sheet.source, line=sheet.headings_line)


def one_table(sheets: Sequence[Layout], source: str) -> Layout:
    """Put the rows of sheets below each other.

    The first columns hold what header lines tell of the rows of their sheet alone; those of the
    test count for all sheets, wherever they stand. Lines are those of the sheets. Raises TableError
    if header lines of the test differ.
    """
    first = sheets[0]
    of_rows = _of_rows(sheets)
    return first._replace(
        source=source,
        declared=_of_the_test(sheets, of_rows),
        headings=(*map(read_heading, of_rows), *first.headings),
        rows=[row for sheet in sheets for row in _rows(sheet, of_rows)],
        lines=[line for sheet in sheets for line in sheet.lines],
        notes=tuple(dict.fromkeys(note for sheet in sheets for note in sheet.notes)),
    )


def _of_rows(sheets: Sequence[Layout]) -> list[str]:
    """Keys of the header lines that hold for the rows of their sheet."""
    roles = {heading.role for heading in sheets[0].headings}
    keys = []
    for key in (*CONSTANTS, "serial", "date"):
        values = {sheet.declared[key].value for sheet in sheets if key in sheet.declared}
        if values and key not in roles and (key in CONSTANTS or len(values) > 1):
            keys.append(key)
    return keys


def _rows(sheet: Layout, keys: Sequence[str]) -> Iterator[str]:
    mark = sheet.separator or " "
    values = [sheet.declared[key].value if key in sheet.declared else "" for key in keys]
    before = "".join(in_quotes(value) + mark for value in values)
    return (before + row for row in sheet.rows)


def _of_the_test(sheets: Sequence[Layout], of_rows: Sequence[str]) -> dict[str, Declared]:
    """The other header lines; words without a meaning may differ."""
    told: dict[str, Declared] = {}
    for sheet in sheets:
        for key, new in sheet.declared.items():
            old = told.setdefault(key, new)
            if key in of_rows or old.value == new.value:
                continue
            if key in KEYS and key not in CONSTANTS:
                problem = f"{key} is {shown(new.value)}, but {shown(old.value)} in {old.source}"
                raise new.refuse(problem, "declare it alike in all sheets")
            told[key] = old._replace(value=f"{old.value}; {new.value}")
    return {key: value for key, value in told.items() if key not in of_rows}


# -- facts of sheets beside them -------------------------------------------------------------------


def without_faulty_facts(
    sheets: Sequence[Sheet], read: Callable[[Sequence[Sheet]], Found]
) -> Found:
    """Read sheets, without what a sheet beside them tells that cannot be used; a note says so.

    Raises TableError if they cannot be read without such facts either.
    """
    try:
        return _without_wrong(sheets, read)
    except TableError as error:
        facts = _facts(sheets)
        if not facts or _fault(_without(sheets, [*facts], error), read) == str(error):
            raise  # of the table itself
        for some in [*([key] for key in facts), [*facts]]:
            with suppress(TableError):
                return _without_wrong(_without(sheets, some, error), read)
        raise


def _fault(sheets: Sequence[Sheet], read: Callable[[Sequence[Sheet]], object]) -> str:
    try:
        read(sheets)
    except TableError as error:
        return str(error)
    return ""


def _without_wrong(sheets: Sequence[Sheet], read: Callable[[Sequence[Sheet]], Found]) -> Found:
    """Read sheets without the facts whose own place an error names."""
    try:
        return read(sheets)
    except TableError as error:
        place = error.source, error.line
        wrong = [key for key, own in _facts(sheets).items() if own == place]
        if not wrong:
            raise
        return _without_wrong(_without(sheets, wrong, error), read)


def _facts(sheets: Sequence[Sheet]) -> dict[str, tuple[str, int]]:
    """Where the sheets beside some tables tell what a table is read by."""
    beside = {own.name for text, _ in sheets for own in text.beside}
    return {
        key: (own.source, own.line)
        for _, layout in sheets
        for key, own in layout.declared.items()
        if key in KEYS and own.source in beside
    }


def _without(sheets: Sequence[Sheet], keys: Sequence[str], error: TableError) -> list[Sheet]:
    told = {own.name: shown(own.sheet) for text, _ in sheets for own in text.beside}
    names = ", ".join(dict.fromkeys(told[_facts(sheets)[key][0]] for key in keys))
    unused = f"{', '.join(keys)} of the sheet {names} {are(keys)} not used"
    note = f"{unused}: {error.problem}; {error.remedy}"
    return [
        Sheet(
            text._replace(notes=(*text.notes, note)),
            layout._replace(
                declared={key: own for key, own in layout.declared.items() if key not in keys}
            ),
        )
        for text, layout in sheets
    ]
