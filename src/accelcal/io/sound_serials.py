"""A table of many accelerometers of which some are faulty: the others, as if those were not there.

A serial whose rows cannot be read alone is faulty. What is left without such serials is read as one
table; where that fails too, or nothing is left, the fault is one of the table. The rows of a serial
may be in several sheets of a workbook.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from typing import NamedTuple

from accelcal.errors import TableError
from accelcal.io.declarations import Overrides
from accelcal.io.files.text import Source, SourceText, read_texts
from accelcal.io.layout.parts import Layout
from accelcal.io.layout.separators import split_line
from accelcal.io.sheets import Sheet, Sheets
from accelcal.io.tables import layout_of, read_tables, sheets_of, survey_sheets
from accelcal.io.values.cells import written_otherwise
from accelcal.plural import lines_named, were
from accelcal.record import TumbleRecord


class SoundSerials(NamedTuple):
    """Accelerometers of a table."""

    records: tuple[TumbleRecord, ...]  # those that can be read, in the order of the file
    # what is wrong with the others, an error each, in this order
    faults: tuple[TableError, ...] = ()


def read_sound(source: Source, overrides: Overrides) -> SoundSerials:
    r"""Read the accelerometers of a table that its faults do not concern.

    All of them where `read_tables` reads them. Else those that it reads once the rows of the faulty
    ones are deleted; the first fault is told as it tells it. A file object can be read again.
    Raises TableError if the whole table is unusable.

    Examples
    --------
    >>> import io
    >>> rows = "A,20,1,1,1.30\nA,20,5,1,-1.29\nB,20,1,1,OL\nB,20,5,1,-1.28\n"
    >>> table = io.StringIO("serial,temperature,position,stroke,output\n" + rows)
    >>> records, faults = read_sound(table, {})
    >>> records, faults[0].line
    ((<TumbleRecord serial 'A': 2 readings, 1 run, 2 positions>,), 4)
    """
    try:
        return SoundSerials(read_tables(source, overrides=overrides))
    except TableError as error:
        if overrides.get("serial") is not None:
            raise
        if not isinstance(source, str) and hasattr(source, "seek"):
            source.seek(0)
        sheets = sheets_of(read_texts(source))
        found = _without_faulty(sheets, overrides, error)
        if not found.records:
            raise
        return found


def sound_serials(text: SourceText, overrides: Overrides) -> SoundSerials:
    """Read the accelerometers of a part of a text, see `read_sound`.

    Where there is none, the fault is that of the whole.
    """
    sheets = [Sheet(text, layout_of(text))]
    try:
        return SoundSerials(survey_sheets(sheets, overrides)[1])
    except TableError as error:
        return _without_faulty(sheets, overrides, error)


def _without_faulty(sheets: Sheets, overrides: Overrides, error: TableError) -> SoundSerials:
    rows = _rows_of_serials(sheets)
    told = {name: _fault(_some(sheets, own), overrides, name) for name, own in rows.items()}
    sound = [rows[name] for name, fault in told.items() if fault is None]
    if not sound or len(sound) == len(rows):
        return SoundSerials((), (error,))
    try:
        left = _some(sheets, sorted(chain.from_iterable(sound)))
        records = survey_sheets(left, overrides)[1]
    except TableError:
        return SoundSerials((), (error,))
    place = (error.source, error.line)
    first = {name for name, own in rows.items() if name and place in _places(sheets, own)}
    faults = (error if name in first else fault for name, fault in told.items() if fault)
    return SoundSerials(_noting(records, sheets, rows.get("", ())), tuple(faults))


def _noting(
    records: Sequence[TumbleRecord], sheets: Sheets, unnamed: Sequence[Row]
) -> tuple[TumbleRecord, ...]:
    """Say in every record that rows were left out that may be its own."""
    if not unnamed:
        return tuple(records)
    lines = [line for _, line in _places(sheets, unnamed)]
    note = f"{were(lines, 'row')} left out ({lines_named(lines)}) whose serial is empty"
    return tuple(replace(own, notes=(*own.notes, note)) for own in records)


def _fault(sheets: Sheets, overrides: Overrides, serial: str) -> TableError | None:
    """Why a serial cannot be read alone, if it cannot."""
    if not serial:
        lines = [line for sheet in sheets for line in sheet.layout.lines]
        more = f" in {len(lines)} rows ({lines_named(lines)})" if len(lines) > 1 else ""
        problem, remedy = f"serial is empty{more}", "write the serial in every row"
        return TableError(problem, remedy, source=sheets[0].layout.source, line=lines[0])
    try:
        survey_sheets(sheets, overrides)
    except TableError as error:
        return error
    return None


Row = tuple[int, int]
"""Places of a sheet, and of a row in it."""


def _some(sheets: Sheets, rows: Sequence[Row]) -> list[Sheet]:
    """The sheets that have some rows, with these alone."""
    kept = [(sheet, [row for at, row in rows if at == place]) for place, sheet in enumerate(sheets)]
    return [Sheet(sheet.text, sheet.layout.some(own)) for sheet, own in kept if own]


def _places(sheets: Sheets, rows: Sequence[Row]) -> list[tuple[str, int]]:
    """Source and line of each row."""
    layouts = [sheet.layout for sheet in sheets]
    return [(layouts[at].source, layouts[at].lines[row]) for at, row in rows]


def _rows_of_serials(sheets: Sheets) -> dict[str, list[Row]]:
    """Places of the rows of each serial; nothing where it is not sure whose a row is.

    Rows without a serial are some of their own, where each serial has more. A row that has not as
    many cells as most have tells its serial in the first column alone, and only one that whole rows
    have too: separators are wrong in it.
    """
    rows: dict[str, list[Row]] = {}
    odd: set[Row] = set()
    for at, sheet in enumerate(sheets):
        own, others = _serials_of_rows(sheet.layout)
        if own is None:
            return {}
        odd |= {(at, place) for place in others}
        for place, serial in enumerate(own):
            rows.setdefault(serial, []).append((at, place))
    alone = any(odd.issuperset(own) for own in rows.values())
    fewest = min((len(own) for name, own in rows.items() if name), default=0)
    unnamed = len(rows.get("", ())) >= fewest
    return {} if unnamed or alone or written_otherwise(rows) else rows


def _serials_of_rows(layout: Layout) -> tuple[Sequence[str] | None, Sequence[int]]:
    """Serial of each row of a sheet, None where it is not sure; and rows of an odd length."""
    roles = [heading.role for heading in layout.headings]
    if "serial" not in roles:
        declared = layout.declared.get("serial")
        return (declared and [declared.value] * len(layout.rows)), ()
    column = roles.index("serial")
    table = [split_line(row, layout.separator) for row in layout.rows]
    usual = Counter(map(len, table)).most_common(1)[0][0]
    odd = [place for place, cells in enumerate(table) if len(cells) != usual]
    serials = ["".join(cells[column : column + 1]) for cells in table]
    return (None if odd and column > 0 else serials), odd
