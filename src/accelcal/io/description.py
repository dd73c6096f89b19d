"""What the reader understood of a table, for people."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from accelcal.apparatus import UNITS
from accelcal.io.tables import TableForm
from accelcal.record import TumbleRecord

_NO_TEXT = ("parquet", "workbook")
"""Encodings of which nobody wrote separators and decimal marks."""

_SEPARATORS = {",": "comma", ";": "semicolon", "|": "bar", "\t": "tab", " ": "blanks"}


def describe(record: TumbleRecord, form: TableForm | None = None) -> str:
    r"""Tell what the reader understood, a line a fact.

    Examples
    --------
    >>> import io
    >>> from accelcal.io.tables import read_table
    >>> text = "temperature,position,Y1,Y2\n20,1,1.30,1.31\n20,5,-1.29,-1.28\n"
    >>> print(describe(read_table(io.StringIO(text))))
    source             <table>
    serial             not given
    readings           4
    output             -1.29 to 1.31, unit not given
    run 20             4 readings, 20 degC, mounting o+, 2 positions, strokes 1 to 2
    positions missing  2, 3, 4, 6, 7, 8, 9 of 9
    """
    facts = [("source", record.source), *(_form_facts(form) if form else []), *_facts(record)]
    width = max(len(name) for name, _ in facts) + 2
    return "\n".join(f"{name:<{width}}{value}" for name, value in facts)


def summary(records: Sequence[TumbleRecord], form: TableForm) -> dict[str, Any]:
    """Tell what the reader understood, ready for JSON.

    Units are in the names.
    """
    return {
        "schema": "accelcal/check/1",
        "source": records[0].source,
        "table": form._asdict(),
        "records": [_record_summary(record) for record in records],
    }


def _record_summary(record: TumbleRecord) -> dict[str, Any]:
    apparatus = record.apparatus
    return {
        "serial": record.serial,
        "output_unit": record.unit,
        "readings": len(record),
        "runs": [_run_summary(table, name) for name, table in _by_run(record)],
        "positions": record.positions,
        "positions_missing": _missing(record),
        "T0_degC": record.reference_temperature,
        "apparatus": {name: getattr(apparatus, name) for name in apparatus.__slots__},
        "date": record.date,
        "metadata": dict(record.metadata),
        "notes": list(record.notes),
    }


def _form_facts(form: TableForm) -> list[tuple[str, str]]:
    packed = ", gzip" if form.compressed else ""
    mark = "comma" if form.decimal == "," else "point"
    written = f", separator {_SEPARATORS[form.separator]}, decimal {mark}"
    facts = [
        ("form", form.form + ("" if form.encoding in _NO_TEXT else written)),
        ("encoding", form.encoding + packed),
    ]
    columns = [r if r == own else f"{r} ({own})" for r, own in form.columns.items()]
    facts += [("columns", ", ".join(columns))]
    return facts + ([("set aside", ", ".join(form.set_aside))] if form.set_aside else [])


def _facts(record: TumbleRecord) -> list[tuple[str, str]]:
    low, high = record.output.min(), record.output.max()
    unit = record.unit or ", unit not given"
    facts = [
        ("serial", record.serial or "not given"),
        ("readings", str(len(record))),
        ("output", f"{low:g} to {high:g}{' ' if record.unit else ''}{unit}"),
    ]
    facts += [(f"run {name}", _run_text(table)) for name, table in _by_run(record)]
    missing = _missing(record)
    if missing:
        names = ", ".join(map(str, missing))
        facts.append(("positions missing", f"{names} of {record.positions + 1}"))
    facts += _declared_facts(record)
    return facts + [("note", note) for note in record.notes]


def _declared_facts(record: TumbleRecord) -> list[tuple[str, str]]:
    values = {name: getattr(record.apparatus, name) for name in record.apparatus.__slots__}
    output = record.unit or "output units"
    facts = [(n, f"{v:g} {UNITS.get(n, output)}") for n, v in values.items() if v is not None]
    if record.reference_temperature is not None:
        facts.insert(0, ("T0", f"{record.reference_temperature:g} degC"))
    if record.date:
        facts.append(("date", record.date))
    return facts + list(record.metadata.items())


def _by_run(record: TumbleRecord) -> list[tuple[str, TumbleRecord]]:
    """Tables of the record by the label of their run."""
    return [(record.run_labels[int(table.run[0])], table) for table in record.tables()]


def _run_summary(table: TumbleRecord, name: str) -> dict[str, Any]:
    known = table.temperature[~np.isnan(table.temperature)]
    return {
        "run": name,
        "mounting": str(table.mounting[0]),
        "clamping_deg": 0.0 if table.clamping is None else float(table.clamping[0]),
        "readings": len(table),
        "temperature_degC": [float(known.min()), float(known.max())] if known.size else None,
        "angles_deg": np.unique(table.angle).tolist(),
        "strokes": np.unique(table.stroke).tolist(),
    }


def _run_text(table: TumbleRecord) -> str:
    facts = _run_summary(table, "")
    degrees = facts["temperature_degC"]
    temperature = "temperature unknown"
    if degrees:
        low, high = (f"{value:g}" for value in degrees)
        temperature = f"{low} degC" if low == high else f"{low} to {high} degC"
    strokes = facts["strokes"]
    which = f"strokes {strokes[0]} to {strokes[-1]}" if len(strokes) > 1 else f"stroke {strokes[0]}"
    clamped = f" clamped at {facts['clamping_deg']:g} deg" if facts["clamping_deg"] else ""
    return (
        f"{facts['readings']} readings, {temperature}, mounting {facts['mounting']}{clamped},"
        f" {table.head_angles.size} positions, {which}"
    )


def _missing(record: TumbleRecord) -> list[int]:
    """Numbers of the positions without any reading, empty where angles are given."""
    if not record.position.any():
        return []
    return sorted(set(range(1, record.positions + 2)) - set(record.position.tolist()))
