"""Results that grow while blocks are finished, so that little is left to be done in the end."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

from accelcal.archive.block import Block, Outcome, Told, keep_freed_memory, work
from accelcal.archive.columns import LAWS, ROWS
from accelcal.archive.formats import open_frame
from accelcal.archive.journal import Journal


def work_and_keep(block: Block, journal: Journal) -> None:
    """Read and fit a block, and put it into the journal.

    So works a process of this machine. Its rows would be long on the way to another process, and
    that one would wait for ever if it were killed meanwhile.
    """
    journal.keep(block, work(block, journal.settings, journal.form))


class GrowingResults:
    """Keeps finished blocks in a journal, and lets frames grow by their rows as their turn comes.

    Parameters
    ----------
    journal : Journal
        The journal.
    frames : sequence of callable
        Take the encoded rows of the tables, and those of the laws.

    Attributes
    ----------
    told : list of Told
        What the blocks tell whose rows are taken, in their order.
    outdated : bool
        Whether rows were taken of blocks that are done anew.
    """

    def __init__(self, journal: Journal, frames: Sequence[Callable[[bytes], object]]) -> None:
        self.told: list[Told] = []
        self.outdated = False
        self._journal = journal
        self._frames = frames
        self._paths: list[Path] = []  # of all blocks that are expected
        self._finished: set[int] = set()

    def expect(self, block: Block) -> bool:
        """Take note of the next block, or of one done anew; tell whether it is finished already."""
        path = self._journal.path(block)
        if block.place < len(self._paths):
            self._paths[block.place] = path
            self.outdated = True
        else:
            self._paths.append(path)
        finished = self._journal.has(path)
        if finished:
            self._finish(block)
        return finished

    def keep(self, block: Block, outcome: Outcome[bytes] | None) -> None:
        """Keep a finished block; None is one that its worker has put into the journal."""
        if outcome is not None:
            self._journal.keep(block, outcome)
        self._finish(block)

    def serials(self, block: Block) -> Sequence[str]:
        """Serial of each stretch of rows, where a finished block is a part of a table."""
        return self.told[block.place].serials

    def take_all(self, before: GrowingResults) -> None:
        """Take the rows of all blocks that others have expected, which are finished."""
        for path in before._paths:
            self._take(path)

    def _finish(self, block: Block) -> None:
        """Take the rows of the next blocks, up to the first that is not finished."""
        self._finished.add(block.place)
        while len(self.told) in self._finished:
            self._finished.remove(len(self.told))
            self._take(self._paths[len(self.told)])

    def _take(self, path: Path) -> None:
        found = self._journal.finished(path)
        with self._journal.refusals_told():
            for add, part in zip(self._frames, (found.tables, found.laws), strict=True):
                add(part)
        self.told.append(found.told)


@contextmanager
def growing_results(journal: Journal) -> Iterator[GrowingResults]:
    """Draft the frames of tables and laws in a journal.

    Yields
    ------
    GrowingResults
        Who keeps the blocks; all that it expects are finished when the context ends.
    """
    keep_freed_memory()
    with ExitStack() as opened:
        files = [opened.enter_context(journal.draft(name)) for name in ("tables", "laws")]
        with journal.refusals_told():
            frames = [
                opened.enter_context(open_frame(kinds, journal.form, file))
                for kinds, file in zip((ROWS, LAWS), files, strict=True)
            ]
        yield GrowingResults(journal, frames)
        with journal.refusals_told():
            opened.close()
