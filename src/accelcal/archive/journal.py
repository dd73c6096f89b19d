"""The journal of a batch: every finished block on disk, so that a kill loses nothing.

The journal is a folder beside the results. Each block is one file in it, named by a digest of all
that decides its rows: paths, sizes and times of its files, the options, the version of accelcal.
A file appears there whole or not at all; nobody waits for the disk, and a checksum tells when a
power cut has spoilt it. The results are drafted there too, from the blocks in
their order, a block in memory at a time; in the end they take their names, and the journal goes.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import shutil
import zlib
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from functools import reduce
from pathlib import Path
from typing import IO

from accelcal.archive.block import Block, Outcome, Told, keep_freed_memory, work
from accelcal.archive.formats import LAWS, ROWS, open_frame, results
from accelcal.archive.lock import alone_in
from accelcal.archive.settings import Settings
from accelcal.archive.sources import is_url
from accelcal.atomic import open_atomically, replacing
from accelcal.errors import InputError

_SUFFIX = ".block"


class Journal:
    """Finished blocks of one batch, in a folder: how they were fitted and encoded."""

    def __init__(self, folder: Path, settings: Settings, form: str) -> None:
        self.folder, self.settings, self.form = folder, settings, form
        self._common = "\0".join([settings.fingerprint(), form, *Told._fields])

    def path(self, block: Block) -> Path:
        """File of a block."""
        files = [f"{file.path}\0{file.size}\0{file.stamp}" for file in block.files]
        text = "\0".join([self._common, *files, repr(block.part)])
        digest = hashlib.sha256(text.encode("utf-8", "backslashreplace")).hexdigest()
        return self.folder / f"{digest[:40]}{_SUFFIX}"

    def keep(self, block: Block, outcome: Outcome[bytes]) -> None:
        """Put a finished block on disk, whole or not at all."""
        head = {"bytes": [len(outcome.tables), len(outcome.laws)], **outcome.told._asdict()}
        content = json.dumps(head).encode() + b"\n", outcome.tables, outcome.laws
        with self.refusals_told(), replacing(self.path(block), to_disk=False) as file:
            file.write(_checksum(*content) + b"\n")
            file.writelines(content)

    @staticmethod
    def has(path: Path) -> bool:
        """Tell whether the block of a file is finished, and as it was when it was kept."""
        try:
            checksum, _, content = path.read_bytes().partition(b"\n")
        except OSError:
            return False
        return checksum == _checksum(content)

    @staticmethod
    def finished(path: Path) -> Outcome[bytes]:
        """What came of a finished block."""
        with path.open("rb") as file:
            file.readline()  # the checksum
            head = json.loads(file.readline())
            tables, laws = map(file.read, head["bytes"])
        errors = tuple((source, message) for source, message in head["errors"])
        serials = tuple(head["serials"])
        told = Told(errors, head["fitted"], head["failed"], head["warned"], serials)
        return Outcome(tables, laws, told)

    @contextmanager
    def draft(self, name: str) -> Iterator[IO[bytes]]:
        """Open a result that nobody sees until `publish`; what a kill leaves goes with the rest."""
        with self.refusals_told():
            file = self._draft(name).open("wb")
        try:
            yield file
            with self.refusals_told():
                file.flush()
        finally:
            with suppress(OSError):  # of what a full disk has refused, which is told by now
                file.close()

    @contextmanager
    def refusals_told(self) -> Iterator[None]:
        """Say in one line what the disk refuses."""
        try:
            yield
        except OSError as error:
            raise InputError(
                f"{self.folder}: the results cannot be written: {error.strerror or error}; make"
                " room, and go on with resume=True"
            ) from error

    def publish(self, drafts: Mapping[str, str]) -> None:
        """Let drafts appear under their paths, each whole, in their order, and remove the rest."""
        with self.refusals_told():
            _bring_to_disk([self._draft(name) for name in drafts])
        for name, path in drafts.items():
            _take_name(self._draft(name), path)
        for block in list(self._blocks()):
            block.unlink()

    def remains(self) -> int:
        """Count the blocks to go on with."""
        return sum(1 for _ in self._blocks())

    def clear(self) -> None:
        """Remove what is of no use without blocks."""
        for path in (*self.folder.glob("draft-*"), *self.folder.glob("*.tmp")):
            path.unlink(missing_ok=True)

    def _blocks(self) -> Iterator[Path]:
        return self.folder.glob(f"*{_SUFFIX}")

    def _draft(self, name: str) -> Path:
        return self.folder / f"draft-{name}"


def _checksum(*content: bytes) -> bytes:
    return b"%08x" % reduce(lambda checksum, part: zlib.crc32(part, checksum), content, 0)


def _bring_to_disk(files: Sequence[Path]) -> None:
    """Wait until the disk has files, for all at once."""

    def bring(path: Path) -> None:
        with path.open("r+b") as file:
            os.fsync(file.fileno())

    with ThreadPoolExecutor(len(files)) as threads:
        deque(threads.map(bring, files), maxlen=0)


def _take_name(draft: Path, path: str) -> None:
    target = Path(path).resolve()
    try:
        if target.exists():
            draft.chmod(target.stat().st_mode & 0o777)
        draft.replace(target)
    except OSError as error:
        if error.errno != errno.EXDEV:
            raise
        with draft.open("rb") as file, open_atomically(path) as copy:  # to another file system
            shutil.copyfileobj(file, copy)


@contextmanager
def open_journal(output: str, settings: Settings, form: str, *, resume: bool) -> Iterator[Journal]:
    """Open the journal of a batch, for one thread of one process at a time.

    It is beside the output and stays on disk until `publish`. Raises InputError if an interrupted
    batch left one and `resume` is false, another process uses it, or it cannot be made.
    """
    target = Path(output).resolve()
    folder = target.with_name(f"{target.name}.journal")
    journal = Journal(folder, settings, form)
    with ExitStack() as alone:
        with _refusals_told(folder, output):
            for name in results(output).values():
                _require_writable(Path(name).resolve(), name)
            alone.enter_context(alone_in(folder, output))
        if journal.remains() and not resume:
            raise InputError(
                f"{output}: an interrupted batch left its finished part in {folder.name}; add"
                " resume=True to go on with it, or delete that folder to start anew"
            )
        try:
            yield journal
        finally:
            if not journal.remains():
                journal.clear()


@contextmanager
def _refusals_told(folder: Path, output: str) -> Iterator[None]:
    """Say in one line what cannot be made."""
    try:
        yield
    except OSError as error:
        raise InputError(
            f"{output}: the results, or the folder {folder.name} beside them, cannot be made"
            f" ({error.strerror}); remove what is in the way, or choose another name"
        ) from None


def _require_writable(target: Path, output: str) -> None:
    if is_url(output):
        raise InputError(f"{output} is a URL; name a file on this machine for the results")
    if target.is_dir():
        raise InputError(f"{output} is a folder; name a file in it")
    if target.exists() and not target.is_file():
        raise InputError(f"{output} is a device or a pipe; name a file")
    if not target.parent.is_dir():
        raise InputError(f"{output}: its folder does not exist; create it or choose another")
    writable = os.access(target.parent, os.W_OK) and (
        not target.exists() or os.access(target, os.W_OK)
    )
    if not writable:
        raise InputError(
            f"{output}: the file or its folder is not writable; change that or choose another"
        )


def work_and_keep(block: Block, journal: Journal) -> None:
    """Read and fit a block, and put it into the journal.

    So works a process of this machine. Its rows would be long on the way to another process, and
    that one would wait for ever if it were killed meanwhile.
    """
    journal.keep(block, work(block, journal.settings, journal.form))


class GrowingResults:
    """Keeps finished blocks in a journal, and lets frames grow by their rows as their turn comes.

    The frames take the encoded rows of the tables, and those of the laws.
    """

    def __init__(self, journal: Journal, frames: Sequence[Callable[[bytes], object]]) -> None:
        self.told: list[Told] = []  # of the blocks whose rows are taken, in their order
        self.resumed = 0  # blocks that were finished already
        self.outdated = False  # whether rows were taken of blocks that are done anew
        self._journal = journal
        self._frames = frames
        self._paths: list[Path] = []  # of all blocks that are expected
        self._finished: set[int] = set()

    def expect(self, block: Block) -> bool:
        """As of `Keeper`."""
        path = self._journal.path(block)
        if block.place < len(self._paths):
            self._paths[block.place] = path
            self.outdated = True
        else:
            self._paths.append(path)
        finished = self._journal.has(path)
        if finished:
            self.resumed += 1
            self._finish(block)
        return finished

    def keep(self, block: Block, outcome: Outcome[bytes] | None) -> None:
        """Keep a finished block; None is one that its worker has put into the journal."""
        if outcome is not None:
            self._journal.keep(block, outcome)
        self._finish(block)

    def serials(self, block: Block) -> Sequence[str]:
        """As of `Keeper`."""
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

    All blocks that are expected are finished when the context ends.
    """
    keep_freed_memory(in_large_pages=False)
    with ExitStack() as opened:
        files = [opened.enter_context(journal.draft(name)) for name in ("tables", "laws")]
        with journal.refusals_told():
            frames = [
                _written_early(opened.enter_context(open_frame(kinds, journal.form, file)), file)
                for kinds, file in zip((ROWS, LAWS), files, strict=True)
            ]
        try:
            yield GrowingResults(journal, frames)
        except BaseException:
            with suppress(Exception):  # a full disk refuses the end of a file as well
                opened.close()
            raise
        with journal.refusals_told():
            opened.close()


def _written_early(add: Callable[[bytes], object], file: IO[bytes]) -> Callable[[bytes], object]:
    """Let the disk write the rows of a frame as they come, or all would wait for it at the end."""
    if not hasattr(os, "posix_fadvise"):
        return add
    begun = 0

    def add_and_begin(part: bytes) -> None:
        nonlocal begun
        add(part)
        file.flush()
        end = file.tell()
        if end > begun:  # Linux begins to write what it is told to forget
            with suppress(OSError):  # some file systems take no advice
                os.posix_fadvise(file.fileno(), begun, end - begun, os.POSIX_FADV_DONTNEED)
            begun = end

    return add_and_begin
