"""From the files of a block to records; large tables go a part at a time.

A part begins where a serial begins and ends where one ends. A serial whose rows come back further
down the file would be fitted from half its readings: it is refused wherever it stands.
"""

from __future__ import annotations

import csv
import re
from codecs import BOM_UTF8
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import accumulate, groupby
from operator import itemgetter
from typing import IO, Any, NamedTuple

import numpy as np

from accelcal.archive.failures import attempt, one_line
from accelcal.archive.sources import SourceFile, is_url, read_bytes
from accelcal.errors import InputError, TableError
from accelcal.io.files.parquet import (
    as_csv,
    headings_of,
    is_parquet,
    read_all,
    read_rows,
    row_ranges,
)
from accelcal.io.files.text import named_bytes, read_text
from accelcal.io.ordinary.reader import Content, ordinary_head, read_arrow, read_ordinary
from accelcal.io.sound_serials import SoundSerials, read_sound, sound_serials
from accelcal.record import TumbleRecord

LARGE = 2**24
"""Bytes from which on a table of many serials is read in parts."""

PART = 2**23
"""Bytes of a part, and then to the end of its last serial."""

_PACKED = 4  # times that Parquet is smaller than text, about

_HEAD = 2**16  # bytes that the header lines and headings may take


class Part(NamedTuple):
    """A part of a table."""

    start: int  # bytes of the file, or rows of a Parquet file
    end: int
    skipped: int  # rows above it
    refused: tuple[str, ...] = ()  # serials that are not to be used, as they are elsewhere too


def divide(source: SourceFile) -> list[Part]:
    """Divide a large table of many serials; there are no parts where it is to be read whole."""
    if source.size < LARGE // _PACKED:  # as nearly all
        return []
    parquet = is_parquet(source.path)
    if is_url(source.path) or not (parquet or source.size >= LARGE):
        return []
    divided = _parts_of_parquet if parquet else _parts_of_csv
    parts = attempt(source.path, lambda: list(divided(source.path)))
    return [] if isinstance(parts, str) else parts  # what is wrong is told when it is read whole


def part_content(path: str, part: Part) -> tuple[Content, int]:
    """Read a part, below the headings of its table; with it comes the index of the serial.

    Raises OSError if the file cannot be read.
    """
    if is_parquet(path):
        data = as_csv(read_rows(path, part.start, part.end), path, part.start)
        head = data[: data.index(b"\n") + 1]
    else:
        with open(path, "rb") as file:  # noqa: PTH123
            head = _head(file)[0]
            file.seek(part.start)
            data = head + file.read(part.end - part.start)
    roles = ordinary_head(data[: len(head) + _HEAD])
    assert roles is not None
    return Content(path, data, part.skipped), roles[1].index("serial")


class Stretch(NamedTuple):
    """Rows of one serial that follow each other."""

    serial: str
    line: int  # of the file, with the first of them
    content: Content  # the rows below the headings


def stretches(content: Content, column: int) -> Iterator[Stretch]:
    """Divide a part by its serials, which stand in a column."""
    lines = content.data.removeprefix(BOM_UTF8).splitlines(keepends=True)
    above = next(i for i, line in enumerate(lines) if not line.startswith(b"#")) + 1
    head, skipped = b"".join(lines[:above]), content.skipped or 0
    owners: Iterator[bytes] = accumulate(
        (_serial(line, column) for line in lines[above:]),
        lambda before, own: own or before,  # other rows go with the serial above them
    )
    for serial, rows in groupby(zip(owners, lines[above:], strict=True), key=itemgetter(0)):
        body = [line for _, line in rows]
        own = Content(content.name, head + b"".join(body), skipped)
        yield Stretch(serial.decode("utf-8", "replace"), above + skipped + 1, own)
        skipped += len(body)


def comes_back(serials: Iterable[str]) -> set[str]:
    """Serials that stand in several places.

    Examples
    --------
    >>> comes_back(["A", "B", "A"])
    {'A'}
    """
    names = list(serials)
    if len(set(names)) == len(names):  # as nearly always
        return set()
    return {serial for serial, count in Counter(names).items() if count > 1}


def _head(file: IO[bytes]) -> tuple[bytes, tuple[str, ...]]:
    found = ordinary_head(file.read(_HEAD))
    assert found is not None  # or the table would not have been divided
    return found


def _parts_of_parquet(path: str) -> Iterator[Part]:
    names = headings_of(path)
    found = ordinary_head((",".join(names) + "\n1\n").encode())
    if found is not None and "serial" in found[1] and len(found[1]) == len(names):
        for start, end in row_ranges(path, PART, found[1].index("serial")):
            yield Part(start, end, start)


def _parts_of_csv(path: str) -> Iterator[Part]:
    with open(path, "rb") as file:  # noqa: PTH123
        found = ordinary_head(file.read(_HEAD))
        if found is not None and "serial" in found[1]:
            file.seek(len(found[0]))
            yield from _parts_below(file, found[1].index("serial"))


def _parts_below(file: IO[bytes], column: int) -> Iterator[Part]:
    start, skipped = file.tell(), 0
    while chunk := file.read(PART):
        last = chunk[chunk.rfind(b"\n") + 1 :] + file.readline()
        _refuse_lone_returns(chunk, last)
        serial, rows, end = _serial(last, column), _line_ends(chunk) + bool(last), file.tell()
        for line in file:
            if _serial(line, column) not in (serial, b""):
                break
            _refuse_lone_returns(line)
            rows, end = rows + 1, end + len(line)
        yield Part(start, end, skipped)
        start, skipped = end, skipped + rows
        file.seek(start)


