"""Streams of samples as CSV: read block by block in bounded memory, however long they are.

Above the samples stand header lines ``# key: value`` and one line of column headings: ``output``,
and as far as there are any ``temperature``, ``time``, ``a_p`` and ``a_o``.
"""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import IO, Any, cast

import numpy as np
from numpy.typing import NDArray

from accelcal.errors import TableError
from accelcal.io.cells import MISSING, Column, numbers
from accelcal.io.layout import shown, split_line
from accelcal.io.vocabulary import canonical_key, has_unit, read_heading, split_unit
from accelcal.units import canonical_unit

__all__ = ["BLOCK", "SampleBlock", "SampleReader", "open_samples"]

BLOCK = 2_000_000
"""Characters of a block. A file that fits into one is read without pandas, as importing pandas
would take longer."""

ROLES = ("output", "temperature", "time", "a_p", "a_o")
"""What a column may hold."""

_LONGEST_LINE = 1_000_000
_HEADINGS_REMEDY = "name the columns in the first row: output, and temperature where it is known"


@dataclass(frozen=True, slots=True, eq=False)
class SampleBlock:
    """Consecutive samples.

    Attributes
    ----------
    values : mapping of str to ndarray of float
        Columns of numbers by role, NaN where a cell is missing.
    time : sequence of str or None
        Times as written; None without such a column.
    lines : ndarray of int
        Line of each sample.
    """

    values: Mapping[str, NDArray[np.float64]]
    time: Sequence[str] | None
    lines: NDArray[np.int64]


@dataclass(slots=True, eq=False)
class SampleReader:
    """A stream of samples, its headings read.

    Attributes
    ----------
    source : str
        Name of the file, ``"<stdin>"`` for standard input.
    declared : mapping of str to str
        Header lines by canonical key.
    columns : mapping of str to int
        Index of the column of each role.
    units : mapping of str to str
        Unit of each role, where a heading or header line gives it.
    aside : tuple of str
        Headings of the columns that are not used.
    size : int or None
        Bytes of the file; None where it is no file.
    """

    source: str
    declared: Mapping[str, str]
    columns: Mapping[str, int]
    units: Mapping[str, str]
    aside: tuple[str, ...]
    size: int | None
    _headings: tuple[str, ...]
    _separator: str | None
    _line: int
    _text: io.TextIOBase
    _raw: IO[bytes]
    _carry: str = ""
    _decimal: str = field(default=".", init=False)

    def position(self) -> int:
        """Bytes that were read of the file; 0 where it is no file."""
        return 0 if self.size is None else self._raw.tell()

    def declared_temperature(self) -> float | None:
        """Temperature that a header line declares for all samples [degC]."""
        text = self.declared.get("temperature", "").removesuffix("degC").strip()
        if text.casefold() in MISSING:
            return None
        try:
            return float(text)
        except ValueError:
            problem, remedy = f"temperature is {shown(text)}", "give it as a number in degC"
            raise TableError(problem, remedy, source=self.source) from None

    def blocks(self) -> Iterator[SampleBlock]:
        """Read the samples block by block.

        Yields
        ------
        SampleBlock
            Samples, one or more.

        Raises
        ------
        TableError
            At the first cell that is no number, or where the file cannot be read on.
        """
        bulk = None
        samples = 0
        while text := self._read(BLOCK):
            if bulk is None:
                bulk = len(text) >= BLOCK // 2
                self._decimal = self._decimal_mark(text)
            block = (self._by_pandas(text) if bulk else None) or self._by_split(text)
            self._line += text.count("\n")
            samples += block.lines.size
            if block.lines.size:
                yield block
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
        start = text[:10_000]
        return "," if self._separator != "," and start.count(",") > start.count(".") else "."

    # -- engines: pandas for bulk, and where it meets anything unusual the other one ---------------

    def _by_pandas(self, text: str) -> SampleBlock | None:
        """Read plain rows of numbers at once; None where something else may stand in them."""
        separator, width = self._separator, len(self._headings)
        rows = text.count("\n")
        if separator is None or text.count(separator) != rows * (width - 1) or width == 1:
            return None
        blank = "\n" + separator * (width - 1) + "\n"
        if '"' in text or "#" in text or blank in "\n" + text:
            return None
        import pandas as pd

        try:
            frame = pd.read_csv(io.StringIO(text), **self._pandas_options(pd.__version__))
        except ValueError:
            return None
        values = {role: frame[i].to_numpy() for role, i in self._numeric().items()}
        if len(frame) != rows or any(np.isinf(column).any() for column in values.values()):
            return None
        time = frame[self.columns["time"]].str.strip().tolist() if "time" in self.columns else None
        return SampleBlock(values, time, self._line + np.arange(rows))

    def _pandas_options(self, version: str) -> dict[str, Any]:
        numeric = list(self._numeric().values())
        blank = sorted(MISSING | {text.upper() for text in MISSING} | {"NaN"})
        options = {
            "sep": self._separator,
            "header": None,
            "names": list(range(len(self._headings))),
            "index_col": False,
            "usecols": list(self.columns.values()),
            "dtype": {i: np.float64 if i in numeric else object for i in self.columns.values()},
            "decimal": self._decimal,
            "keep_default_na": False,
            "na_values": dict.fromkeys(numeric, blank),
            "quoting": 3,  # csv.QUOTE_NONE
            "skip_blank_lines": False,
        }
        if tuple(map(int, version.split(".")[:2])) < (3, 1):  # later ones have no other converter
            options["float_precision"] = "round_trip"
        return options

    def _by_split(self, text: str) -> SampleBlock:
        blank = ' \t"' + (self._separator or "")
        lines, rows = [], []
        for line, row in enumerate(text.split("\n"), self._line):
            if row.strip(blank) and not _is_comment(row, self._separator):
                lines.append(line)
                rows.append(self._cells(row, line))
        where = np.array(lines, dtype=np.int64)
        values = {
            role: numbers(self._column(role, [row[i] for row in rows], where))
            for role, i in self._numeric().items()
        }
        time = [row[self.columns["time"]] for row in rows] if "time" in self.columns else None
        return SampleBlock(values, time, where)

    def _cells(self, row: str, line: int) -> list[str]:
        cells, width = split_line(row, self._separator), len(self._headings)
        while len(cells) > width and not cells[-1]:
            cells.pop()
        if len(cells) != width:
            problem = f"{len(cells)} field{'s' if len(cells) > 1 else ''} under {width} headings"
            remedy = "write every field, nothing between the separators where one is missing"
            raise TableError(problem, remedy, source=self.source, line=line)
        return cells

    def _column(self, role: str, cells: list[str], lines: NDArray[np.int64]) -> Column:
        heading = self._headings[self.columns[role]]
        return Column(role, heading, None, cells, lines, self.source, self._decimal)

    def _numeric(self) -> dict[str, int]:
        return {role: index for role, index in self.columns.items() if role != "time"}


