"""Streams of samples as CSV: read block by block in bounded memory, however long they are.

A sheet of a workbook is read whole, as the text of its cells.

Above the samples stand header lines ``# key: value`` and one line of column headings: ``output``,
and as far as there are any ``temperature``, ``time``, ``a_p`` and ``a_o``; of a triad ``x``, ``y``,
``z`` and ``time``.
"""

from __future__ import annotations

import io
import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from itertools import compress
from typing import IO, Any, cast

import numpy as np

from accelcal.arrays import Array, Ints
from accelcal.errors import TableError
from accelcal.io.engines import BulkEngineGivesUp, decimal_mark, read_frame, split_rows
from accelcal.io.files.encodings import ENCODINGS, encoding_of, errors_of, note_of_encoding
from accelcal.io.files.parquet import CsvOfParquet
from accelcal.io.files.text import (
    PARQUET,
    WORKBOOKS,
    file_and_sheet,
    named_bytes,
    read_text,
    refuse_foreign,
    standard_input,
    unreadable,
    utf16_of,
)
from accelcal.io.layout.separators import split_line
from accelcal.io.samples.headings import (
    ACROSS_AXES,
    ONE_ACCELEROMETER,
    SampleHeadings,
    StreamForm,
    read_sample_headings,
    refuse_other_units,
)
from accelcal.io.values.cells import Column, numbers
from accelcal.io.words.vocabulary import is_missing, is_unit_of
from accelcal.units import canonical_unit, celsius, scale_of

BLOCK = 2_000_000
"""Characters of a block. A file that fits into one is read without pandas, as importing pandas
would take longer."""

_LONGEST_LINE = 1_000_000


@dataclass(frozen=True, slots=True, eq=False)
class SampleBlock:
    """Consecutive samples."""

    values: Mapping[str, Array]  # columns of numbers by role, NaN where a cell is missing
    time: Sequence[str] | None  # as written; None without such a column
    lines: Ints  # of each sample
    serials: Sequence[str] | None = None  # as written; None without such a column

    def of_serial(self, serial: str | None) -> SampleBlock:
        """Keep the samples of one serial number; all of them without such a column."""
        if self.serials is None or all(cell == serial for cell in self.serials):
            return self
        kept = np.array([cell == serial for cell in self.serials])
        values = {role: column[kept] for role, column in self.values.items()}
        time = None if self.time is None else list(compress(self.time, kept))
        return SampleBlock(values, time, self.lines[kept], list(compress(self.serials, kept)))


