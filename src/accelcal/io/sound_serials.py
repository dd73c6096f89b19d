"""A table of many accelerometers of which some are faulty: the others, as if those were not there.

A serial whose rows cannot be read alone is faulty. What is left without such serials is read as one
table; where that fails too, or nothing is left, the fault is one of the table. So each sheet of a
workbook is read, if no serial is in two of them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import chain
from typing import NamedTuple

from accelcal.errors import TableError
from accelcal.io.files.text import Source, SourceText, read_texts
from accelcal.io.layout.parts import Layout, split_line
from accelcal.io.tables import layout_of, read_tables, survey_text
from accelcal.io.values.cells import written_otherwise
from accelcal.record import TumbleRecord


class SoundSerials(NamedTuple):
    """Accelerometers of a table.

    Attributes
    ----------
    records : tuple of TumbleRecord
        Those that can be read, in the order of the file.
    faults : tuple of TableError
        What is wrong with the others, an error each, in this order.
    """

    records: tuple[TumbleRecord, ...]
    faults: tuple[TableError, ...] = ()


def read_sound(source: Source, overrides: Mapping[str, object]) -> SoundSerials:
    r"""Read the accelerometers of a table that its faults do not concern.

    Parameters
    ----------
    source : path or file object
        A table; a file object can be read again.
    overrides : mapping of str to object
        Declarations that win over the header, as of `read_tables`.

    Returns
    -------
    SoundSerials
        All of them where `read_tables` reads them. Else those that it reads once the rows of the
        faulty ones are deleted; the first fault is told as it tells it.

    Raises
    ------
    TableError
        If the whole table is unusable.

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
        if not isinstance(source, str) and hasattr(source, "seek"):
            source.seek(0)
        texts = read_texts(source)
        if overrides.get("serial") is not None:
            raise
        layouts = [layout_of(text) for text in texts]
        if len(texts) == 1:
            found = [_without_faulty(texts[0], layouts[0], overrides, error)]
        else:
            found = [sound_serials(*sheet, overrides) for sheet in _apart(texts, layouts)]
        records = tuple(record for own in found for record in own.records)
        if not records:
            raise
        return SoundSerials(records, tuple(fault for own in found for fault in own.faults))


def _apart(
    texts: Sequence[SourceText], sheets: Sequence[Layout]
) -> Sequence[tuple[SourceText, Layout]]:
    """Sheets of a workbook with the same columns and serials of its own in each, or none."""
    serials = [[*_rows_of_serials(sheet)] or _declared_serial(sheet) for sheet in sheets]
    every = [*chain.from_iterable(serials)]
    same = len({(sheet.headings, sheet.separator) for sheet in sheets}) == 1
    are_apart = same and all(serials) and len(set(every)) == len(every)
    return list(zip(texts, sheets, strict=True)) if are_apart else []


def _declared_serial(layout: Layout) -> list[str]:
    return [layout.declared["serial"].value] if "serial" in layout.declared else []


def sound_serials(
    text: SourceText, layout: Layout, overrides: Mapping[str, object]
) -> SoundSerials:
    """Read the accelerometers of one text or of a part of it, see `read_sound`.

    Parameters
    ----------
    text : SourceText
        The text.
    layout : Layout
        Its rows.
    overrides : mapping of str to object
        As of `read_sound`.

    Returns
    -------
    SoundSerials
        Those that can be read; the fault of the whole where there is none.
    """
    try:
        return SoundSerials(survey_text(text, overrides, layout)[1])
    except TableError as error:
        return _without_faulty(text, layout, overrides, error)


def _without_faulty(
    text: SourceText, layout: Layout, overrides: Mapping[str, object], error: TableError
) -> SoundSerials:
    rows = _rows_of_serials(layout)
    told = {name: _fault(text, overrides, name, _some(layout, own)) for name, own in rows.items()}
    sound = [rows[name] for name, fault in told.items() if fault is None]
    if not sound or len(sound) == len(rows):
        return SoundSerials((), (error,))
    try:
        left = _some(layout, sorted(chain.from_iterable(sound)))
        records = survey_text(text, overrides, left)[1]
    except TableError:
        return SoundSerials((), (error,))
    first = {name for name, own in rows.items() if error.line in {layout.lines[i] for i in own}}
    faults = (error if name in first else fault for name, fault in told.items() if fault)
    return SoundSerials(records, tuple(faults))


def _fault(
    text: SourceText, overrides: Mapping[str, object], serial: str, layout: Layout
) -> TableError | None:
    """Why a serial cannot be read alone, if it cannot."""
    if not serial:
        problem, remedy = "serial is empty", "write the serial in every row"
        return TableError(problem, remedy, source=layout.source, line=layout.lines[0])
    try:
        survey_text(text, overrides, layout)
    except TableError as error:
        return error
    return None


def _some(layout: Layout, rows: Sequence[int]) -> Layout:
    """A table of some rows alone."""
    lines = [layout.lines[i] for i in rows]
    return layout._replace(rows=[layout.rows[i] for i in rows], lines=lines)


def _rows_of_serials(layout: Layout) -> dict[str, list[int]]:
    """Places of the rows of each serial; nothing where it is not sure whose a row is.

    Rows without a serial are some of their own, where each serial has more. A row that has not as
    many cells as most have tells its serial in the first column alone, and only one that whole rows
    have too: separators are wrong in it.
    """
    roles = [heading.role for heading in layout.headings]
    if "serial" not in roles:
        return {}
    column = roles.index("serial")
    table = [split_line(row, layout.separator) for row in layout.rows]
    usual = Counter(map(len, table)).most_common(1)[0][0]
    odd = {place for place, cells in enumerate(table) if len(cells) != usual}
    rows: dict[str, list[int]] = {}
    for place, cells in enumerate(table):
        rows.setdefault("".join(cells[column : column + 1]), []).append(place)
    alone = any(odd.issuperset(own) for own in rows.values())
    fewest = min((len(own) for name, own in rows.items() if name), default=0)
    unnamed = len(rows.get("", ())) >= fewest
    unsure = unnamed or alone or (odd and column > 0) or written_otherwise(rows)
    return {} if unsure else rows
