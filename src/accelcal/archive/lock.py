"""A folder of work that one thread of one process has at a time."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from pathlib import Path

from accelcal.errors import InputError

_LOCK = "lock"
_TRIES = 100

_IN_USE: dict[Path, object] = {}  # folders of this process -> marks of the threads that have them


@contextmanager
def alone_in(folder: Path, output: str) -> Iterator[None]:
    """Make a folder and keep others out of it; in the end it goes if nothing is left in it.

    The output is what is made there, for the words of a refusal. Raises InputError if somebody else
    is in it, OSError if it cannot be made.

    The lock is one of the system on a file in the folder, and goes with the process, however that
    ends. Who has the lock removes the file. Another process that has opened it before is left with
    the lock of a file that nobody else can meet: it sees that, and takes the one that is there now.
    """
    with _only_thread(folder, output), ExitStack() as end:
        end.callback(_remove_empty, folder)
        end.enter_context(_lock(folder, output))
        end.callback(_remove_lock, folder)
        yield


@contextmanager
def _only_thread(folder: Path, output: str) -> Iterator[None]:
    """Keep other threads out, with which this one shares the locks of the process."""
    mark = object()
    if _IN_USE.setdefault(folder, mark) is not mark:
        raise _in_use(output)
    try:
        yield
    finally:
        del _IN_USE[folder]


def _lock(folder: Path, output: str) -> AbstractContextManager[object]:
    try:
        import fcntl
    except ImportError:  # not on this system
        folder.mkdir(exist_ok=True)
        return nullcontext()
    for _ in range(_TRIES):
        with suppress(FileExistsError):  # exist_ok looks what is there, which may go meanwhile
            folder.mkdir()
        with suppress(FileNotFoundError), ExitStack() as opened:
            file = opened.enter_context((folder / _LOCK).open("wb"))
            try:
                fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except (BlockingIOError, PermissionError):  # others tell of disks that have no locks
                raise _in_use(output) from None
            if os.path.samestat(os.fstat(file.fileno()), (folder / _LOCK).stat()):
                return opened.pop_all()
    raise _in_use(output)


def _remove_lock(folder: Path) -> None:
    """Remove the lock, which this process has still, where nothing else is left."""
    with suppress(OSError):
        if [path.name for path in folder.iterdir()] == [_LOCK]:
            (folder / _LOCK).unlink()


def _remove_empty(folder: Path) -> None:
    with suppress(OSError):  # there is something to go on with, or somebody else is in it by now
        folder.rmdir()


def _in_use(output: str) -> InputError:
    return InputError(
        f"{output}: another accelcal batch is writing it; wait for it or choose another file"
    )
