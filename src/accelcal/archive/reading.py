"""From the files of a block to records, each with the file that it comes from."""

from __future__ import annotations

import gzip
import io
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any, NamedTuple

from accelcal.archive.columns import ERRORS, LAWS, ROWS
from accelcal.archive.failures import attempt
from accelcal.archive.sources import SourceFile, is_url, read_bytes
from accelcal.io.ordinary import read_ordinary
from accelcal.io.tables import read_tables
from accelcal.record import TumbleRecord

__all__ = ["Failure", "Found", "read_block"]


_OWN = "{}: results of accelcal batch, not a table of readings; leave the file out"
_OWN_HEADINGS = tuple(",".join(list(names)[:4]).encode() for names in (ROWS, LAWS, ERRORS))


class Found(NamedTuple):
    """A record of a block.

    Attributes
    ----------
    file : int
        Index of its file in the block.
    record : TumbleRecord
        The record.
    """

    file: int
    record: TumbleRecord


class Failure(NamedTuple):
    """What could not be read or fitted.

    Attributes
    ----------
    file : int
        Index of the file in the block.
    source, message : str
        Its path, and the line that tells why.
    """

    file: int
    source: str
    message: str


def read_block(
    files: tuple[SourceFile, ...], overrides: Mapping[str, Any]
) -> Iterator[Found | Failure]:
    """Read the files of a block.

    Parameters
    ----------
    files : tuple of SourceFile
        What to read.
    overrides : mapping of str to object
        Declarations that win over the header lines.

    Yields
    ------
    Found or Failure
        The records of each file in its order, or why it could not be read.
    """
    contents = [attempt(file.path, read_bytes, file.path) for file in files]
    whole = [i for i, content in enumerate(contents) if isinstance(content, bytes)]
    ordinary = read_ordinary([(files[i].path, contents[i]) for i in whole], overrides)  # type: ignore[misc]
    read = dict(zip(whole, ordinary, strict=True))
    for index, file in enumerate(files):
        records: tuple[TumbleRecord, ...] | str | None = read.get(index)
        if records is None:
            records = attempt(file.path, _read, file.path, overrides)
        if isinstance(records, str):
            own = _is_result(contents[index])
            yield Failure(index, file.path, _OWN.format(file.path) if own else records)
        else:
            yield from (Found(index, record) for record in records)


def _is_result(content: bytes | str) -> bool:
    """Tell whether the content of a file is a result of another batch; a text tells of none."""
    if isinstance(content, str):
        return False
    if content.startswith(b"\x1f\x8b"):
        with suppress(OSError, EOFError):
            content = gzip.GzipFile(fileobj=io.BytesIO(content)).read(100)
    return content.startswith(_OWN_HEADINGS)


def _read(path: str, overrides: Mapping[str, Any]) -> tuple[TumbleRecord, ...]:
    """Read a file out of the ordinary by the general reader, which has the words for its faults."""
    if not is_url(path):
        return read_tables(path, overrides=overrides)
    content = io.BytesIO(read_bytes(path))
    content.name = path  # where a file has its name, for messages
    return read_tables(content, overrides=overrides)
