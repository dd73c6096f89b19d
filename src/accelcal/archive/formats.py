"""The two frames of a batch: what each column holds, and parts of them as bytes of CSV or Arrow.

Arrays of Arrow are made from their buffers: what pyarrow offers for numpy and lists loads pandas
wherever it is installed, which takes longer than a worker has to do.
"""

from __future__ import annotations

import base64
import gzip
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import IO, TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arguments.kinds import ending_of
from accelcal.arrays import Array, Labels, Mask, Places
from accelcal.errors import not_installed
from accelcal.escapes import ESCAPED
from accelcal.io.files.csv_text import csv_text, quoted
from accelcal.model import COEFFICIENTS, ERROR_TERMS, ERROR_UNITS, coefficient_unit
from accelcal.results.tabular import gate_column, gate_of_column

if TYPE_CHECKING:
    import pandas as pd

_GATES = (
    *("closure", "drift", "forward against back", "order of positions", "outlier"),
    *("proportions", "resolution", "units", "lack of fit", "agreement of tables"),
)
"""Gates of each table, in their order, and behind them the last two of the record."""

_PARTS = (
    ("", "{}"),
    ("_standard_uncertainty", "standard uncertainty of {}"),
    ("_expanded_uncertainty", "half width of the 95 % interval of {}"),
)


class FrameColumn(NamedTuple):
    """A column of a frame."""

    name: str  # its heading
    kind: str  # ``"text"``, ``"number"``, ``"whole"`` or ``"flag"``
    unit: str  # of its numbers; empty where they have none
    told: str  # what it holds, in a few words


def _of_quantity(name: str, unit: str) -> Iterator[FrameColumn]:
    for suffix, told in _PARTS:
        yield FrameColumn(name + suffix, "number", unit, told.format(name))
    told = f"effective degrees of freedom of that interval of {name}; empty where infinite"
    yield FrameColumn(f"{name}_dof", "number", "", told)


_WHERE = (
    FrameColumn("source", "text", "", "file or URL that the readings come from"),
    FrameColumn("line", "whole", "", "line of the source with the first reading"),
    FrameColumn("serial", "text", "", "serial number of the accelerometer"),
)

_OF_TABLE = (
    *_WHERE,
    FrameColumn("run", "text", "", "visit to a temperature"),
    FrameColumn("mounting", "text", "", "o+, o-, p+ or p-"),
    FrameColumn("date", "text", "", "date of the test, as written"),
    FrameColumn("lot", "text", "", "lot of the unit, from a line '# lot:' or a column"),
    FrameColumn("temperature_degC", "number", "degC", "mean temperature of the run"),
    FrameColumn("readings", "whole", "", "number of readings"),
    FrameColumn("dof", "whole", "", "readings minus coefficients"),
    FrameColumn("output_unit", "text", "", "unit of the output"),
    FrameColumn("residual_rms", "number", "output_unit", "root of the squared residuals over dof"),
    *(
        c
        for name in COEFFICIENTS
        for c in _of_quantity(name, coefficient_unit(name, "output_unit"))
    ),
    *(c for name in ERROR_TERMS.values() for c in _of_quantity(name, ERROR_UNITS[name])),
    FrameColumn("stands_for", "text", "", "what a coefficient holds besides itself, at few angles"),
    *(FrameColumn(gate_column(g), "text", "", f"gate {g}") for g in _GATES),
    FrameColumn(
        "warnings",
        "text",
        "",
        "what to know first, and what gates warn of, joined by ' | '",
    ),
    FrameColumn("notes", "text", "", "what the reader set aside or assumed, joined by ' | '"),
    FrameColumn("verdict", "text", "", "outcome against the data sheet, of the whole record"),
    FrameColumn("failed_limits", "text", "", "limits of the data sheet that failed"),
    FrameColumn("method", "text", "", "estimator"),
    FrameColumn("robust", "flag", "", "guarded against outliers"),
    FrameColumn("g_local_m_s2", "number", "m/s^2", "local gravity, where given"),
    FrameColumn("T0_degC", "number", "degC", "reference temperature"),
    FrameColumn("delta0_rad", "number", "rad", "fixture angle taken as given"),
    FrameColumn("software", "text", "", "name and version of what fitted"),
    FrameColumn("sha256", "text", "", "SHA-256 of the source; empty for a large table in parts"),
)

