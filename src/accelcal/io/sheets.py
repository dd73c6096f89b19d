"""Sheets of a workbook, or blocks below each other in a text, as parts of one table."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from itertools import pairwise
from typing import NamedTuple, TypeVar

from accelcal.arguments.kinds import shown
from accelcal.errors import TableError
from accelcal.io.columns import CONSTANTS
from accelcal.io.files.csv_text import in_quotes
from accelcal.io.files.text import SourceText
from accelcal.io.layout.found_headings import headings_of
from accelcal.io.layout.header_lines import Declared, keys_and_values
from accelcal.io.layout.parts import Layout
from accelcal.io.layout.rearranged import is_called_summary
from accelcal.io.layout.rows_above import said_in_row
from accelcal.io.layout.separators import split_line
from accelcal.io.words.headings import read_heading
from accelcal.io.words.vocabulary import ACROSS, COLUMNS, KEYS, begins_number, with_hyphen
from accelcal.plural import are

_APART = frozenset({"serial", "temperature", "run", "stroke", "mounting", "clamping"})
"""What may be declared of a block alone."""

_START = 1 << 16
"""Characters in which the first headings stand."""

_BLANK = " \t,;|"
_BEGINS_READING = "0123456789+-.#"
"""How lines of readings and header lines begin, or none, but not headings."""


def blocks_of(source: SourceText) -> tuple[SourceText, ...]:
    r"""Take a text apart where its headings stand again below what is declared of their rows.

    Each block stands in its own lines, and is read like a sheet. A temperature or serial alone
    above its headings becomes a header line. What else the lines above the first block declare
    holds for those that do not declare it. The text stays as it is where nothing is declared of a
    later block, or only such a one has a serial.

    Examples
    --------
    >>> text = "20 °C\nJ,Y1,Y2\n1,1.3,1.3\n\n60 °C\nJ,Y1,Y2\n1,1.4,1.4\n"
    >>> blocks_of(SourceText("", text, ""))[1].text
    '\n\n\n\n# temperature: 60\nJ,Y1,Y2\n1,1.4,1.4\n'
    """
    lines = source.text.split("\n")
    words = [line for line in lines if line[:1] not in _BEGINS_READING]
    if len({*words}) == len(words):  # as of nearly all tables, whose headings need not be found
        return (source,)
    found = headings_of(source.text[:_START].split("\n"))
    if found is None:
        return (source,)
    headings = lines[found.lines[-1] - 1].rstrip(_BLANK)
    places = [place for place, line in enumerate(lines) if line.rstrip(_BLANK) == headings]
    if len(places) < 2:
        return (source,)
    spans = pairwise([-1, *places])
    starts, told = zip(*(_above(lines, *span, found.separator) for span in spans), strict=True)
    first, others = told[0], told[1:]
    if not all(own & _APART and "serial" not in own - first for own in others):
        return (source,)
    ends = (*starts[1:], len(lines))
    of_all = [(line, _keys(line, found.separator)) for line in lines[: places[0]]]
    return source._replace(text="\n".join(lines[: ends[0]])), *(
        source._replace(text="\n".join([*_shared(of_all, own, start), *lines[start:end]]))
        for own, start, end in zip(others, starts[1:], ends[1:], strict=True)
    )


def _shared(of_all: list[tuple[str, set[str]]], own: set[str], size: int) -> Iterator[str]:
    """Lines above a block: those of the first that hold for it too, else empty ones."""
    for line, keys in of_all:
        yield line if keys and keys <= KEYS.keys() - _APART - own else ""
    yield from [""] * (size - len(of_all))


def _above(
    lines: list[str], others: int, headings: int, separator: str | None
) -> tuple[int, set[str]]:
    """First line of what stands between others or readings and headings, and what it declares.

    A temperature or serial alone is written as a header line.
    """
    start, keys = headings, set[str]()
    while start > others + 1 and not _is_reading(lines[start - 1], separator):
        start -= 1
        alone = read_heading(lines[start].strip(_BLANK))
        if alone.role in ("temperatures", "serials") and not alone.unit:
            of = alone.of if isinstance(alone.of, str) else f"{alone.of:g}"
            lines[start] = f"# {ACROSS[alone.role]}: {of}"
        keys |= _keys(lines[start], separator)
    return start, keys


def _keys(line: str, separator: str | None) -> set[str]:
    """What a line declares."""
    return {own[0] for own in keys_and_values(line) or said_in_row(line, separator)}


def _is_reading(line: str, separator: str | None) -> bool:
    """Tell whether a row may be one of readings or of their summary: most cells are numbers."""
    cells = list(filter(None, split_line(line, separator)))
    return is_called_summary(line) or 2 * sum(map(begins_number, cells)) > max(len(cells), 2)


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


Sheets = Sequence[Sheet]


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


def without_faulty_facts(sheets: Sheets, read: Callable[[Sheets], Found]) -> Found:
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


def _fault(sheets: Sheets, read: Callable[[Sheets], object]) -> str:
    try:
        read(sheets)
    except TableError as error:
        return str(error)
    return ""


def _without_wrong(sheets: Sheets, read: Callable[[Sheets], Found]) -> Found:
    """Read sheets without the facts whose own place an error names."""
    try:
        return read(sheets)
    except TableError as error:
        place = error.source, error.line
        wrong = [key for key, own in _facts(sheets).items() if own == place]
        if not wrong:
            raise
        return _without_wrong(_without(sheets, wrong, error), read)


def _facts(sheets: Sheets) -> dict[str, tuple[str, int]]:
    """Where the sheets beside some tables tell what a table is read by."""
    beside = {own.name for text, _ in sheets for own in text.beside}
    told = [pair for _, layout in sheets for pair in layout.declared.items() if pair[0] in KEYS]
    return {key: (own.source, own.line) for key, own in told if own.source in beside}


def _without(sheets: Sheets, keys: Sequence[str], error: TableError) -> list[Sheet]:
    told = {own.name: shown(own.sheet) for text, _ in sheets for own in text.beside}
    names = ", ".join(dict.fromkeys(told[_facts(sheets)[key][0]] for key in keys))
    unused = f"{', '.join(keys)} of the sheet {names} {are(keys)} not used"
    note = f"{unused}: {error.problem}; {error.remedy}"
    return [
        Sheet(
            text._replace(notes=(*text.notes, note)),
            layout._replace(declared={k: v for k, v in layout.declared.items() if k not in keys}),
        )
        for text, layout in sheets
    ]
