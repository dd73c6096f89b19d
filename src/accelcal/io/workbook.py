"""Workbooks in: the cells of their sheets as text, for the one reader of tables."""

from __future__ import annotations

import re
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from datetime import date, datetime, timedelta
from io import BytesIO
from typing import TYPE_CHECKING, Any

from accelcal.arguments.kinds import shown
from accelcal.errors import TableError, not_installed
from accelcal.io.files.csv_text import cell_text, in_quotes
from accelcal.io.files.text import SourceText, file_and_sheet, named_bytes
from accelcal.io.layout.heading_rows import OF_READINGS
from accelcal.io.layout.parts import read_layout
from accelcal.plural import lines_named

if TYPE_CHECKING:
    from python_calamine import CalamineWorkbook

_MOST_CELLS = 30_000_000
"""Cells of a sheet, with the empty ones, for which there is memory."""

_MOST_COLUMNS = 16_384
"""Columns of an Excel sheet."""

_COLUMN_BEHIND_Z = re.compile(rb"""\br=["']([A-Z]{2,3})\d+["'][^>]*(?<!/)>""")
"""Beginning of a cell with a value; up to column Z a sheet of all rows is not too large."""


def read_sheets(data: bytes, name: str) -> tuple[SourceText, ...]:
    """Read the sheets of a workbook that have tables.

    The text of a sheet has a line for each row of it and tabs between the cells. Where there are
    several tables each has the name of its sheet, and where there are other sheets a note. The name
    of the file has that of a sheet behind ``#`` where one is meant. Raises InputError if
    python-calamine is not installed. Raises TableError if this is no workbook, has no such sheet,
    or no sheet of several has a table.
    """
    try:
        from python_calamine import CalamineError, CalamineWorkbook, PasswordError
    except ImportError:
        raise not_installed(f"{name}: a workbook", "python-calamine", "excel") from None
    _refuse_far_cells(data, name)
    try:
        return _tables(CalamineWorkbook.from_filelike(named_bytes(data, name)), name)
    except PasswordError:
        remedy = "save it without one"
        raise TableError("the workbook has a password", remedy, source=name) from None
    except CalamineError as error:
        problem = f"no workbook that can be read ({error})"
        remedy = "save it again, export the table as CSV text, or unpack an archive of files"
        raise TableError(problem, remedy, source=name) from None


def _refuse_far_cells(data: bytes, name: str) -> None:
    """Refuse an Excel sheet whose cells span more than memory holds: calamine would abort."""
    for sheet in _sheets_of_excel(data):
        rows = _last_row(sheet)
        if rows <= _MOST_CELLS // _MOST_COLUMNS:
            continue
        columns = max(map(_column, set(_COLUMN_BEHIND_Z.findall(sheet))), default=0)
        if rows * columns > _MOST_CELLS:
            problem = f"a sheet of {rows} rows and {columns} columns is too large"
            remedy = "delete the cells far from the table, and save it again"
            raise TableError(problem, remedy, source=name)


def _sheets_of_excel(data: bytes) -> Iterator[bytes]:
    try:
        with zipfile.ZipFile(BytesIO(data)) as archive:
            for part in archive.namelist():
                if re.fullmatch(r"xl/worksheets/[^/]+\.xml", part):
                    yield archive.read(part)
    except (zipfile.BadZipFile, zlib.error, OSError, RuntimeError):
        return  # calamine says what is wrong with it


def _last_row(sheet: bytes) -> int:
    """Row of the last cell with a value; cells stand in the order of their rows."""
    start = sheet.rfind(b' r="', 0, max(sheet.rfind(b"</c>"), 0))
    cell = re.match(rb' r="[A-Z]+(\d+)', sheet[max(start, 0) : start + 20])
    return int(cell[1]) if cell else 0


def _column(letters: bytes) -> int:
    number = 0
    for letter in letters:
        number = 26 * number + letter - 64
    return number