@dataclass(slots=True, eq=False)
class SampleReader:
    """A stream of samples, its headings read."""

    headings: SampleHeadings
    size: int | None  # bytes of the file; None where it is no file
    _text: io.TextIOBase
    _raw: IO[bytes]
    notes: tuple[str, ...] = ()
    others: Counter[str] = field(default_factory=Counter)  # samples of other serials, left out
    _serial: str | None = field(init=False, default=None)
    _line: int = field(init=False)
    _carry: str = field(init=False)
    _decimal: str = field(default=".", init=False)

    def __post_init__(self) -> None:
        self._line, self._carry = self.headings.line, self.headings.row

    @property
    def source(self) -> str:
        """Name of the file, ``"<stdin>"`` for standard input."""
        return self.headings.source

    def choose(self, serial: str | None, unit: str | None = None) -> None:
        """Take the samples of one serial number, with a unit for outputs whose headings name none.

        Raises TableError if the stream is of several, and none or one that it has not is chosen.
        """
        self.headings = self.headings.of_serial(serial, unit).in_unit(unit)
        self._serial = serial

    def position(self) -> int:
        """Bytes that were read of the file; 0 where it is no file."""
        return 0 if self.size is None else self._raw.tell()

    def blocks(self) -> Iterator[SampleBlock]:
        """Read the samples block by block, one sample or more.

        Raises TableError at the first cell that is no number, or where the file cannot be read on.
        """
        bulk = None
        samples = 0
        while text := self._read(BLOCK):
            if bulk is None:
                bulk = len(text) >= BLOCK // 2
                self._decimal = self._decimal_mark(text)
            whole = self._block_of(text, bulk=bulk)
            self._line += text.count("\n")
            block = whole.of_serial(self._serial)
            if block is not whole:
                self.others.update(cell for cell in whole.serials or () if cell != self._serial)
            samples += block.lines.size
            if block.lines.size:
                yield block
        if not samples and self.others:
            problem = f"no sample of serial {self._serial}, but of {', '.join(self.others)}"
            raise TableError(problem, "choose one of these by its serial", source=self.source)
        if not samples:
            problem, remedy = "column headings but no samples", "write a row for each sample"
            raise TableError(problem, remedy, source=self.source)

    def _read(self, characters: int) -> str:
        """Whole lines, each ended by a line feed; empty at the end."""
        piece = _guarded(self._text.read, characters, self.source)
        text = self._carry + piece
        if not piece:
            self._carry = ""
            return text + "\n" if text.strip() else ""
        whole, feed, self._carry = text.rpartition("\n")
        if len(self._carry) > _LONGEST_LINE:
            problem = f"a line of more than {_LONGEST_LINE} characters"
            raise TableError(problem, "give one sample a line", source=self.source, line=self._line)
        return whole + feed or self._read(characters)

    def _decimal_mark(self, text: str) -> str:
        separator, numeric = self.headings.layout.separator, self.headings.numeric.values()
        start = text[: text.rfind("\n", 0, 10_000)].split("\n")
        rows = [split_line(row, separator) for row in start if not _is_comment(row, separator)]
        cells = [row[i] for row in rows for i in numeric if i < len(row)]
        return decimal_mark(" ".join(cells), separator)

    # -- engines: pandas for bulk, and where it meets anything unusual the other one ---------------

    def _block_of(self, text: str, *, bulk: bool) -> SampleBlock:
        if bulk:
            with suppress(BulkEngineGivesUp):
                return self._by_pandas(text)
        return self._by_split(text)

    def _by_pandas(self, text: str) -> SampleBlock:
        """Read plain rows of numbers at once."""
        headings, layout = self.headings, self.headings.layout
        separator, last = layout.separator, len(layout.headings) - 1
        rows = text.count("\n")
        if separator is None or text.count(separator) != rows * last or not last:
            raise BulkEngineGivesUp
        blank = "\n" + separator * last + "\n"
        if '"' in text or "#" in text or blank in "\n" + text:
            raise BulkEngineGivesUp
        used, numeric = headings.columns.values(), headings.numeric.values()
        frame = read_frame(text.encode(), separator, last + 1, used, numeric, self._decimal)
        values = {role: frame[i].to_numpy() for role, i in headings.numeric.items()}
        if any(np.isinf(column).any() for column in values.values()):
            raise BulkEngineGivesUp
        if "temperature" in values:
            values["temperature"] = celsius(values["temperature"], headings.scale)
        texts = {role: frame[i].str.strip().tolist() for role, i in headings.texts.items()}
        return self._block(values, texts, self._line + np.arange(rows))

    def _by_split(self, text: str) -> SampleBlock:
        layout = self.headings.layout
        blank = ' \t"' + (layout.separator or "")
        lines, rows = [], []
        for line, row in enumerate(text.split("\n"), self._line):
            if _is_comment(row, layout.separator):
                self.headings.refuse_declaration(row, line)
            elif row.strip(blank):
                lines.append(line)
                rows.append(row)
        named = [i for i, heading in enumerate(layout.headings, 1) if heading.text]
        table = split_rows(layout._replace(rows=rows, lines=lines), max(named))
        where = np.array(lines, dtype=np.int64)
        columns = {r: [row[i] for row in table] for r, i in self.headings.numeric.items()}
        values = {r: numbers(self._column(r, own, where)) for r, own in columns.items()}
        texts = {role: [row[i] for row in table] for role, i in self.headings.texts.items()}
        return self._block(values, texts, where)

    def _block(
        self, values: Mapping[str, Array], texts: Mapping[str, list[str]], lines: Ints
    ) -> SampleBlock:
        if "unit" in texts:
            refuse_other_units(texts["unit"], lines, self.headings.output_unit, self.source)
        return SampleBlock(values, texts.get("time"), lines, texts.get("serial"))

    def _column(self, role: str, cells: list[str], lines: Ints) -> Column:
        heading = self.headings.layout.headings[self.headings.columns[role]].text
        kind = role if role in ("temperature", *ACROSS_AXES) else "output"
        unit = self.headings.units.get(kind)
        column = Column(role, heading, unit, cells, lines, self.source, self._decimal)
        bare = column.without_unit(partial(is_unit_of, kind))
        written = canonical_unit(bare.unit) if bare.unit else None
        of_scale = kind == "temperature" and scale_of(bare.unit) == self.headings.scale
        if written != unit and not (kind in ACROSS_AXES or of_scale):
            at = next(i for i, cell in enumerate(cells) if cell != bare.cells[i])
            remedy = f"write it in the heading, as {heading} [{bare.unit}]"
            raise column.refuse(at, "{} has a unit, and its heading has none", remedy)
        return bare


