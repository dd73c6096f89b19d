"""The work of a batch: a block of files in, records fitted plan by plan, rows out.

A block is what a worker takes at a time, a process here or one of a cluster; it knows nothing of
the others.
"""

from __future__ import annotations

import pickle
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np

from accelcal.archive.failures import attempt, one_line
from accelcal.archive.formats import LAWS, ROWS, Columns, FrameColumn, encode, no_rows, put_together
from accelcal.archive.parts import Failure, Found, Part, read_files, read_part
from accelcal.archive.settings import Settings
from accelcal.archive.sources import SourceFile
from accelcal.archive.stacked_rows import how_many_warn, stacked_laws, stacked_tables, verdicts_of
from accelcal.arrays import Labels, Places
from accelcal.calibrate.fit import calibrate_many
from accelcal.calibrate.stack import CalibrationStack
from accelcal.effects.catalogue import brought_along
from accelcal.errors import InputError
from accelcal.record import TumbleRecord

_AT_A_TIME = 2**19
"""Readings that are fitted together: a block of small files, but a part of a large table."""


class FittedRecords(NamedTuple):
    """Rows of the records of a block, in the order of the records."""

    tables: Columns
    laws: Columns
    failures: Mapping[int, str]  # place of a record that was not fitted -> the line that tells why
    failed: int  # records that failed a data sheet
    warned: int  # records whose gates warn


class _Piece(NamedTuple):
    """Rows of some records, each with the place of its record."""

    tables: Columns
    of_table: Places
    laws: Columns
    of_law: Places
    warned: int
    failed: int = 0


def fit_records(records: Sequence[TumbleRecord], settings: Settings) -> FittedRecords:
    """Fit records, and judge them where there is a data sheet."""
    failures: dict[int, str] = {}
    pieces = [
        piece
        for places in _parts(records)
        for piece in _pieces(records, places, settings, failures)
    ]
    return FittedRecords(
        _merged([(piece.tables, piece.of_table) for piece in pieces], ROWS),
        _merged([(piece.laws, piece.of_law) for piece in pieces], LAWS),
        failures,
        sum(piece.failed for piece in pieces),
        sum(piece.warned for piece in pieces),
    )


def _parts(records: Sequence[TumbleRecord]) -> Iterator[range]:
    """Places of records that follow each other and have few enough readings."""
    start = readings = 0
    for place, record in enumerate(records):
        if place > start and readings + len(record) > _AT_A_TIME:
            yield range(start, place)
            start, readings = place, 0
        readings += len(record)
    yield range(start, len(records))


def _pieces(
    records: Sequence[TumbleRecord],
    places: Sequence[int],
    settings: Settings,
    failures: dict[int, str],
) -> Iterator[_Piece]:
    """Rows of some of the records, those of one plan together."""
    own = [records[i] for i in places]
    if not own:
        return
    many = attempt(own[0].source, calibrate_many, own, settings.options)
    if isinstance(many, str):
        yield from _one_by_one(records, places, settings, failures, many)
        return
    failures |= {places[i]: one_line(error) for i, error in many.failures.items()}
    for rows, stack in many.stacks:
        some = [places[i] for i in rows.tolist()]
        piece = attempt(records[some[0]].source, _of_stack, stack, some, settings)
        if isinstance(piece, _Piece):
            yield piece
        else:
            yield from _one_by_one(records, some, settings, failures, piece)


def _one_by_one(
    records: Sequence[TumbleRecord],
    places: Sequence[int],
    settings: Settings,
    failures: dict[int, str],
    told: str,
) -> Iterator[_Piece]:
    """Rows of records of which one, or a bug, is in the way of all; of one it is told."""
    if len(places) == 1:
        failures[places[0]] = told
        return
    for place in places:
        yield from _pieces(records, [place], settings, failures)


def _of_stack(stack: CalibrationStack, places: Sequence[int], settings: Settings) -> _Piece:
    count = len(stack.tables)
    tables, (laws, record) = stacked_tables(stack), stacked_laws(stack)
    of_table, of_law = np.repeat(places, count), np.array(places)[record]
    warned = how_many_warn(stack)
    if settings.specification is None:
        return _Piece(tables, of_table, laws, of_law, warned)
    judged = verdicts_of(stack, tables, settings.specification)
    record = np.repeat(np.arange(len(stack)), count)
    tables = tables | {name: Labels(record, cells) for name, cells in judged.items()}
    return _Piece(tables, of_table, laws, of_law, warned, judged["verdict"].count("fail"))


def _merged(parts: Sequence[tuple[Columns, Places]], kinds: Mapping[str, FrameColumn]) -> Columns:
    """Put rows in the order of their records."""
    if not parts:
        return no_rows(kinds)
    if len(parts) == 1:
        return parts[0][0]
    places = np.concatenate([own for _, own in parts])
    return put_together([columns for columns, _ in parts], np.argsort(places, kind="stable"))


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
