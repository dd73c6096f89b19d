"""Which files are results of a batch: they are no tables of readings, and may be written anew."""

from __future__ import annotations

import gzip
import io
from contextlib import suppress
from pathlib import Path

from accelcal.archive.columns import ERRORS, LAWS, ROWS
from accelcal.errors import InputError
from accelcal.io.parquet import headings_of, is_parquet

__all__ = ["is_result", "may_be_replaced"]

_HEADINGS = tuple(",".join(list(names)[:4]).encode() for names in (ROWS, LAWS, ERRORS))
_BEGINNING = 2**12


def is_result(content: bytes) -> bool:
    r"""Tell whether the content of a file is a result of a batch.

    Parameters
    ----------
    content : bytes
        The content, or its beginning.

    Returns
    -------
    bool
        True where it is.

    Examples
    --------
    >>> is_result(b"source,message\n"), is_result(b"temperature,position")
    (True, False)
    """
    if content.startswith(b"\x1f\x8b"):
        with suppress(OSError, EOFError):
            content = gzip.GzipFile(fileobj=io.BytesIO(content)).read(100)
    return content.startswith(_HEADINGS)


def may_be_replaced(path: str) -> bool:
    """Tell whether a file is empty or a result of a batch, so that no readings are lost with it.

    Parameters
    ----------
    path : str
        Path of the file.

    Returns
    -------
    bool
        True where it may be written anew.
    """
    if not Path(path).exists():  # a link to what is to be made
        return True
    with Path(path).open("rb") as file:
        beginning = file.read(_BEGINNING)
    if is_parquet(path) and beginning:
        with suppress(InputError):
            beginning = ",".join(headings_of(path)).encode()
    return not beginning or is_result(beginning)
