"""Memory to work in, used again and again."""

from __future__ import annotations

import threading
from math import prod
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

_LARGEST = 500_000
"""Numbers of the largest array that is kept, 4 MB: no block of tables needs more."""

_LINE = 64
"""Bytes of a line of the cache."""


class Memory(threading.local):
    """Arrays by name, whose memory stays for the next array of that name; each thread has its own.

    The C library fetches each array above 128 kB afresh from the system, page by page, which takes
    longer than most of what is done with it.

    Examples
    --------
    >>> memory = Memory()
    >>> small, other = memory.array("fit", (2, 3)), memory.array("rest", (2, 3))
    >>> np.shares_memory(small, memory.array("fit", (6,))), np.shares_memory(small, other)
    (True, False)
    >>> small.ctypes.data % 64
    0
    """

    def __init__(self) -> None:
        self._kept: dict[str, NDArray[Any]] = {}

    def array(
        self, name: str, shape: tuple[int, ...], dtype: DTypeLike = np.float64
    ) -> NDArray[Any]:
        """Return an array of that shape with anything in it; the last of that name is lost."""
        size = prod(shape)
        if size > _LARGEST:
            return np.empty(shape, dtype)
        kept = self._kept.get(name)
        if kept is None or kept.size < size:
            kept = self._kept[name] = _aligned(size, dtype)
        return kept[:size].reshape(shape)


def _aligned(size: int, dtype: DTypeLike) -> NDArray[Any]:
    """Array that begins with a line of the cache; else vectors are read from two lines each."""
    item = np.dtype(dtype).itemsize
    room = np.empty(size * item + _LINE, np.uint8)
    start = -room.ctypes.data % _LINE
    return room[start : start + size * item].view(dtype)


MEMORY = Memory()
"""That of the solver and of what it calls; each array has a name of its own."""
