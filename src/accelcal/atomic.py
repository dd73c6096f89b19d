"""Files are written whole or not at all."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from accelcal.errors import InputError
from accelcal.escapes import ESCAPED, ended


def write_atomically(path: str | os.PathLike[str], data: bytes) -> None:
    """Write a file so that nobody ever meets half of it.

    Parameters
    ----------
    path : str or path-like
        File to write. An existing file is replaced and keeps its permissions; a symbolic link
        stays a link. A device or a pipe is written straight through.
    data : bytes
        All of its content.

    Raises
    ------
    InputError
        If the folder is missing or not writable, if `path` is a folder or a write-protected file,
        or if the write fails. An existing file is then as it was.

    Notes
    -----
    The data go to a temporary file in the same folder, to the disk, and then to their name in one
    step of the file system.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     write_atomically(f"{folder}/a.json", b"{}")
    ...     Path(folder, "a.json").read_bytes()
    b'{}'
    """
    with open_atomically(path) as file:
        file.write(data)


def write_text(path: str | os.PathLike[str], text: str) -> None:
    r"""Write a text as UTF-8, as `write_atomically` does.

    A line feed is added at its end where there is none. A foreign byte of a file name becomes its
    escape.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     write_text(f"{folder}/a.csv", "M\udcfcller,1")
    ...     Path(folder, "a.csv").read_bytes()
    b'M\\xfcller,1\n'
    """
    write_atomically(path, ended(text).encode("utf-8", errors=ESCAPED))


@contextmanager
def open_atomically(path: str | os.PathLike[str]) -> Iterator[IO[bytes]]:
    """Open a file so that it gets its content at the end of the block, or not at all.

    When the block raises, what was written vanishes. An OSError of the block is taken for one of
    writing.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     with open_atomically(f"{folder}/a.csv") as file:
    ...         count = file.write(b"1,2")
    ...     Path(folder, "a.csv").read_bytes()
    b'1,2'
    """
    try:
        target = Path(path)
        if target.is_dir():
            raise InputError(f"{os.fspath(path) or repr('')} is a folder; name a file in it")
        if target.exists() and not target.is_file():
            with target.open("wb") as file:  # /dev/null or a pipe: nothing there to replace
                yield file
        else:
            with replacing(Path(os.path.realpath(target))) as file:
                yield file
    except OSError as error:
        raise InputError(f"{path} cannot be written: {_reason(error)}") from error


@contextmanager
def replacing(target: Path, *, to_disk: bool = True) -> Iterator[IO[bytes]]:
    """Open a file as `open_atomically` does, and leave the words for what fails to the caller.

    The target is itself no link. It may wait until the disk has it: without, a power cut may spoil
    it; a kill never does.
    """
    if target.exists() and not os.access(target, os.W_OK):
        raise PermissionError
    temporary = target.with_name(f".accelcal-{os.urandom(8).hex()}.tmp")
    try:
        with temporary.open("xb") as file:
            if target.exists():
                temporary.chmod(target.stat().st_mode & 0o777)
            yield file
            file.flush()
            if to_disk:
                os.fsync(file.fileno())
        temporary.replace(target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _reason(error: OSError) -> str:
    match error:
        case FileNotFoundError() | NotADirectoryError():
            return "its folder does not exist; create the folder or choose another"
        case PermissionError():
            return "the file or its folder is not writable; change that or choose another folder"
        case OSError(errno=errno.ENOSPC | errno.EDQUOT):
            return f"{error.strerror}; make room, or choose another place"
        case _:
            return f"{error.strerror or error}; choose another place"
