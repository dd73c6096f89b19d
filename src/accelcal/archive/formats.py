"""Frames as bytes: each block encoded where it was made, and put together in a stream."""

from __future__ import annotations

import gzip
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import IO, Any

import numpy as np

from accelcal.archive.arrow import arrow_bytes, parquet_frame
from accelcal.archive.columns import ERRORS, Cells, Columns, FrameColumn
from accelcal.arguments.kinds import ending_of
from accelcal.arrays import Labels
from accelcal.errors import not_installed
from accelcal.escapes import ESCAPED
from accelcal.io.files.csv_text import csv_text, quoted

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
