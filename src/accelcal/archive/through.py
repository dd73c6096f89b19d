"""Through an archive: blocks of files, worked on by whoever is there, until all are kept."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain, count, groupby, islice
from typing import Any, Protocol, TypeVar

from accelcal.archive.block import Block, Outcome, from_file
from accelcal.archive.formats import Columns
from accelcal.archive.parts import comes_back, divide
from accelcal.archive.sources import SourceFile, Sources
from accelcal.archive.workers import completed, processors, workers
from accelcal.io.ordinary.cell_blocks import read_engine

Result = TypeVar("Result")
Kept = TypeVar("Kept", contravariant=True)

Progress = Callable[[int, int], None]
"""Is told the number of files, or of parts of large ones, that are done, and that of all, which
grows where a table proves to be a large one."""

MOST_FILES = 1000
"""Files of a block, in a large archive."""

LEAST_FILES = 25
"""Files of a block, in a small archive."""

LAST_FILES = 500
"""Files of the last blocks of a large archive: workers who end at one time leave none idle."""

BLOCKS = 8
"""Blocks that a small archive is divided into."""

MOST_BYTES = 2**24
"""Bytes of a block; a larger file is a block of its own."""


class Keeper(Protocol[Kept]):
    """Who keeps the results of blocks."""

    def expect(self, block: Block) -> bool:
        """Take note of the next block, or of one done anew; tell whether it is finished already."""

    def keep(self, block: Block, outcome: Kept) -> None:
        """Keep a finished block."""

    def serials(self, block: Block) -> Sequence[str]:
        """Serial of each stretch of rows, where a finished block is a part of a table."""


class InMemory:
    """Keeps the results of blocks in memory."""

    def __init__(self) -> None:
        self._results: dict[int, Outcome[Columns]] = {}

    @property
    def results(self) -> list[Outcome[Columns]]:
        """Results in the order of the blocks."""
        return [self._results[place] for place in sorted(self._results)]

    def expect(self, _: Block) -> bool:
        """None is finished already."""
        return False

    def keep(self, block: Block, outcome: Outcome[Columns] | str) -> None:
        """Keep a finished block; a text is the file in which its worker has put it."""
        self._results[block.place] = from_file(outcome) if isinstance(outcome, str) else outcome

    def serials(self, block: Block) -> Sequence[str]:
        """As of `Keeper`."""
        return self._results[block.place].told.serials


def blocks_of(sources: Sources) -> Iterator[Block]:
    """Divide files into blocks, in the same way whoever works on them.

    A block is files that follow each other, measured as it is asked for, or a part of a large
    table.
    """
    files: list[SourceFile] = []
    size, place, most = 0, count(), 0
    for left, source in zip(range(len(sources), 0, -1), sources, strict=True):
        parts = divide(source)
        if files and (parts or len(files) == most or size + source.size > MOST_BYTES):
            yield Block(tuple(files), place=next(place))
            files, size = [], 0
        if parts:
            yield from (Block((source,), part, next(place)) for part in parts)
        else:
            most = most if files else _most_files(len(sources), left)
            files.append(source)
            size += max(source.size, 0)
    if files:
        yield Block(tuple(files), place=next(place))


def _most_files(total: int, left: int) -> int:
    """Files of the next block: half of those that are left, where these are few."""
    most = min(max(-(-total // BLOCKS), LEAST_FILES), MOST_FILES)
    return min(most, max(-(-left // 2), LAST_FILES))


def work_through(
    sources: Sources,
    function: Callable[[Block], Result],
    keeper: Keeper[Result],
    *,
    jobs: int | None,
    dask: str | None = None,
    tell: Progress | None,
) -> None:
    """Work through the blocks of some files until all of them are kept.

    A block that is finished is forgotten, or a million files would fill the memory. The function
    travels to the workers. Parts of a table in which serials are scattered are done anew: they
    refuse these.
    """
    parts = _work(blocks_of(sources), function, keeper, jobs, dask, _Tally(len(sources), tell))
    anew = list(_refusing(parts, keeper))
    _work(anew, function, keeper, jobs, dask, _Tally(len(anew), None))


class _Tally:
    """Counts what is done, and tells of it."""

    def __init__(self, files: int, tell: Progress | None) -> None:
        self._done, self._total, self._tell = 0, files, tell
        self._parted = ""

    def found(self, block: Block) -> None:
        """Count the parts of a table, which was one file before."""
        if block.part is not None:
            path = block.files[0].path
            self._total += path == self._parted
            self._parted = path

    def finished(self, block: Block) -> None:
        """Count the files of a block."""
        self._done += len(block.files)

    def tell(self) -> None:
        """Tell how far the work is."""
        if self._tell:
            self._tell(self._done, self._total)


def _work(
    blocks: Iterable[Block],
    function: Callable[[Block], Result],
    keeper: Keeper[Result],
    jobs: int | None,
    dask: str | None,
    tally: _Tally,
) -> list[Block]:
    """Work on blocks while others are still looked for; return those that are parts of a table."""
    parts: list[Block] = []

    def unfinished() -> Iterator[Block]:
        for block in blocks:
            if block.part is not None:
                parts.append(block)
            tally.found(block)
            if keeper.expect(block):
                tally.finished(block)
            else:
                yield block

    left = unfinished()
    most = int(jobs or processors())
    first = list(islice(left, most))
    tally.tell()
    if first:
        read_engine()  # processes that are forked from this one have it then
        with workers(min(most, len(first)), dask) as (executor, ready):
            for block, result in completed(executor, function, chain(first, left), ready):
                keeper.keep(block, result)
                tally.finished(block)
                tally.tell()
    return parts


def _refusing(parts: Sequence[Block], keeper: Keeper[Any]) -> Iterator[Block]:
    """Let the parts of a table refuse the serials that stand in several places of it."""
    for _, group in groupby(parts, key=lambda block: block.files[0].path):
        serials = [(block, keeper.serials(block)) for block in group]
        scattered = comes_back(name for _, names in serials for name in names)
        for block, names in serials:
            refused = tuple(sorted(scattered.intersection(names)))
            if refused and block.part is not None:
                yield block._replace(part=block.part._replace(refused=refused))
