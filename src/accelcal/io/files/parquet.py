"""Parquet in: its rows as the text of a CSV file, for the one reader of tables."""

from __future__ import annotations

import io
import os
from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from functools import lru_cache
from itertools import accumulate
from typing import IO, Any

from accelcal.arguments.kinds import shown
from accelcal.errors import TableError, not_installed
from accelcal.io.files.csv_text import csv_text
from accelcal.io.words.headings import read_heading

_ROWS = 50_000  # that are turned into text together


def is_parquet(path: str) -> bool:
    """Tell whether a file is a Parquet file, by its name."""
    return path.lower().endswith(".parquet")


def read_all(source: str | IO[bytes]) -> Any:
    """Read a Parquet file.

    Texts are in dictionaries. Raises InputError if pyarrow is not installed. Raises TableError if
    the file is no Parquet file.
    """
    return _open(source, with_dictionaries=True).read(use_threads=False)


def read_rows(path: str, start: int, end: int) -> Any:
    """Read some rows of a Parquet file, of which `end` is the one behind the last.

    Raises as `read_all` does.
    """
    import pyarrow as pa

    metadata = _open(path).metadata
    sizes = [metadata.row_group(group).num_rows for group in range(metadata.num_row_groups)]
    ends = list(accumulate(sizes))
    first, last = bisect_right(ends, start), bisect_left(ends, end)
    stamp = os.stat(path).st_mtime_ns  # noqa: PTH116
    groups = [_row_group(path, stamp, group) for group in range(first, last + 1)]
    above = ends[first] - sizes[first]
    return pa.concat_tables(groups).slice(start - above, end - start)


@lru_cache(maxsize=2)  # parts follow each other: one may begin in a group and end in the next
def _row_group(path: str, _stamp: int, group: int) -> Any:
    return _open(path, with_dictionaries=True).read_row_group(group, use_threads=False)


def as_csv(table: Any, name: str, above: int = 0) -> bytes:
    """Write rows as CSV, below their headings; numbers keep all their digits.

    Cells that are missing are empty. `above` counts the rows of the file above these. Raises
    TableError if a column holds more than a value a row, or durations under a unit that is not
    ``s``, or a text a line break.
    """
    import pyarrow as pa

    for index, column in enumerate(table.columns):
        if pa.types.is_nested(column.type):
            problem = f"column {table.field(index).name!r} holds {column.type}"
            raise TableError(problem, "leave it out, or give one value a row", source=name)
        if pa.types.is_dictionary(column.type):
            plain = column.cast(column.type.value_type)
            table = table.set_column(index, table.field(index).name, plain)
        if pa.types.is_duration(column.type):
            heading = table.field(index).name
            table = table.set_column(index, heading, _in_seconds(column, heading, name))
    for heading in table.column_names:
        _refuse_line_break(heading, "the heading", name, 1)
    try:
        return _text_of(table, "none")  # which the ordinary reader takes
    except pa.ArrowInvalid:  # a comma, a quote or the end of a line in a cell
        pass
    _refuse_line_breaks(table, name, above)
    try:
        return _text_of(table, "needed")
    except pa.ArrowInvalid:
        problem, remedy = "a text is not UTF-8", "write the file again in UTF-8"
        raise TableError(problem, remedy, source=name) from None


def _in_seconds(column: Any, heading: str, name: str) -> Any:
    """Durations as numbers of seconds: as text, they would be those of their own unit."""
    import pyarrow as pa
    import pyarrow.compute as pc

    if read_heading(heading).unit not in (None, "s"):
        problem = f"column {heading!r} holds {column.type}"
        raise TableError(problem, "write numbers, or leave the unit out", source=name)
    whole = column.cast(pa.duration("us"), safe=False).cast(pa.int64())
    return pc.divide(whole.cast(pa.float64(), safe=False), 1e6)


