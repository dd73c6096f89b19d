"""Files are written whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

from accelcal.errors import InputError

__all__ = ["write_atomically"]


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
    try:
        target = Path(path).resolve()
        if target.is_dir():
            raise InputError(f"{path} is a folder; name a file in it")
        if target.exists() and not target.is_file():
            target.write_bytes(data)  # /dev/null or a pipe: nothing there to replace
        else:
            _replace(target, data)
    except OSError as error:
        raise InputError(f"{path} cannot be written: {_reason(error)}") from error


def _replace(target: Path, data: bytes) -> None:
    if target.exists() and not os.access(target, os.W_OK):
        raise PermissionError
    temporary = target.with_name(f".accelcal-{os.urandom(8).hex()}.tmp")
    try:
        with temporary.open("xb") as file:
            if target.exists():
                temporary.chmod(target.stat().st_mode & 0o777)
            file.write(data)
            file.flush()
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
        case _:
            return f"{error.strerror or error}; choose another place"
