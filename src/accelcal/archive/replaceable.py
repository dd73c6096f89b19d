"""Which files may be written anew: those that are results of a batch themselves."""

from __future__ import annotations

import gzip
import io
from contextlib import suppress
from pathlib import Path

from accelcal.errors import InputError
from accelcal.io.batch_results import is_batch_result
from accelcal.io.parquet import headings_of, is_parquet

_BEGINNING = 2**14
"""Bytes that hold the headings of a frame."""


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
    return not beginning or is_batch_result(_headings(path, beginning))


def _headings(path: str, beginning: bytes) -> str:
    if is_parquet(path):
        with suppress(InputError):
            return ",".join(headings_of(path))
    if beginning.startswith(b"\x1f\x8b"):
        with suppress(OSError, EOFError):
            beginning = gzip.GzipFile(fileobj=io.BytesIO(beginning)).readline()
    return beginning.decode("utf-8", errors="replace")