class CsvOfParquet(io.RawIOBase):
    r"""The rows of a Parquet file, which can be sought in, as a stream of CSV in bounded memory.

    Raises as `read_all` and `as_csv` do; of rows further down while it is read.

    Examples
    --------
    >>> import pyarrow as pa, pyarrow.parquet as pq
    >>> file = io.BytesIO()
    >>> pq.write_table(pa.table({"output": [1.25, None]}), file)
    >>> CsvOfParquet(file, "a.parquet").read()
    b'output\n1.25\n\n'
    """

    def __init__(self, source: IO[bytes], name: str) -> None:
        super().__init__()
        self._parts = self._texts(_open(source, name=name), name)
        self._rest = memoryview(b"")

    @staticmethod
    def _texts(file: Any, name: str) -> Iterator[bytes]:
        import pyarrow as pa

        yield as_csv(file.schema_arrow.empty_table(), name)
        above = 0
        for batch in file.iter_batches(_ROWS, use_threads=False):
            text = as_csv(pa.Table.from_batches([batch]), name, above)
            yield text[text.index(b"\n") + 1 :]  # without the headings
            above += len(batch)

    def readable(self) -> bool:
        """Tell that it can be read."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Fill a buffer as far as the rest of a part goes."""
        while not self._rest:
            part = next(self._parts, None)
            if part is None:
                return 0
            self._rest = memoryview(part)
        size = min(len(buffer), len(self._rest))
        buffer[:size], self._rest = self._rest[:size], self._rest[size:]
        return size


def _refuse_line_breaks(table: Any, name: str, above: int) -> None:
    """Refuse cells of several lines, as a row of the text would end in their midst."""
    from pyarrow import binary, types

    texts = (types.is_string, types.is_large_string, types.is_binary, types.is_large_binary)
    for heading, column in zip(table.column_names, table.columns, strict=True):
        if any(test(column.type) for test in texts):
            for line, cell in enumerate(column.cast(binary()).to_pylist(), above + 2):
                text = (cell or b"").decode("utf-8", "backslashreplace")
                _refuse_line_break(text, heading, name, line)


def _refuse_line_break(text: str, what: str, name: str, line: int) -> None:
    if "\n" in text or "\r" in text:
        problem = f"{what} {shown(text)} has a line break"
        raise TableError(problem, "write it in one line", source=name, line=line)


def _text_of(table: Any, quoting: str) -> bytes:
    from pyarrow import csv

    text = io.BytesIO()
    text.write(csv_text([table.column_names]).encode())
    csv.write_csv(table, text, csv.WriteOptions(include_header=False, quoting_style=quoting))
    return text.getvalue()


def headings_of(path: str) -> list[str]:
    """Names of the columns of a Parquet file.

    Raises as `read_all` does.
    """
    names: list[str] = _open(path).schema_arrow.names
    return names


def row_ranges(path: str, size: int, serial: int) -> Iterator[tuple[int, int]]:
    """Divide the rows of a Parquet file where its serial changes.

    `size` is about how many bytes a range holds as text, `serial` the index of its column.
    """
    file = _open(path, with_dictionaries=True)
    names = file.schema_arrow.names
    about = max(size // (10 * len(names)), 1)  # ten characters a cell
    start = at = 0
    last = None
    for batch in file.iter_batches(about, columns=[names[serial]], use_threads=False):
        serials = batch.column(0)
        for row in range(max(start + about, at), at + len(serials)):
            before = serials[row - at - 1].as_py() if row > at else last
            if serials[row - at].as_py() != before:  # the only one in a batch of so many rows
                yield start, row
                start = row
                break
        at += len(serials)
        last = serials[-1].as_py() if len(serials) else last
    if start < at:
        yield start, at


def _open(
    source: str | IO[bytes], *, with_dictionaries: bool = False, name: str | None = None
) -> Any:
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise not_installed("Parquet", "pyarrow", "parquet") from None
    try:
        file = pq.ParquetFile(source)
        if not with_dictionaries:
            return file
        return pq.ParquetFile(source, metadata=file.metadata, read_dictionary=_texts(file))
    except pa.ArrowInvalid as error:
        told = " ".join(str(error).split())
        name = name or (source if isinstance(source, str) else source.name)
        problem = f"no Parquet file ({told})"
        raise TableError(problem, "give one, or CSV", source=name) from None


def _texts(file: Any) -> list[str]:
    """Names of the columns of text."""
    from pyarrow import types

    text = (types.is_string, types.is_large_string)
    return [field.name for field in file.schema_arrow if any(test(field.type) for test in text)]