def _tables(book: CalamineWorkbook, name: str) -> tuple[SourceText, ...]:
    file, wanted = file_and_sheet(name)
    if wanted is not None:
        if wanted not in book.sheet_names:
            remedy = f"name one of {_quoted(book.sheet_names)}"
            raise TableError(f"no sheet {shown(wanted)}", remedy, source=file)
        return (_sheet(book, wanted, name),)
    sheets = {sheet: _sheet(book, sheet, name) for sheet in _visible(book)}
    filled = {sheet: read for sheet, read in sheets.items() if read.text.strip()}
    if len(filled) < 2:
        return (*filled.values(),) or (SourceText(name, "", "workbook"),)
    return tuple(_with_headings(filled, name))


def _visible(book: CalamineWorkbook) -> Iterator[str]:
    """Sheets of cells that are not hidden."""
    from python_calamine import SheetTypeEnum, SheetVisibleEnum

    for sheet in book.sheets_metadata:
        if (sheet.typ, sheet.visible) == (SheetTypeEnum.WorkSheet, SheetVisibleEnum.Visible):
            yield sheet.name


def _with_headings(sheets: dict[str, SourceText], name: str) -> Iterator[SourceText]:
    """The sheets with the headings of a table; of readings, where one of them has such."""
    found = {sheet: roles for sheet, read in sheets.items() if (roles := _roles(read))}
    of_readings = [sheet for sheet, roles in found.items() if roles & OF_READINGS]
    tables = of_readings or [*found]
    others = _quoted([sheet for sheet in sheets if sheet not in tables])
    if not tables:
        remedy = f"name one, as {name}#{next(iter(sheets))}"
        raise TableError(f"no table in the sheets {others}", remedy, source=name)
    beside = tuple(
        read._replace(name=f"{name}#{sheet}")
        for sheet, read in sheets.items()
        if sheet not in tables and "output" not in found.get(sheet, ())
    )
    for sheet in tables:
        is_alone = len(tables) == 1
        place = name if is_alone else f"{name}#{sheet}"
        read = f"sheet {shown(sheet)} is read; " if is_alone else ""
        note = f"{read}there is no table in {others}"
        notes = (*([note] if others else []), *sheets[sheet].notes)
        yield sheets[sheet]._replace(name=place, notes=notes, beside=beside)


def _roles(sheet: SourceText) -> set[str | None]:
    """What the columns of a sheet hold; nothing where it has no headings."""
    try:
        return {heading.role for heading in read_layout(sheet).headings}
    except TableError:
        return set()


def _quoted(sheets: Sequence[str]) -> str:
    return ", ".join(map(shown, sheets))


# -- cells -----------------------------------------------------------------------------------------


def _sheet(book: CalamineWorkbook, sheet: str, name: str) -> SourceText:
    """Text of a sheet, each row in the line of its number."""
    read = book.get_sheet_by_name(sheet)
    rows = read.to_python(skip_empty_area=False)
    merged = []
    for (top, left), (bottom, right) in read.merged_cell_ranges or ():
        if left == right:  # a value for several rows, as of a temperature beside its readings
            merged.append(top + 1)
            for row in rows[top + 1 : bottom + 1]:
                row[left] = rows[top][left]
    first = 0 if read.start is None else read.start[1]
    text = "".join("\t".join(map(_cell, row[first:])) + "\n" for row in rows)
    lines = lines_named(sorted(merged))
    note = f"cells merged over several rows count in each of them, from {lines} on"
    return SourceText(name, text, "workbook", notes=(note,) if merged else (), sheet=sheet)


def _cell(value: Any) -> str:
    """A cell as text, of which a tab or the end of a line would be another cell."""
    if isinstance(value, timedelta):
        hours, rest = divmod(value, timedelta(hours=1))
        return f"{hours}:{str(rest)[2:]}"  # as it is shown, which no column of numbers takes
    if isinstance(value, datetime | date):
        return str(value)
    text = cell_text(value)
    return in_quotes(text) if text.startswith('"') else text
