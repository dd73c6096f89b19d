"""Reading of tables: one record for each accelerometer in a file.

A table is read in steps, each in a module of its own: bytes to text (`text`), header lines,
headings and rows (`layout`), columns (`columns`, `engines`), cells (`cells`), readings
(`readings`), declarations (`declarations`), and here the records.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arguments.kinds import shown
from accelcal.arrays import Array, Ints
from accelcal.dates import date_of
from accelcal.errors import TableError, located
from accelcal.io.columns import CONSTANTS, Table, choose_columns
from accelcal.io.declarations import (
    Declarations,
    declarations,
    declared_by_caller,
    notes_of_serial,
)
from accelcal.io.engines import Engine, by_an_engine
from accelcal.io.files.text import Source, SourceText, read_texts
from accelcal.io.layout.output_columns import with_channels, with_lone_output
from accelcal.io.layout.output_unit import (
    factor_of_std,
    unit_of_outputs,
    units_of_columns,
    units_written,
)
from accelcal.io.layout.parts import Layout, read_layout
from accelcal.io.layout.units_below import with_units_below
from accelcal.io.readings import (
    Readings,
    notes_of_clock,
    notes_of_midnight,
    notes_of_pace,
    notes_of_turn,
    read_readings,
)
from accelcal.io.repeats import without_repeats
from accelcal.io.runs import runs_of
from accelcal.io.sheets import one_table, require_same_columns, with_temperature_of_sheet
from accelcal.io.strokes import with_cycles
from accelcal.io.values.lots import lot_of_column
from accelcal.io.values.places import notes_of_minutes
from accelcal.io.values.thousands import notes_of_thousands
from accelcal.io.words.wording import lines_named, were
from accelcal.logs import tell
from accelcal.record import TumbleRecord
from accelcal.serials import notes_of_alike

__all__ = ["TableForm", "read_table", "read_tables", "survey", "survey_text"]

ONE_AT_A_TIME = "read them by read_tables, or give one accelerometer at a time"

_NEEDED = ("output", "angle", "temperature", "stroke", "mounting", "position")
_OPTIONAL = ("clamping", "std", "count", "line")


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
    source: Source, *, overrides: Mapping[str, object] | None = None
) -> tuple[TumbleRecord, ...]:
    r"""Read all accelerometers of a table.

    Parameters
    ----------
    source : path, "-" or file object
        A table in one of the forms of the guide; ``"-"`` reads standard input.
    overrides : mapping of str to object, optional
        Declarations that win over the header: fields of `Apparatus`, `reference_temperature`,
        `positions`, `unit`, `serial`, `date`, a mapping `metadata`, or `serials`, the headings of
        the columns of several accelerometers with commas between. A quantity may be a text as
        ``"2 arcsec"``.

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


def survey(source: Source, *, overrides: Mapping[str, object] | None = None) -> Survey:
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
    first, *others = read_texts(source)
    return _survey_sheets((first, *others), given) if others else survey_text(first, given)


def _survey_sheets(sheets: Sequence[SourceText], overrides: Mapping[str, object]) -> Survey:
    """Read sheets: accelerometers, each of its own, or parts of one table."""
    layouts = [layout_of(sheet) for sheet in sheets]
    found = [_survey(*sheet, overrides) for sheet in zip(sheets, layouts, strict=True)]
    require_same_columns(layouts)
    records = tuple(record for _, records in found for record in records)
    if len({record.serial for record in records} - {None}) == len(records):
        return found[0][0], records
    name = sheets[0].name.removesuffix(f"#{sheets[0].sheet}")
    names = ", ".join(shown(sheet.sheet) for sheet in sheets)
    table = one_table(layouts, name)
    notes = dict.fromkeys(note for sheet in sheets for note in sheet.notes)
    text = sheets[0]._replace(notes=(f"the sheets {names} are read as one table", *notes))
    try:
        return found[0][0], _survey(text, table, overrides)[1]
    except TableError as error:
        problem = f"the sheets {names} are not one table: {error.problem}"
        remedy = "tell them apart by lines '# run: ...' or '# serial: ...', or name one, as"
        remedy = f"{remedy} {sheets[0].name}"
        raise TableError(problem, remedy, source=name) from None


def survey_text(
    text: SourceText, overrides: Mapping[str, object], layout: Layout | None = None
) -> Survey:
    """Read the text of a table and tell how it was written.

    Parameters
    ----------
    text : SourceText
        The text.
    overrides : mapping of str to object
        As for `read_tables`.
    layout : Layout, optional
        Some rows of the table that `layout_of` takes apart; by default all.

    Returns
    -------
    tuple
        As of `survey`.

    Raises
    ------
    TableError
        If the table is unusable.
    """
    return _survey(text, layout or layout_of(text), overrides)


def layout_of(text: SourceText) -> Layout:
    """Take the text of a table apart.

    Raises
    ------
    TableError
        If it has no headings or no rows.
    """
    layout = with_cycles(with_units_below(read_layout(text)))
    return with_temperature_of_sheet(layout, text.sheet)


def _survey(text: SourceText, layout: Layout, overrides: Mapping[str, object]) -> Survey:
    layout = with_lone_output(with_channels(layout, str(overrides.get("serials") or "")))
    form, records = by_an_engine(layout, lambda own: _read_by(own, text, layout, overrides))
    return form, tuple(records)  # their faults are worded alike by both engines