def _refuse_lone_returns(*texts: bytes) -> None:
    """Refuse to divide where a carriage return alone ends a line, as only the reader counts it."""
    for text in texts:
        if b"\r" in text and re.search(rb"\r(?!\n|\Z)", text):
            raise InputError("a carriage return alone ends a line; read the table whole")


def _line_ends(text: bytes) -> int:
    """Count line ends; that of bytes takes longer where they are many."""
    return int(np.count_nonzero(np.frombuffer(text, dtype=np.uint8) == ord("\n")))


def _serial(line: bytes, column: int) -> bytes:
    """Serial of a row; empty where the line is none."""
    cells = line.split(b",", column + 1)
    if b'"' in line:
        with suppress(csv.Error):  # of a cell longer than any
            (row,) = csv.reader([line.decode("utf-8", "surrogateescape")])
            cells = [cell.encode("utf-8", "surrogateescape") for cell in row]
    return b"" if line.startswith(b"#") or len(cells) <= column else cells[column].strip()


Records = tuple[TumbleRecord, ...]

_SCATTERED = (
    "{}:{}: serial {!r} stands in several places of a large table; sort the rows by serial, or give"
    " each accelerometer a file"
)


class Found(NamedTuple):
    """A record of a block."""

    file: int  # index of its file in the block
    record: TumbleRecord


class Failure(NamedTuple):
    """What could not be read or fitted."""

    file: int  # index of the file in the block
    source: str  # its path
    message: str  # the line that tells why


def read_files(
    files: Sequence[SourceFile], overrides: Mapping[str, Any]
) -> Iterator[Found | Failure]:
    """Read the files of a block: their records, and why a file or a serial could not be read."""
    ordinary = attempt("", read_ordinary, map(_content, files), overrides)
    if isinstance(ordinary, str):  # a bug, which the general reader need not have
        ordinary = [None] * len(files)
    for index, (file, read) in enumerate(zip(files, ordinary, strict=True)):
        again = attempt(file.path, _read, file.path, overrides) if read is None else read
        yield from _found(index, file.path, again)


def _content(file: SourceFile) -> Content:
    """Content of a file; nothing where it cannot be read, which the general reader tells."""
    try:
        content = read_bytes(file.path, file.size)
        if not is_parquet(file.path):
            return Content(file.path, content)
        rows = read_all(named_bytes(content, file.path))
        return Content(file.path, as_csv(rows, file.path), file=content)
    except Exception:  # whatever it is
        return Content(file.path, b"")


def read_part(
    file: SourceFile, part: Part, overrides: Mapping[str, Any]
) -> tuple[list[Found | Failure], tuple[str, ...]]:
    """Read a part of a large table; with it comes the serial of each stretch of its rows."""
    records = attempt(file.path, _read_at_once, file.path, part, overrides)
    if isinstance(records, tuple):
        return _found(0, file.path, records), tuple(str(r.serial) for r in records)
    whole = attempt(file.path, part_content, file.path, part) if records is None else records
    if isinstance(whole, str):
        return [Failure(0, file.path, whole)], ()
    content, column = whole
    pieces = list(stretches(content, column))
    ordinary = read_ordinary([piece.content for piece in pieces], overrides)
    found: list[Found | Failure] = []
    for piece, read in zip(pieces, ordinary, strict=True):
        again: Records | SoundSerials | str | None = read
        if piece.serial in part.refused:
            again = _SCATTERED.format(file.path, piece.line, piece.serial)
        elif again is None:
            again = attempt(file.path, _read_stretch, piece.content, overrides)
        found += _found(0, file.path, again)
    return found, tuple(piece.serial for piece in pieces)


def _read_at_once(path: str, part: Part, overrides: Mapping[str, Any]) -> Records | None:
    """Records of an ordinary part; None where its serials are to be read one by one."""
    if part.refused:
        return None
    if is_parquet(path):
        records = read_arrow(path, read_rows(path, part.start, part.end), part.skipped, overrides)
        if records is not None:
            return records
    return read_ordinary([part_content(path, part)[0]], overrides)[0]


def _found(index: int, path: str, read: Records | SoundSerials | str) -> list[Found | Failure]:
    if isinstance(read, str):
        return [Failure(index, path, read)]
    records, faults = read if isinstance(read, SoundSerials) else (read, ())
    found = [Found(index, record) for record in records]
    return [*found, *(Failure(index, path, one_line(fault)) for fault in faults)]


def _read_stretch(piece: Content, overrides: Mapping[str, Any]) -> SoundSerials:
    skipped = piece.skipped or 0
    try:
        text = read_text(named_bytes(piece.data, piece.name))
    except TableError as error:
        line = None if error.line is None else error.line + skipped
        raise TableError(error.problem, error.remedy, source=piece.name, line=line) from None
    text = text._replace(sha256=None, skipped=skipped)
    return sound_serials(text, overrides)


def _read(path: str, overrides: Mapping[str, Any]) -> SoundSerials:
    """Read a file out of the ordinary by the general reader, which has the words for its faults."""
    return read_sound(named_bytes(read_bytes(path), path) if is_url(path) else path, overrides)
