"""Memory of a worker: what one block frees, the next takes again."""

from __future__ import annotations

from functools import cache

import numpy as np

_LARGEST = 2**25 - 2**14
"""Bytes of the largest array that glibc learns from, and its own few."""


@cache
def keep_freed_memory() -> None:
    """Let glibc keep the memory of arrays that are freed, up to 64 MB, in large pages.

    glibc gives memory back as soon as twice as much lies free as the largest array took that was
    ever freed. The next array gets pages that the system fills with zeros first, which took nearly
    a tenth of the time of a worker. So a large array is freed here, of which no page is ever
    touched. A second one is then a part of what glibc keeps, and numpy asks the system to fill such
    arrays by large pages, which takes half as long. Other allocators are none the wiser.
    """
    for _ in range(2):
        np.empty(_LARGEST, dtype=np.uint8)