def _read_by(
    engine: Engine, text: SourceText, layout: Layout, overrides: Mapping[str, object]
) -> tuple[TableForm, Iterator[TumbleRecord]]:
    table = choose_columns(layout, engine)
    given = str(overrides.get("unit") or "")
    units = list(units_written(layout, table.outputs, table.columns.get("unit")))
    of_std = list(units_of_columns(layout, filter(None, [table.columns.get("std")])))
    unit, of_unit = unit_of_outputs(units or of_std, given, layout.source)
    declared = declarations(layout, table.decimal, unit, overrides)
    readings = read_readings(table, declared.record["positions"])
    factor = factor_of_std(of_std, units, given, layout.source)
    if readings.std is not None and factor != 1.0:
        readings = replace(readings, std=readings.std * factor)
    notes = (
        *(*text.notes, *layout.notes, *table.notes),
        *notes_of_turn(readings, declared.record["positions"]),
        *notes_of_minutes(readings.angle),
        *notes_of_midnight(readings),
        *readings.stroke_notes,
        *notes_of_thousands([own.cells for own in table.outputs], unit),
        *of_unit,
    )
    common = {**declared.record, "source": layout.source, "notes": notes}
    common |= {"sha256": text.sha256, "date": overrides.get("date") or table.date or common["date"]}
    return _form(text, layout, table), _records(layout, readings, declared, common)


def _form(text: SourceText, layout: Layout, table: Table) -> TableForm:
    constants = {*CONSTANTS}.difference(heading.role for heading in layout.headings)
    columns = {
        name: "header line" if name in constants else column.heading
        for name, column in table.columns.items()
    }
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


def _records(
    layout: Layout, readings: Readings, declared: Declarations, common: dict[str, Any]
) -> Iterator[TumbleRecord]:
    serials = _serials(layout, readings, common["serial"])
    header = layout.declared.get("serial")
    written = readings.serials or ((header.value,) if header else ())
    notes = [note for own in written for note in notes_of_serial(common["serial"], own)]
    notes += notes_of_alike(readings.serials)
    common |= {"notes": (*common["notes"], *notes)}
    for serial, chosen in zip(serials, readings.of_each_serial(), strict=True):
        if chosen.output.size == 0:
            problem = f"serial {shown(str(serial))} has no output that is not missing"
            remedy = "write its outputs or delete its rows"
            raise TableError(problem, remedy, source=layout.source, line=int(chosen.missing[0]))
        yield _record(chosen, declared, common | {"serial": serial})


def _serials(layout: Layout, readings: Readings, declared: str | None) -> tuple[str | None, ...]:
    names = readings.serials
    if not names or declared is None or names == (declared,):
        return names or (declared,)
    header = layout.declared.get("serial")
    if len(names) > 1 or (header and header.value == declared):
        problem = f"serial {shown(', '.join(names))} in the table, but {shown(declared)} declared"
        remedy = "leave the column or the declaration out"
        raise layout.refuse(problem, remedy)
    return (declared,)


def _record(readings: Readings, declared: Declarations, common: dict[str, Any]) -> TumbleRecord:
    runs = runs_of(readings, declared.runs)
    kept = without_repeats(readings, runs.index)
    notes = [*common["notes"], *runs.notes]
    if readings.missing.size:
        notes.append(_left_out(readings.missing, "missing reading"))
    if not kept.all():
        notes.append(_left_out(readings.line[~kept], "repeated reading"))
    readings = readings.select(kept)
    notes += (*notes_of_pace(readings.time), *notes_of_clock(readings))
    _require_change(readings)
    time, start = _seconds(readings.time, common["date"])
    days = _days(readings.day) if common["date"] is None else []
    if len(days) > 1:
        notes.append(f"the readings are of {len(days)} days: the test counts as of {days[0]}")
    values = (
        common
        | {"date": days[0] if days else common["date"]}
        | {name: getattr(readings, name) for name in (*_NEEDED, *_OPTIONAL)}
    )
    lot, more = lot_of_column(readings.lot, declared.metadata)
    values |= {"notes": (*notes, *more), "metadata": {**declared.metadata, **lot, **start}}
    values |= {"run": runs.index[kept], "run_labels": runs.labels, "time": time}
    return located(lambda: TumbleRecord(**values), source=common["source"])


def _left_out(lines: Ints, what: str) -> str:
    return f"{were(lines, what)} left out ({lines_named(lines)})"


def _require_change(readings: Readings) -> None:
    if readings.output.size > 1 and (readings.output == readings.output[0]).all():
        problem = f"all {readings.output.size} outputs are {readings.output[0]:g}"
        remedy = "check the voltmeter and the output column; the output changes with the angle"
        raise readings.refuse(0, problem, remedy)


def _days(day: NDArray[np.datetime64] | None) -> list[str]:
    """Days of the readings in their order; none where the times have no days."""
    return [] if day is None else [str(own) for own in np.unique(day)]


def _seconds(time: NDArray[Any] | None, date: str | None) -> tuple[Array | None, dict[str, str]]:
    """Times in seconds, and the start where the table gives dates."""
    if time is None or time.dtype.kind == "f":
        return time, {}
    start = time[0]
    if time.dtype.kind == "m":
        day = date_of(date or "")
        start = None if day is None else np.datetime64(day.date()) + start
    since = (time - time[0]) / np.timedelta64(1, "s")
    return since, {} if start is None else {"start": str(start)}
