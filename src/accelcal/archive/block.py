"""The work of a batch: a block of files in, rows out, encoded or handed over as a file.

A block is what a worker takes at a time, a process here or one of a cluster; it knows nothing of
the others.
"""

from __future__ import annotations

import pickle
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np

from accelcal.archive.columns import LAWS, ROWS, Columns
from accelcal.archive.fitting import fit_records
from accelcal.archive.formats import encode
from accelcal.archive.parts import Part
from accelcal.archive.reading import Failure, Found, read_files, read_part
from accelcal.archive.settings import Settings
from accelcal.archive.sources import SourceFile
from accelcal.effects.catalogue import brought_along
from accelcal.errors import InputError

Rows = TypeVar("Rows", Columns, bytes)


class Block(NamedTuple):
    """What a worker takes at a time."""

    files: tuple[SourceFile, ...]
    part: Part | None = None  # what to read of the only file; None reads it whole
    place: int = 0  # among the blocks of a batch

    def __reduce__(self) -> tuple[Any, ...]:
        """Travel in columns, which are packed in a tenth of the time that files take one by one."""
        return _of_columns, (*self[1:], *zip(*self.files, strict=True))


def _of_columns(part: Part | None, place: int, *columns: Sequence[Any]) -> Block:
    return Block(tuple(map(SourceFile._make, zip(*columns, strict=True))), part, place)


class Told(NamedTuple):
    """What a block tells besides its rows."""

    errors: tuple[tuple[str, str], ...]  # source and message of what could not be read or fitted
    fitted: int  # records
    failed: int  # records that failed a data sheet
    warned: int  # records whose gates warn
    # serial numbers of its records, each once; of a part of a table that of each stretch of rows
    serials: tuple[str, ...]


class Outcome(NamedTuple, Generic[Rows]):
    """What comes of a block: rows of the two frames, and all else."""

    tables: Rows  # cells by column, or encoded
    laws: Rows
    told: Told


def work(block: Block, settings: Settings, form: str) -> Outcome[bytes]:
    """Read, fit and encode a block."""
    found = fit_block(block, settings)
    tables, laws = encode(found.tables, ROWS, form), encode(found.laws, LAWS, form)
    return Outcome(tables, laws, found.told)


def fit_block(block: Block, settings: Settings) -> Outcome[Columns]:
    """Read and fit a block.

    Rows are in the order of the files, and within a file in that of its serials and runs.
    """
    keep_freed_memory()
    stretches: tuple[str, ...] = ()
    if block.part is None:
        read = list(read_files(block.files, settings.overrides))
    else:
        read, stretches = read_part(block.files[0], block.part, settings.overrides)
    found = [item for item in read if isinstance(item, Found)]
    serials = stretches or tuple(dict.fromkeys(i.record.serial for i in found if i.record.serial))
    with brought_along(*settings.effects):
        fitted = fit_records([item.record for item in found], settings)
    errors = [item for item in read if isinstance(item, Failure)]
    errors += [
        Failure(found[place].file, found[place].record.source, told)
        for place, told in sorted(fitted.failures.items())
    ]
    said = tuple((e.source, e.message) for e in sorted(errors, key=lambda e: e.file))
    count = len(found) - len(fitted.failures)
    told = Told(said, count, fitted.failed, fitted.warned, serials)
    return Outcome(fitted.tables, fitted.laws, told)


_LARGEST = 2**25 - 2**14
"""Bytes of the largest array that glibc learns from, and its own few."""


@cache
def keep_freed_memory(*, in_large_pages: bool = True) -> None:
    """Let glibc keep the memory of arrays that are freed, up to 64 MB.

    glibc gives memory back as soon as twice as much lies free as the largest array took that was
    ever freed. The next array gets pages that the system fills with zeros first, which took nearly
    a tenth of the time of a worker. So a large array is freed here, of which no page is ever
    touched. A second one is then a part of what glibc keeps, and numpy asks the system to fill such
    arrays by large pages, which takes a worker half as long; a process that fills few of them is
    faster without. Other allocators are none the wiser.
    """
    for _ in range(1 + in_large_pages):
        np.empty(_LARGEST, dtype=np.uint8)


def fit_to_file(block: Block, settings: Settings, folder: str) -> str:
    """Read and fit a block, and put its rows into a file, which `from_file` takes up.

    Raises InputError if it cannot be written, mostly for want of room.
    """
    fitted = fit_block(block, settings)
    try:
        with NamedTemporaryFile(dir=folder, delete=False) as file:
            pickle.dump(fitted, file)
    except OSError as error:
        raise InputError(
            f"{folder}: finished rows cannot be kept there: {error.strerror or error}; make room,"
            " or set TMPDIR to another folder"
        ) from None
    return file.name


def from_file(path: str) -> Outcome[Columns]:
    """Take up a file of `fit_to_file`, and remove it."""
    found: Outcome[Columns] = pickle.loads(Path(path).read_bytes())
    Path(path).unlink()
    return found