@contextmanager
def open_samples(source: str) -> Iterator[SampleReader]:
    r"""Open a stream of samples and read its headings.

    Parameters
    ----------
    source : str
        Path of a CSV file, plain or gzip; ``"-"`` is standard input.

    Yields
    ------
    SampleReader
        The stream, at its first sample.

    Raises
    ------
    TableError
        If the file cannot be read or has no headings.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from pathlib import Path
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "a.csv")
    ...     count = path.write_text("# unit: mA\ntime,output\n0,1.25\n1,1.26\n")
    ...     with open_samples(str(path)) as samples:
    ...         [block.values["output"].tolist() for block in samples.blocks()], samples.units
    ([[1.25, 1.26]], {'output': 'mA'})
    """
    raw = sys.stdin.buffer if source == "-" else _opened(source)
    name = "<stdin>" if source == "-" else source
    try:
        stream = _unpacked(raw)
        encoding = _encoding(_guarded(stream.peek, 1, name))
        text = io.TextIOWrapper(stream, encoding, errors="replace")
        yield _with_headings(text, raw, name)
        text.detach()  # standard input stays open
    finally:
        if source != "-":
            raw.close()


def _opened(path: str) -> IO[bytes]:
    try:
        return open(path, "rb", buffering=1 << 16)  # noqa: PTH123  (as in text)
    except FileNotFoundError:
        problem, remedy = "no such file", "give the path of a file, or - for standard input"
    except (OSError, ValueError) as error:
        problem = f"cannot be read ({getattr(error, 'strerror', None) or error})"
        remedy = "give a file that can be read"
    raise TableError(problem, remedy, source=path)


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
    if start.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    if b"\0" in start[:2]:
        return "utf-16-be" if start[0] == 0 else "utf-16-le"
    try:
        start[: start.rfind(b"\n") + 1].decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8-sig"


