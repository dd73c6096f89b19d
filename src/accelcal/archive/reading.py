"""From the files of a block to records, each with the file that it comes from."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from accelcal.archive.failures import attempt, one_line
from accelcal.archive.parts import Part, part_content, stretches
from accelcal.archive.sources import SourceFile, is_url, read_bytes
from accelcal.errors import TableError
from accelcal.io.files.parquet import as_csv, is_parquet, read_all, read_rows
from accelcal.io.files.text import named_bytes, read_text
from accelcal.io.ordinary.reader import Content, read_arrow, read_ordinary
from accelcal.io.sound_serials import SoundSerials, read_sound, sound_serials
from accelcal.record import TumbleRecord

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
