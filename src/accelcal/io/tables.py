"""Reading of tables: one record for each accelerometer in a file.

A table is read in steps, each in a module of its own: bytes to text (`text`), header lines,
headings and rows (`layout`), columns (`columns`, `engines`), cells (`cells`), readings
(`readings`), declarations (`declarations`), records (`records`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

from accelcal.arguments.kinds import shown
from accelcal.errors import InputError, TableError
from accelcal.io.columns import CONSTANTS, Table, choose_columns
from accelcal.io.declarations import Overrides, declarations, declared_by_caller
from accelcal.io.engines import Engine, by_an_engine
from accelcal.io.files.text import Source, SourceText, Texts, read_texts
from accelcal.io.layout.facts_beside import notes_of_facts
from accelcal.io.layout.output_columns import (
    factor_of_std,
    unit_of_outputs,
    units_of_columns,
    units_written,
    with_channels,
    with_lone_conditions,
    with_lone_output,
)
from accelcal.io.layout.parts import Layout, read_layout
from accelcal.io.layout.rearranged import rearranged
from accelcal.io.of_serial import records_called
from accelcal.io.readings import notes_of_readings, read_readings, refuse_swapped
from accelcal.io.records import records_of
from accelcal.io.sheets import (
    Sheet,
    Sheets,
    blocks_of,
    may_be_units,
    one_table,
    require_same_columns,
    with_name_of_sheet,
    without_faulty_facts,
)
from accelcal.io.values.cells import Column
from accelcal.io.values.markers import notes_of_scale
from accelcal.io.values.thousands import notes_of_thousands
from accelcal.logs import tell
from accelcal.record import TumbleRecord

__all__ = ["TableForm", "read_table", "read_tables", "survey"]

ONE_AT_A_TIME = "read them by read_tables, or give one accelerometer at a time"


class TableForm(NamedTuple):
    """How a table was written.

    Attributes
    ----------
    form : str
        ``"long"`` or ``"wide"``.
    separator : str
        Separator of the columns, ``" "`` for runs of blanks.
    decimal : str
        Decimal mark.
    encoding : str
        Encoding of the text.
    compressed : bool
        Whether it came out of gzip.
    columns : mapping of str to str
        What a column holds -> its heading.
    set_aside : tuple of str
        Headings of the columns that are not used.
    """

    form: str
    separator: str
    decimal: str
    encoding: str
    compressed: bool
    columns: Mapping[str, str]
    set_aside: tuple[str, ...]


Survey = tuple[TableForm, tuple[TumbleRecord, ...]]


def read_tables(
    source: Source | Texts, *, overrides: Mapping[str, object] | None = None
) -> tuple[TumbleRecord, ...]:
    r"""Read all accelerometers of a table.

    Parameters
    ----------
    source : path, "-", file object or texts
        A table in one of the forms of the guide; ``"-"`` reads standard input.
    overrides : mapping of str to object, optional
        Declarations that win over the header: fields of `Apparatus`, `reference_temperature`,
        `positions`, `unit`, `date`, a mapping `metadata`, `serials`, the headings of the columns of
        several accelerometers with commas between, or `serial`, which chooses one where the table
        tells several. A quantity may be a text as ``"2 arcsec"``.

    Returns
    -------
    tuple of TumbleRecord
        One record a serial number, in the order of the file.

    Raises
    ------
    TableError
        If the table is unusable; the message names the line and the remedy.
    InputError
        If `overrides` are no declarations of it.

    Examples
    --------
    >>> import io
    >>> import accelcal
    >>> text = "# temperature: 20\nposition,Y1,Y2\n1,1.30,1.31\n5,-1.29,-1.28\n"
    >>> accelcal.read_tables(io.StringIO(text))
    (<TumbleRecord '<table>': 4 readings, 1 run, 2 positions>,)
    """
    records = survey(source, overrides=overrides)[1]
    for record in records:
        tell("read %r, serial %r: %d readings", record.source, record.serial, len(record))
    return records


def read_table(source: Source, *, overrides: Mapping[str, object] | None = None) -> TumbleRecord:
    r"""Read a table of one accelerometer.

    Parameters
    ----------
    source, overrides
        As for `read_tables`.

    Returns
    -------
    TumbleRecord
        Its readings.

    Raises
    ------
    TableError
        If the table is unusable or holds several accelerometers.
    InputError
        If `overrides` are no declarations of it.

    Examples
    --------
    >>> import io
    >>> import accelcal
    >>> text = "# temperature: 20\nposition;Y1;Y2\n1;1,30;1,31\n5;-1,29;-1,28\n"
    >>> accelcal.read_table(io.StringIO(text), overrides={"serial": "AL-15-003"})
    <TumbleRecord serial 'AL-15-003': 4 readings, 1 run, 2 positions>
    """
    records = read_tables(source, overrides=overrides)
    if len(records) > 1:
        names = shown(", ".join(str(record.serial) for record in records))
        raise TableError(f"serials {names} in one table", ONE_AT_A_TIME, source=records[0].source)
    return records[0]


def survey(source: Source | Texts, *, overrides: Mapping[str, object] | None = None) -> Survey:
    """Read a table and tell how it was written.

    Parameters
    ----------
    source : path, "-" or file object
        As for `read_tables`.
    overrides : mapping of str to object, optional
        As for `read_tables`.

    Returns
    -------
    form : TableForm
        Separator, decimal mark, encoding and columns.
    records : tuple of TumbleRecord
        As of `read_tables`.

    Raises
    ------
    TableError
        If the table is unusable.
    """
    given = declared_by_caller(overrides)
    return survey_sheets(sheets_of(read_texts(source)), given)


def sheets_of(texts: Texts) -> list[Sheet]:
    """Take the texts of a source apart: its sheets, or blocks with the same headings.

    Raises TableError if one of them has no headings or no rows.
    """
    blocks = blocks_of(texts[0]) if len(texts) == 1 else texts
    return [Sheet(text, layout_of(text)) for text in blocks]


def survey_sheets(sheets: Sheets, overrides: Overrides) -> Survey:
    """Read sheets, as `survey` does: accelerometers, each of its own, or parts of one table.

    One alone may be any table.
    """
    rest: dict[str, Any] = dict(overrides)
    serial = rest.pop("serial", None)
    read = partial(_survey_sheets, overrides=rest, named=serial is not None)
    form, records = without_faulty_facts(sheets, read)
    try:
        return form, tuple(records_called(records, serial))
    except InputError as error:
        raise error.at(records[0].source) from None


def _survey_sheets(sheets: Sheets, overrides: Overrides, *, named: bool) -> Survey:
    found = [_survey(*sheet, overrides) for sheet in sheets]
    if len(sheets) == 1:
        return found[0]
    layouts = [sheet.layout for sheet in sheets]
    require_same_columns(layouts)
    records = tuple(record for _, records in found for record in records)
    if len({record.serial for record in records} - {None}) == len(records):
        return found[0][0], records
    if not named:
        _require_one_unit(sheets, records)
    texts = [sheet.text for sheet in sheets]
    name = texts[0].name.removesuffix(f"#{texts[0].sheet}")
    names = ", ".join(shown(text.sheet) for text in texts if text.sheet)
    parts = f"the sheets {names}" if names else f"the {len(texts)} blocks below each other"
    table = one_table(layouts, name)
    notes = dict.fromkeys(note for text in texts for note in text.notes)
    text = texts[0]._replace(notes=(f"{parts} are read as one table", *notes))
    try:
        return found[0][0], _survey(text, table, overrides)[1]
    except TableError as error:
        problem = f"{parts} are not one table: {error.problem}"
        remedy = "tell them apart by lines '# run: ...' or '# serial: ...'"
        remedy = f"{remedy}, or name one, as {texts[0].name}" if names else remedy
        raise TableError(problem, remedy, source=name) from None


def _require_one_unit(sheets: Sheets, records: Sequence[TumbleRecord]) -> None:
    """Refuse sheets with the same readings whose names may be the serials of several units."""
    told = {heading.role for _, layout in sheets for heading in layout.headings}.union(
        *(layout.declared for _, layout in sheets)
    )
    if "run" in told or any(record.serial for record in records):
        return
    met: dict[tuple[object, ...], SourceText] = {}
    for (text, layout), record in zip(sheets, records, strict=True):
        columns = (record.mounting, record.temperature.round(), record.angle, record.stroke)
        own = {*zip(*(column.tolist() for column in columns), strict=True)}
        others = dict.fromkeys(met[key] for key in sorted(own & met.keys()))
        for other in others:
            if may_be_units(text.sheet, other.sheet):
                problem = f"the same temperature, position and stroke as in {other.name}"
                remedy = "write a line '# serial: ...' or '# run: ...' in each sheet"
                raise layout.refuse(problem, f"{remedy}, or call it 'SN ...'")
        met |= dict.fromkeys(own, text)


def layout_of(text: SourceText) -> Layout:
    """Take the text of a table apart.

    Raises TableError if it has no headings or no rows.
    """
    return with_name_of_sheet(rearranged(read_layout(text)), text.sheet)


def _survey(text: SourceText, layout: Layout, overrides: Overrides) -> Survey:
    layout = with_lone_output(with_channels(layout, str(overrides.get("serials") or "")))
    layout = with_lone_conditions(layout)
    form, records = by_an_engine(layout, lambda own: _read_by(own, text, layout, overrides))
    return form, tuple(records)  # their faults are worded alike by both engines


def _read_by(
    engine: Engine, text: SourceText, layout: Layout, overrides: Overrides
) -> tuple[TableForm, Iterator[TumbleRecord]]:
    table = choose_columns(layout, engine)
    given = str(overrides.get("unit") or "")
    units = list(units_written(layout, table.outputs, table.columns.get("unit")))
    of_std = list(units_of_columns(layout, filter(None, [table.columns.get("std")])))
    unit, of_unit = unit_of_outputs(units or of_std, given, layout.source)
    warmth = _warmth(table)
    scale = warmth.unit if warmth is not None else None
    declared = declarations(layout, table.decimal, unit, overrides, scale)
    readings = read_readings(table, declared.record["positions"])
    refuse_swapped(table, readings)
    factor = factor_of_std(of_std, units, given, layout.source)
    if readings.std is not None and factor != 1.0:
        readings = replace(readings, std=readings.std * factor)
    notes = (
        *(*text.notes, *layout.notes, *notes_of_facts(text.beside, layout.declared)),
        *(*table.notes, *notes_of_scale(warmth)),
        *notes_of_readings(readings, declared.record["positions"]),
        *notes_of_thousands(
            [own.cells for own in table.outputs], unit, (c.cells for c in table.columns.values())
        ),
        *of_unit,
    )
    common = {**declared.record, "source": layout.source, "notes": notes}
    common |= {"sha256": text.sha256, "date": overrides.get("date") or table.date or common["date"]}
    return _form(text, layout, table), records_of(layout, readings, declared, common)


def _warmth(table: Table) -> Column | None:
    """Column of the temperatures, or that of the headings which tell them."""
    across = table.across
    if across is not None and across.role == "temperature":
        return across
    return table.columns.get("temperature")


def _form(text: SourceText, layout: Layout, table: Table) -> TableForm:
    constants = {*CONSTANTS}.difference(heading.role for heading in layout.headings)
    columns = {n: "header line" if n in constants else c.heading for n, c in table.columns.items()}
    across = table.across
    names = [f"output of {across.role} {cell}" for cell in across.cells] if across else ["output"]
    columns |= {name: c.heading for name, c in zip(names, table.outputs, strict=True)}
    return TableForm(
        form="wide" if table.across else "long",
        separator=layout.separator or " ",
        decimal=table.decimal,
        encoding=text.encoding,
        compressed=text.compressed,
        columns=columns,
        set_aside=table.aside,
    )
