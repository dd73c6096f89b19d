"""Products and factorisations of matrices that stay in one thread."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any

import numpy as np

from accelcal.arrays import Array

# Multiplications in a product of matrices up to which OpenBLAS works in one thread. Larger ones it
# shares among threads, which here spend more time on waiting for one another than they save.
_ALONE = 2**18


def multiply(matrix: Array, values: Array, out: Array | None = None) -> Array:
    """Multiply a small matrix, (j, k), by one of many columns, (..., k, n), in one thread.

    The product, shape (..., j, n), goes to `out` where it is given.

    Examples
    --------
    >>> import numpy as np
    >>> multiply(np.array([[1.0, 2.0]]), np.array([[3.0, 4.0], [5.0, 6.0]])).tolist()
    [[13.0, 16.0]]
    """
    columns = values.shape[-1]
    step = max(_ALONE // max(matrix.size, 1), 1)
    if columns <= step:
        return np.asarray(np.matmul(matrix, values, out=out))
    if out is None:
        out = np.empty((*values.shape[:-2], len(matrix), columns))
    for at in range(0, columns, step):
        some = slice(at, at + step)
        np.matmul(matrix, values[..., some], out=out[..., some])
    return out


@contextmanager
def in_one_thread() -> Iterator[None]:
    """Keep all that numpy and scipy do with matrices in one thread.

    Hundreds of products and factorisations of some hundred rows are quicker so, and far quicker
    where the processors have other work: threads wait for one another at the end of each.

    Notes
    -----
    It counts for the whole process. Where several threads ask for it at a time, it holds until the
    last of them ends.

    Examples
    --------
    >>> from threadpoolctl import threadpool_info
    >>> with in_one_thread():
    ...     {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}
    {1}
    """
    import scipy.linalg  # type: ignore[import-untyped]  # noqa: F401  (has a library of its own)
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

    with _LOCK:
        _ASKED.append(_ASKED[0] if _ASKED else threadpool_limits(limits=1, user_api="blas"))
    try:
        yield
    finally:
        with _LOCK:
            limit = _ASKED.pop()
            if not _ASKED:
                limit.restore_original_limits()


_LOCK = Lock()
_ASKED: list[Any] = []
"""The limit of the process, once for all who ask for it: the first sets it, the last takes it back.
"""