_OF_LAW = (
    *_WHERE,
    FrameColumn("mounting", "text", "", "mounting whose tables make the laws"),
    FrameColumn("date", "text", "", "date of the test, as written"),
    FrameColumn("coefficient", "text", "", "k0, K1 or delta at_T0, above or below; or hysteresis"),
    FrameColumn("value", "number", "unit", "its value"),
    FrameColumn("standard_uncertainty", "number", "unit", "its standard uncertainty"),
    FrameColumn("expanded_uncertainty", "number", "unit", "half width of its 95 % interval"),
    FrameColumn("dof", "number", "", "degrees of freedom of the interval; empty where infinite"),
    FrameColumn("unit", "text", "", "unit of the value"),
    FrameColumn("T0_degC", "number", "degC", "reference temperature"),
    FrameColumn("warnings", "text", "", "what is missing in the laws, and why"),
    FrameColumn("software", "text", "", "name and version of what fitted"),
)

ROWS: Mapping[str, FrameColumn] = {column.name: column for column in _OF_TABLE}
"""Columns of the frame of tables: a row a serial, run and mounting."""

LAWS: Mapping[str, FrameColumn] = {column.name: column for column in _OF_LAW}
"""Columns of the frame of temperature laws: a row a record and term."""

ERRORS = ("source", "message")
"""Columns of the list of what could not be read or fitted."""


Cells = Array | Labels[Any]
"""Cells of a column: numbers, NaN where there is none, or labels."""

Columns = dict[str, Cells]
"""Cells of a frame by the name of the column."""


def no_rows(kinds: Mapping[str, FrameColumn]) -> Columns:
    """Make a frame without rows."""
    return {
        name: np.zeros(0) if column.kind == "number" else Labels.of([])
        for name, column in kinds.items()
    }


def put_together(parts: Sequence[Columns], order: Places | None = None) -> Columns:
    """Put parts of a frame below each other.

    The parts, one or more, have the same columns. `order` has the place in that frame of each row
    that is wanted; by default all are, as they come.
    """
    return {name: _joined([part[name] for part in parts], order) for name in parts[0]}


def _joined(parts: Sequence[Cells], order: Places | None) -> Cells:
    rows = slice(None) if order is None else order
    labels = [part for part in parts if isinstance(part, Labels)]
    if labels:
        return Labels.joined(labels).taken(rows)
    return np.concatenate([part for part in parts if not isinstance(part, Labels)])[rows]


# -- in a notebook ---------------------------------------------------------------------------------


_IN_NOTEBOOK = (
    *("source", "serial", "run", "mounting", "date", "temperature_degC"),
    *("K1", "K1_expanded_uncertainty", "k0", "k0_expanded_uncertainty"),
    *("coefficient", "value", "expanded_uncertainty", "unit", "message"),
)
"""Columns of the frames that a notebook shows; K1 and k0 stand for the coefficients."""


def in_notebook(frame: pd.DataFrame) -> pd.DataFrame:
    """Take what a notebook shows of a frame: some columns, and of the gates those that warn."""
    shown, names = frame.filter(items=_IN_NOTEBOOK), frame.columns.to_series().map(gate_of_column)
    names = names[names != ""] + ", "
    if names.empty:
        return shown
    warned = (frame[names.index] == "warn").dot(names)
    return shown.assign(**{"gates that warn": warned.str.removesuffix(", ")})


_ROW_GROUP = 16_000  # rows that are written together; in parts of 8,000 they take a fifth longer


