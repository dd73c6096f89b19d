"""Results that grow while blocks are finished, so that little is left to be done in the end."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager

from accelcal.archive.block import Block, Outcome, work
from accelcal.archive.columns import LAWS, ROWS
from accelcal.archive.formats import open_frame
from accelcal.archive.journal import Journal, Summary
from accelcal.archive.memory import keep_freed_memory
from accelcal.archive.settings import Settings

__all__ = ["GrowingResults", "growing_results", "work_and_keep"]


def work_and_keep(block: Block, journal: Journal, settings: Settings, form: str) -> None:
    """Read and fit a block, and put it into the journal.

    So works a process of this machine. Its rows would be long on the way to another process, and
    that one would wait for ever if it were killed meanwhile.

    Parameters
    ----------
    block : Block
        Files to read.
    journal : Journal
        Where to keep it.
    settings : Settings
        How to fit.
    form : str
        One of `accelcal.archive.formats.FORMS`.
    """
    journal.keep(block, work(block, settings, form))


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
    order : list of Block
        The blocks in the order of their rows, as far as they are known.
    told : dict of Block to Summary
        What the blocks tell whose rows are taken, in the same order.
    """

    def __init__(self, journal: Journal, frames: Sequence[Callable[[bytes], object]]) -> None:
        self.order: list[Block] = []
        self.told: dict[Block, Summary] = {}
        self._journal = journal
        self._frames = frames
        self._finished: set[Block] = set()

    def expect(self, block: Block) -> bool:
        """Take note of the next block; tell whether it is finished already."""
        self.order.append(block)
        finished = self._journal.has(block)
        if finished:
            self._finished.add(block)
            self._grow()
        return finished

    def keep(self, block: Block, outcome: Outcome | None) -> None:
        """Keep a finished block; None is one that its worker has put into the journal."""
        if outcome is not None:
            self._journal.keep(block, outcome)
        self._finished.add(block)
        self._grow()

    def serials(self, block: Block) -> Sequence[str]:
        """Serial of each stretch of rows, where a finished block is a part of a table."""
        return self.told[block].serials

    def _grow(self) -> None:
        """Take the rows of the next blocks, up to the first that is not finished."""
        while len(self.told) < len(self.order) and self.order[len(self.told)] in self._finished:
            block = self.order[len(self.told)]
            told, rows = self._journal.finished(block)
            with self._journal.refusals_told():
                for add, part in zip(self._frames, rows, strict=True):
                    add(part)
            self.told[block] = told


@contextmanager
def growing_results(journal: Journal, form: str) -> Iterator[GrowingResults]:
    """Draft the frames of tables and laws in a journal.

    Parameters
    ----------
    journal : Journal
        The journal.
    form : str
        One of `accelcal.archive.formats.FORMS`.

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
                opened.enter_context(open_frame(kinds, form, file))
                for kinds, file in zip((ROWS, LAWS), files, strict=True)
            ]
        yield GrowingResults(journal, frames)
        with journal.refusals_told():
            opened.close()
