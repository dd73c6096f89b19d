"""Which files may be written over: those of the same kind, so that no readings are lost."""

from __future__ import annotations

import os
import re
import zlib
from collections.abc import Callable
from contextlib import suppress

from accelcal.errors import InputError
from accelcal.io.files.parquet import headings_of, is_parquet

_BEGINNING = 2**14
"""Bytes that hold the header lines and headings of a table."""

_GZIP = 16 + zlib.MAX_WBITS
"""Of `zlib`, what takes gzip."""

_SIMULATED = re.compile(r"(?:#.*\n)*# simulated: ")


def may_be_replaced(path: str, is_own: Callable[[str], bool]) -> bool:
    """Tell whether a file is empty or of one kind, so that nothing else is lost with it.

    `is_own` tells by the header lines and headings whether a table is of the kind.
    """
    if not os.path.isfile(path):  # noqa: PTH113  (nothing, a device, a name that cannot be)
        return True
    return begins_as(path, lambda beginning: not beginning or is_own(beginning))


def begins_as(path: str, is_own: Callable[[str], bool]) -> bool:
    """Tell whether a file can be read and begins as one of a kind, as of `may_be_replaced`."""
    try:
        with open(path, "rb") as file:  # noqa: PTH123  (pathlib costs start-up time)
            beginning = file.read(_BEGINNING)
    except OSError:
        return False
    return is_own(_down_to_headings(path, beginning))


def is_simulated(text: str) -> bool:
    r"""Tell whether a text is a table that `accelcal.simulate` has made.

    A header line says so.

    Examples
    --------
    >>> is_simulated("# serial: A\n# simulated: seed 1\n"), is_simulated("# serial: A\nT,J,k,Y\n")
    (True, False)
    """
    return _SIMULATED.match(text) is not None


def _down_to_headings(path: str, beginning: bytes) -> str:
    if is_parquet(path):
        with suppress(InputError):
            return ",".join(headings_of(path))
    if beginning.startswith(b"\x1f\x8b"):
        with suppress(zlib.error):
            beginning = zlib.decompressobj(_GZIP).decompress(beginning, _BEGINNING)
    return beginning.decode("utf-8", errors="replace")