def arrow_bytes(columns: Columns, kinds: Mapping[str, FrameColumn]) -> bytes:
    """Encode a part of a frame as a stream of Arrow, its labels as dictionaries."""
    import pyarrow as pa

    arrays = [_array(columns[name], kind.kind) for name, kind in kinds.items()]
    batch = pa.record_batch(arrays, names=list(kinds))
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, batch.schema) as writer:
        writer.write_batch(batch)
    found: bytes = sink.getvalue().to_pybytes()
    return found


@contextmanager
def parquet_frame(
    kinds: Mapping[str, FrameColumn], file: IO[bytes]
) -> Iterator[Callable[[bytes], None]]:
    """Give what takes the parts of `arrow_bytes`; the frame is whole when the context ends."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    texts = [name for name, column in kinds.items() if column.kind == "text"]
    options = {
        "compression": "snappy",  # which every reader of Parquet knows
        "use_dictionary": texts,  # numbers hardly repeat
        "write_statistics": ["serial", "date"],  # by these rows are looked for
        "store_schema": False,  # dictionaries are for writing alone: readers get text
    }
    waiting: list[Any] = []
    with pq.ParquetWriter(
        file, _schema(kinds, pa.dictionary(pa.int32(), pa.string())), **options
    ) as writer:
        told = base64.b64encode(_schema(kinds, pa.string()).serialize())
        writer.add_key_value_metadata({"ARROW:schema": told.decode()})

        def write() -> None:
            writer.write_table(pa.concat_tables(waiting).unify_dictionaries())
            waiting.clear()

        def add(part: bytes) -> None:
            waiting.append(pa.ipc.open_stream(part).read_all())
            if sum(table.num_rows for table in waiting) >= _ROW_GROUP:
                write()

        yield add
        if any(table.num_rows for table in waiting):
            write()


def _schema(kinds: Mapping[str, FrameColumn], text: Any) -> Any:
    import pyarrow as pa

    fields = [
        pa.field(
            column.name,
            text if column.kind == "text" else _type(column.kind),
            metadata={"unit": column.unit} if column.unit else None,
        )
        for column in kinds.values()
    ]
    return pa.schema(fields)


def _type(kind: str) -> Any:
    import pyarrow as pa

    return {"number": pa.float64(), "whole": pa.int64(), "flag": pa.bool_()}[kind]


def _array(cells: Cells, kind: str) -> Any:
    import pyarrow as pa

    if isinstance(cells, np.ndarray):
        return _plain(cells, cells.size, _type(kind), ~np.isnan(cells))
    known, values = None, cells.values
    if None in values:
        known = np.array([value is not None for value in values])[cells.code]
        values = [("" if kind == "text" else 0) if value is None else value for value in values]
    if kind == "text":
        each = Labels.of(_as_utf8(values))  # a dictionary of Parquet holds a text once
        code = _plain(each.code[cells.code].astype(np.int32), cells.code.size, pa.int32(), known)
        return pa.DictionaryArray.from_arrays(code, _strings(each.values))
    numbers = np.array(values, dtype=np.int64)[cells.code]
    stored = _bits(numbers != 0) if kind == "flag" else numbers
    return _plain(stored, numbers.size, _type(kind), known)


def _plain(values: NDArray[Any], size: int, kind: Any, known: Mask | None) -> Any:
    import pyarrow as pa

    stored = pa.py_buffer(np.ascontiguousarray(values))
    return pa.Array.from_buffers(kind, size, [_unless_all(known), stored])


def _strings(texts: Sequence[str]) -> Any:
    import pyarrow as pa

    whole = "".join(texts)
    # a letter of ASCII is a byte
    sized = texts if whole.isascii() else [text.encode() for text in texts]
    ends = np.cumsum([0, *map(len, sized)], dtype=np.int32)
    return pa.StringArray.from_buffers(len(texts), pa.py_buffer(ends), pa.py_buffer(whole.encode()))


def _as_utf8(texts: Sequence[str]) -> Sequence[str]:
    """Texts with an escape for what is no UTF-8, as may be in the name of a file."""
    if "".join(texts).isascii():
        return texts
    return [text.encode("utf-8", errors=ESCAPED).decode() for text in texts]


def _unless_all(known: Mask | None) -> Any:
    """Which values are known; None where all are."""
    import pyarrow as pa

    return None if known is None else pa.py_buffer(_bits(known))


def _bits(flags: Mask) -> NDArray[np.uint8]:
    return np.packbits(flags, bitorder="little")


FORMS = (".csv", ".csv.gz", ".parquet")
"""Ends of the names of results."""

_ROWS = 2**12
"""Rows that are text at a time: those of a block of small files, but a part of a large table."""

_PACKED = 4  # level of gzip: 9, its default, takes more than twice as long for a twentieth less


def results(path: str) -> dict[str, str]:
    """Names of the files that a batch writes, of which that of the tables is given.

    Examples
    --------
    >>> results("al15.parquet")["errors"]
    'al15.errors.csv'
    """
    form = ending_of(path, FORMS)
    stem = path[: -len(form)]
    return {"tables": path, "laws": f"{stem}.laws{form}", "errors": f"{stem}.errors.csv"}


def require_form(form: str) -> None:
    """Demand what a form needs; raises InputError if that is pyarrow and not installed."""
    if form != ".parquet":
        return
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError:
        raise not_installed("Parquet", "pyarrow", "parquet") from None


def encode(columns: Columns, kinds: Mapping[str, FrameColumn], form: str) -> bytes:
    """Encode a part of a frame, without what stands once in a file.

    Lines of CSV, a member of gzip, or a stream of Arrow.
    """
    if form == ".parquet":
        return arrow_bytes(columns, kinds)
    written = [_written(columns[name], kinds[name].kind) for name in kinds]
    parts = [slice(start, start + _ROWS) for start in range(0, len(written[0]), _ROWS)]
    text = b"".join(_csv_lines([_texts(cells, rows) for cells in written]) for rows in parts)
    return text if form == ".csv" else _packed(text)


@contextmanager
def open_frame(
    kinds: Mapping[str, FrameColumn], form: str, file: IO[bytes]
) -> Iterator[Callable[[bytes], object]]:
    """Give what takes the parts of a frame as of `encode`; it is whole when the context ends."""
    if form == ".parquet":
        with parquet_frame(kinds, file) as add:
            yield add
        return
    headings = (",".join(kinds) + "\n").encode()
    file.write(headings if form == ".csv" else _packed(headings))
    yield file.write


def write_errors(errors: Iterable[Sequence[str]], file: IO[bytes]) -> None:
    """Write the list of what could not be read or fitted, a source and a message each."""
    file.write(csv_text([ERRORS, *errors]).encode("utf-8", errors=ESCAPED))


# -- CSV -------------------------------------------------------------------------------------------


def _packed(text: bytes) -> bytes:
    return gzip.compress(text, _PACKED, mtime=0)


def _csv_lines(cells: Sequence[Sequence[str]]) -> bytes:
    lines = map(",".join, zip(*cells, strict=True))
    return ("\n".join(lines) + "\n").encode("utf-8", errors=ESCAPED)


def _written(cells: Cells, kind: str) -> Cells:
    """Cells whose labels are as CSV has them, each written once however often it comes."""
    if isinstance(cells, np.ndarray):
        return cells
    write: Callable[[Any], str] = quoted if kind == "text" else repr
    return Labels(cells.code, ["" if value is None else write(value) for value in cells.values])


def _texts(cells: Cells, rows: slice) -> list[str]:
    """Some cells as CSV has them."""
    if isinstance(cells, Labels):
        return cells.taken(rows).cells()
    return ["" if cell != cell else repr(cell) for cell in cells[rows].tolist()]  # NaN