def _is_comment(row: str, separator: str | None) -> bool:
    start = row.lstrip(' \t"')
    return start.startswith("#") and split_line(start, separator)[0].casefold() not in MISSING


# -- headings --------------------------------------------------------------------------------------


def _with_headings(text: io.TextIOWrapper, raw: IO[bytes], name: str) -> SampleReader:
    declared: dict[str, str] = {}
    commented = ""
    line = 0
    while row := _guarded(text.readline, _LONGEST_LINE, name):
        line += 1
        bare = row.strip(' \t\r\n"')
        if bare.startswith("#"):
            commented = bare.lstrip("# ")
            declared |= _declaration(commented)
        elif bare.strip(",;"):
            break
    else:
        raise TableError("no samples", _HEADINGS_REMEDY, source=name)
    above = "output" not in _roles(bare) and "output" in _roles(commented)
    headings, separator = _split_headings(commented if above else bare)
    columns = _columns(headings, name, line)
    return SampleReader(
        source=name,
        declared=declared,
        columns=columns,
        units=_units(headings, columns, declared, name, line),
        aside=tuple(h for i, h in enumerate(headings) if i not in columns.values()),
        size=os.fstat(raw.fileno()).st_size if name != "<stdin>" else None,
        _headings=headings,
        _separator=separator,
        _line=line if above else line + 1,  # headings in a comment, as numpy.savetxt writes them
        _text=text,
        _raw=raw,
        _carry=row if above else "",
    )


def _declaration(text: str) -> dict[str, str]:
    key, _, value = text.partition(":")
    name, unit = split_unit(key.strip())
    known = canonical_key(name)
    return {known: f"{value.strip()} {unit}".strip()} if known and value else {}


def _split_headings(line: str) -> tuple[tuple[str, ...], str | None]:
    """Headings, split by the separator that gives the most known ones."""
    options: list[str | None] = [mark for mark in ("\t", ";", ",") if mark in line]
    if not options and _role(line):
        return (line,), ","
    options = options or [None]
    split = {mark: tuple(split_line(line, mark)) for mark in options}
    best = max(options, key=lambda mark: sum(_role(cell) is not None for cell in split[mark]))
    return split[best], best


def _roles(line: str) -> set[str | None]:
    return {_role(cell) for cell in _split_headings(line)[0]} if line else set()


def _role(heading: str) -> str | None:
    name = split_unit(heading.strip())[0].casefold()
    role = name if name in ("a_p", "a_o") else read_heading(heading).role
    return role if role in (*ROLES, "serial") else None


def _columns(headings: Sequence[str], name: str, line: int) -> dict[str, int]:
    columns: dict[str, int] = {}
    for index, heading in enumerate(headings):
        role = _role(heading)
        if role in columns:
            problem = f"columns {shown(headings[columns[role]])} and {shown(heading)} mean the same"
            raise TableError(problem, "keep one and rename the other", source=name, line=line)
        if role == "serial":
            problem, remedy = "a column serial", "give the samples of one accelerometer a file"
            raise TableError(problem, remedy, source=name, line=line)
        if role:
            columns[role] = index
    if "output" not in columns:
        problem = f"no column output among {shown(', '.join(headings))}"
        raise TableError(problem, _HEADINGS_REMEDY, source=name, line=line)
    return columns


def _units(
    headings: Sequence[str],
    columns: Mapping[str, int],
    declared: Mapping[str, str],
    name: str,
    line: int,
) -> dict[str, str]:
    units = {
        role: unit
        for role, index in columns.items()
        if (unit := read_heading(headings[index]).unit or split_unit(headings[index])[1])
    }
    warmth = units.get("temperature")
    if warmth and not has_unit("temperature", warmth):
        problem = f"temperature in {warmth}"
        raise TableError(problem, "give it in degC", source=name, line=line)
    given = {canonical_unit(u) for u in (declared.get("unit"), units.get("output")) if u}
    if len(given) > 1:
        problem = f"units {' and '.join(sorted(given))} for one output"
        raise TableError(problem, "name one unit", source=name, line=line)
    return {**units, "output": given.pop()} if given else units
