"""The work of a batch: a block of files in, the encoded rows out.

A block is what a worker takes at a time, a process here or one of a cluster; it knows nothing of
the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from accelcal.archive.cells import Columns
from accelcal.archive.columns import LAWS, ROWS
from accelcal.archive.fitting import fit_records
from accelcal.archive.formats import encode
from accelcal.archive.memory import keep_freed_memory
from accelcal.archive.parts import Part
from accelcal.archive.reading import Failure, Found, read_files, read_part
from accelcal.archive.settings import Settings
from accelcal.archive.sources import SourceFile
from accelcal.effects.catalogue import brought_along


class Block(NamedTuple):
    """What a worker takes at a time.

    Attributes
    ----------
    files : tuple of SourceFile
        Files to read.
    part : Part or None
        The part to read of the only file; None reads it whole.
    place : int
        Its place among the blocks of a batch.
    """

    files: tuple[SourceFile, ...]
    part: Part | None = None
    place: int = 0

    def __reduce__(self) -> tuple[Any, ...]:
        """Travel in columns, which are packed in a tenth of the time that files take one by one."""
        return _of_columns, (*self[1:], *zip(*self.files, strict=True))


def _of_columns(part: Part | None, place: int, *columns: Sequence[Any]) -> Block:
    return Block(tuple(map(SourceFile._make, zip(*columns, strict=True))), part, place)


class Fitted(NamedTuple):
    """Rows of a block.

    Attributes
    ----------
    tables, laws : mapping of str to Labels or ndarray
        Cells by column.
    errors : tuple of tuple of str
        Source and message of what could not be read or fitted.
    fitted : int
        Number of records that were fitted.
    failed : int
        Number of records that failed a data sheet.
    serials : tuple of str
        Where the block is a part of a table, the serial of each stretch of its rows.
    """

    tables: Columns
    laws: Columns
    errors: tuple[tuple[str, str], ...]
    fitted: int
    failed: int
    serials: tuple[str, ...] = ()


class Outcome(NamedTuple):
    """What a worker gives back.

    Attributes
    ----------
    tables, laws : bytes
        Rows of the two frames, encoded.
    errors, fitted, failed, serials
        As of `Fitted`.
    """

    tables: bytes
    laws: bytes
    errors: tuple[tuple[str, str], ...]
    fitted: int
    failed: int
    serials: tuple[str, ...] = ()


def work(block: Block, settings: Settings, form: str) -> Outcome:
    """Read, fit and encode a block.

    Parameters
    ----------
    block : Block
        Files to read.
    settings : Settings
        How to fit.
    form : str
        One of `accelcal.archive.formats.FORMS`.

    Returns
    -------
    Outcome
        The encoded rows.
    """
    found = fit_block(block, settings)
    tables, laws = encode(found.tables, ROWS, form), encode(found.laws, LAWS, form)
    return Outcome(tables, laws, *found[2:])


def fit_block(block: Block, settings: Settings) -> Fitted:
    """Read and fit a block.

    Parameters
    ----------
    block : Block
        Files to read.
    settings : Settings
        How to fit.

    Returns
    -------
    Fitted
        Rows in the order of the files, and within a file in that of its serials and runs.
    """
    keep_freed_memory()
    serials: tuple[str, ...] = ()
    if block.part is None:
        read = list(read_files(block.files, settings.overrides))
    else:
        read, serials = read_part(block.files[0], block.part, settings.overrides)
    failures = [item for item in read if isinstance(item, Failure)]
    with brought_along(*settings.effects):
        found = rows_of([item for item in read if isinstance(item, Found)], failures, settings)
    return found._replace(serials=serials)


def rows_of(found: Sequence[Found], failures: Sequence[Failure], settings: Settings) -> Fitted:
    """Fit the records of a block.

    Parameters
    ----------
    found : sequence of Found
        The records.
    failures : sequence of Failure
        What could not be read.
    settings : Settings
        How to fit.

    Returns
    -------
    Fitted
        Their rows.
    """
    fitted = fit_records([item.record for item in found], settings)
    errors = [
        *failures,
        *(
            Failure(found[place].file, found[place].record.source, told)
            for place, told in sorted(fitted.failures.items())
        ),
    ]
    told = tuple((e.source, e.message) for e in sorted(errors, key=lambda e: e.file))
    count = len(found) - len(fitted.failures)
    return Fitted(fitted.tables, fitted.laws, told, count, fitted.failed)
