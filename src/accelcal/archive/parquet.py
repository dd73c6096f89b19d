"""Parquet in: its rows as the text of a CSV file, for the one reader of tables."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import IO, Any

from accelcal.errors import InputError

__all__ = ["as_csv", "row_ranges"]

_SERIALS = ("serial", "sn", "s_n", "serial_number", "serial_no")


def as_csv(source: str | IO[bytes], start: int = 0, end: int | None = None) -> bytes:
    """Rows of a Parquet file as CSV, below their headings; numbers keep all their digits.

    Parameters
    ----------
    source : str or binary file object
        The file.
    start, end : int
        The rows; None is the last.

    Returns
    -------
    bytes
        The text; cells that are missing are empty.

    Raises
    ------
    InputError
        If pyarrow is not installed, or the file is no Parquet file.
    """
    import pyarrow as pa
    from pyarrow import csv

    file = _open(source)
    table = _rows(file, start, file.metadata.num_rows if end is None else end)
    for index, column in enumerate(table.columns):
        if pa.types.is_dictionary(column.type):
            plain = column.cast(column.type.value_type)
            table = table.set_column(index, table.field(index).name, plain)
    text = io.BytesIO()
    text.write((",".join(table.column_names) + "\n").encode())
    options = csv.WriteOptions(include_header=False, quoting_style="none")
    csv.write_csv(table, text, options)
    return text.getvalue()


def row_ranges(path: str, size: int) -> Iterator[tuple[int, int]]:
    """Divide the rows of a Parquet file where its serial changes.

    Parameters
    ----------
    path : str
        The file.
    size : int
        About how many bytes a range holds as text.

    Yields
    ------
    tuple of int
        First row and the one behind the last; nothing where there is no column of serials.
    """
    file = _open(path)
    names = [name for name in file.schema_arrow.names if name.casefold() in _SERIALS]
    if not names:
        return
    rows = file.metadata.num_rows
    about = max(size // (10 * len(file.schema_arrow.names)), 1)  # ten characters a cell
    start = 0
    serials = file.read(columns=names[:1]).column(0)
    while start < rows:
        end = min(start + about, rows)
        last = serials[end - 1]
        while end < rows and serials[end] == last:
            end += 1
        yield start, end
        start = end


def _open(source: str | IO[bytes]) -> Any:
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise InputError(
            "Parquet needs pyarrow; install it with: pip install 'accelcal[parquet]'"
        ) from None
    try:
        return pq.ParquetFile(source)
    except pa.ArrowInvalid as error:
        told = " ".join(str(error).split())
        raise InputError(f"no Parquet file ({told}); give one, or CSV") from None


def _rows(file: Any, start: int, end: int) -> Any:
    """Rows of the row groups that hold them."""
    groups: list[int] = []
    first = at = 0
    for group in range(file.num_row_groups):
        size = file.metadata.row_group(group).num_rows
        if at + size > start and at < end:
            first = first if groups else at
            groups.append(group)
        at += size
    return file.read_row_groups(groups).slice(start - first, end - start)