@contextmanager
def open_samples(
    source: str, form: StreamForm = ONE_ACCELEROMETER, unit: str | None = None
) -> Iterator[SampleReader]:
    r"""Open a stream of samples and read its headings.

    The source is the path of a CSV file, plain or gzip, of a Parquet file, or of a workbook, with
    the name of a sheet behind ``#`` where it has several; ``"-"`` is standard input. The unit of
    the outputs takes the place of that of a header line. Raises TableError if the file cannot be
    read or has no headings.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from pathlib import Path
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "a.csv")
    ...     count = path.write_text("# unit: mA\ntime,output\n0,1.25\n1,1.26\n")
    ...     with open_samples(str(path)) as samples:
    ...         [block.values["output"].tolist() for block in samples.blocks()]
    [[1.25, 1.26]]
    """
    raw = standard_input() if source == "-" else _opened(file_and_sheet(source)[0])
    name = "<stdin>" if source == "-" else source
    try:
        stream = _unpacked(raw)
        start = _guarded(stream.peek, 1, name)
        refuse_foreign(start, name)
        if start.startswith(WORKBOOKS):
            yield _of_workbook(_guarded(stream.read, -1, name), name, raw, form, unit)
            return
        of_parquet = start.startswith(PARQUET)
        if of_parquet:
            stream = _of_parquet(stream, raw, name)
            start = stream.peek(1)
        encoding = _encoding(start)
        is_other = encoding in ENCODINGS
        errors = errors_of(encoding) if is_other else "replace"
        text = io.TextIOWrapper(stream, encoding, errors=errors)
        readline = partial(_guarded, text.readline, _LONGEST_LINE, name)
        headings = read_sample_headings(readline, name, form, unit)
        is_file = source != "-" and raw.seekable() and not of_parquet
        size = os.fstat(raw.fileno()).st_size if is_file else None
        notes = (note_of_encoding(encoding),) if is_other else ()
        yield SampleReader(headings, size, text, raw, notes)
        text.detach()  # standard input stays open
    finally:
        if source != "-":
            raw.close()


def _of_workbook(
    content: bytes, name: str, raw: IO[bytes], form: StreamForm, unit: str | None
) -> SampleReader:
    sheet = read_text(named_bytes(content, name))
    text = io.StringIO(sheet.text)
    headings = read_sample_headings(text.readline, sheet.name, form, unit)
    return SampleReader(headings, None, text, raw, sheet.notes)


def _of_parquet(stream: io.BufferedReader, raw: IO[bytes], name: str) -> io.BufferedReader:
    """Rows of a Parquet file as CSV; what cannot be sought in, as standard input, is read whole."""
    file = stream if raw.seekable() else io.BytesIO(_guarded(stream.read, -1, name))
    return io.BufferedReader(CsvOfParquet(file, name), 1 << 16)


def _opened(path: str) -> IO[bytes]:
    try:
        return open(path, "rb", buffering=1 << 16)  # noqa: PTH123  (as in text)
    except (OSError, ValueError) as error:
        raise unreadable(error, path, "file") from None


def _unpacked(raw: Any) -> io.BufferedReader:
    stream = raw if hasattr(raw, "peek") else io.BufferedReader(raw)
    if stream.peek(2)[:2] == b"\x1f\x8b":
        import gzip

        stream = io.BufferedReader(gzip.GzipFile(fileobj=stream), 1 << 16)
    return cast("io.BufferedReader", stream)


def _guarded(read: Any, size: int, name: str) -> Any:
    """Read, and word what goes wrong with the file."""
    try:
        return read(size)
    except EOFError:
        problem, remedy = "the gzip compression is cut short", "copy the file again"
    except Exception as error:  # zlib.error is of no family
        problem, remedy = f"cannot be read on ({error})", "copy the file again"
    raise TableError(problem, remedy, source=name)


def _encoding(start: bytes) -> str:
    if wide := utf16_of(start):
        return wide
    try:
        start[: start.rfind(b"\n") + 1].decode("utf-8")
    except UnicodeDecodeError:
        return encoding_of(start)
    return "utf-8-sig"


def _is_comment(row: str, separator: str | None) -> bool:
    start = row.lstrip(' \t"')
    return start.startswith("#") and not is_missing(split_line(start, separator)[0])
