"""Writing of tables in the long form, so that they read back equal."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import fields
from typing import IO, Any

import numpy as np

from accelcal.apparatus import Apparatus
from accelcal.arguments.kinds import each_of, path_text
from accelcal.errors import InputError
from accelcal.escapes import ESCAPED
from accelcal.io.files.csv_text import csv_text
from accelcal.io.layout.header_lines import header_line, table_key
from accelcal.io.runs import order_of_runs
from accelcal.pace import LATEST
from accelcal.record import TumbleRecord

__all__ = ["write_table"]


def write_table(
    records: TumbleRecord | Sequence[TumbleRecord], target: str | os.PathLike[str] | IO[str]
) -> None:
    r"""Write records as one table in the long form.

    Parameters
    ----------
    records : TumbleRecord or sequence of TumbleRecord
        What to write. Several records need different serial numbers and the same declarations.
    target : path or text file object
        Where to write; a path that ends in ``.gz`` is compressed. A file is written whole or not
        at all.

    Raises
    ------
    InputError
        If the records do not fit into one table, a text in them does not fit into a line, or a file
        object takes no text.

    Notes
    -----
    Numbers are written with as many digits as it takes to read back the same number.

    Examples
    --------
    >>> import io
    >>> import accelcal
    >>> text = "# unit: mA\ntemperature,position,Y1\n20,1,1.3\n20,5,-1.29\n"
    >>> file = io.StringIO()
    >>> accelcal.write_table(accelcal.read_table(io.StringIO(text)), file)
    >>> print(file.getvalue(), end="")
    # unit: mA
    temperature,position,stroke,output,run,mounting
    20.0,1,1,1.3,20,o+
    20.0,5,1,-1.29,20,o+
    """
    chosen = list(each_of(records, TumbleRecord))
    _check_together(chosen)
    text = _header(chosen) + _rows(chosen)
    if hasattr(target, "write"):
        try:
            target.write(text)
        except TypeError:
            problem = "the file to write to takes bytes"
            raise InputError(f"{problem}; open it for text, or give its path") from None
        return
    from accelcal.atomic import write_atomically

    write_atomically(path_text(target), _packed(text, path_text(target)))


def _packed(text: str, path: str) -> bytes:
    data = text.encode("utf-8", errors=ESCAPED)
    if not path.endswith(".gz"):
        return data
    import gzip

    return gzip.compress(data, mtime=0)


def _check_together(records: list[TumbleRecord]) -> None:
    if not records:
        raise InputError("no record to write; a table holds at least one")
    serials = [record.serial for record in records]
    if len(records) > 1 and (None in serials or len(set(serials)) < len(serials)):
        raise InputError(f"records with serials {serials}; in one table each needs its own")
    first = _shared(records[0])
    for record in records[1:]:
        for name, value in _shared(record).items():
            if value != first[name]:
                told = f"serial {record.serial} has {name} {value!r}, serial {serials[0]}"
                remedy = "write records that differ in it to files of their own"
                raise InputError(f"{told} {first[name]!r}; {remedy}")


def _shared(record: TumbleRecord) -> dict[str, Any]:
    names = ("unit", "positions", "reference_temperature", "apparatus", "date")
    return {name: getattr(record, name) for name in names} | {"metadata": dict(record.metadata)}


def _header(records: list[TumbleRecord]) -> str:
    record = records[0]
    apparatus = {item.name: getattr(record.apparatus, item.name) for item in fields(Apparatus)}
    declared = {
        "serial": record.serial if len(records) == 1 else None,
        "date": record.date,
        "unit": record.unit,
        "T0": record.reference_temperature,
        "positions": record.positions if record.positions != 8 else None,
        "g": apparatus.pop("local_gravity"),
        **apparatus,
        "runs": _declared_runs(records),
    }
    lines = [f"# {key}: {value}" for key, value in declared.items() if value is not None]
    lines += [_metadata_line(key, value) for key, value in record.metadata.items()]
    for line in lines:
        _check_line(line)
    return "".join(line + "\n" for line in lines)


def _declared_runs(records: list[TumbleRecord]) -> str | None:
    """Run labels in their order, where the rows or times would not show them so."""
    orders = [order_of_runs(own.run, own.run_labels, own.time) for own in records]
    if all(
        [*dict.fromkeys(own.run[order].tolist())] == [*range(len(own.run_labels))]
        for own, order in zip(records, orders, strict=True)
    ):
        return None
    if len({record.run_labels for record in records}) > 1:
        raise InputError("records with different runs; write each to a file of its own")
    return csv_text([records[0].run_labels]).rstrip("\n")


def _metadata_line(key: str, value: str) -> str:
    line = f"{key}: {value}"
    if key != "delta0" and (table_key(key) or header_line(line)[0] != key or not key):
        raise InputError(f"metadata key {key!r} does not fit into a header line; rename it")
    return f"# {line}"


def _check_line(line: str) -> None:
    if "\n" in line or "\r" in line or "\0" in line or line != line.rstrip(" \t,;"):
        raise InputError(f"{line!r} does not fit into a header line; shorten it to plain text")


def _rows(records: list[TumbleRecord]) -> str:
    columns = [_columns(record) for record in records]
    names = list(dict.fromkeys(name for table in columns for name in table))
    if any(list(table) != names for table in columns):
        raise InputError("records with different columns; write each to a file of its own")
    if len(records) > 1:
        names.append("serial")
    rows = (
        [*row, record.serial] if len(records) > 1 else row
        for record, table in zip(records, columns, strict=True)
        for row in zip(*table.values(), strict=True)
    )
    return csv_text([names, *rows])


def _columns(record: TumbleRecord) -> dict[str, list[Any]]:
    """Columns of one record as plain numbers and texts."""
    positions = [number or "" for number in record.position.tolist()]
    nominal = (record.position - 1) * 360.0 / record.positions
    angled = bool(np.any((record.position == 0) | (record.angle != nominal)))
    columns: dict[str, list[Any]] = {"temperature": record.temperature.tolist()}
    if any(positions):
        columns["position"] = positions
    if angled:
        columns["angle"] = record.angle.tolist()
    columns |= {"stroke": record.stroke.tolist(), "output": record.output.tolist()}
    columns["run"] = [_label(record.run_labels[index]) for index in record.run.tolist()]
    columns["mounting"] = record.mounting.tolist()
    if record.time is not None and np.abs(record.time).max() > LATEST:
        raise InputError(f"a time of {np.abs(record.time).max():g} s; give times from the start")
    for name in ("clamping", "time", "std", "count"):
        values = getattr(record, name)
        if values is not None:
            columns[name] = values.tolist()
    return columns


def _label(name: str) -> str:
    if not name or name != name.strip() or "\n" in name or "\r" in name or "\0" in name:
        raise InputError(f"run label {name!r} does not fit into a cell; rename the run")
    return name
