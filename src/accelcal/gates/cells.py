"""Readings brought together in cells, for sums over each."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.grouping import distinct, grouped, sums_of_groups

__all__ = ["Alike", "Cells", "few_at_a_time"]

Array = NDArray[np.float64]
Places = NDArray[np.intp]

_CACHED = 2**17  # numbers that a cache holds


class Alike(NamedTuple):
    """Cells of equally many readings.

    Attributes
    ----------
    cell : ndarray of int, shape (c,)
        Which cells they are.
    readings : ndarray of int, shape (c, k)
        Readings of each.
    """

    cell: Places
    readings: Places


class Cells(NamedTuple):
    """Readings brought together in cells, for sums over each.

    Attributes
    ----------
    key : ndarray, shape (m,)
        What the readings of each cell share.
    cell : ndarray of int, shape (n,)
        Cell of each reading.
    members : ndarray of int, shape (m,)
        Number of readings of each cell.
    """

    key: NDArray[np.int64]
    cell: Places
    members: Places

    @classmethod
    def of(cls, keys: NDArray[np.int64]) -> Cells:
        """Bring readings of one key together."""
        return cls(*grouped(keys))

    @property
    def parts(self) -> list[Places]:
        """Readings of each cell."""
        return np.split(np.argsort(self.cell, kind="stable"), np.cumsum(self.members)[:-1])

    @property
    def alike(self) -> list[Alike]:
        """The cells in stacks of equally many readings."""
        order, starts = np.argsort(self.cell, kind="stable"), np.cumsum(self.members)
        found = []
        for count in distinct(self.members).tolist():
            cell = np.flatnonzero(self.members == count)
            found.append(Alike(cell, order[starts[cell, None] + np.arange(-count, 0)]))
        return found

    def sums(self, values: Array) -> Array:
        """Sum over the readings of each cell, from shape (..., n, k) to shape (..., m, k)."""
        return sums_of_groups(values, self.cell, self.members)

    def means(self, values: Array) -> Array:
        """Mean over the readings of each cell, from shape (..., n, k) to shape (..., m, k)."""
        return self.sums(values) / self.members[:, None]

    def centred(self, values: Array) -> Array:
        """Take the mean of its cell off each reading, shape (..., n, k)."""
        return np.asarray(values - np.take(self.means(values), self.cell, axis=-2))


def few_at_a_time(readings: Places, numbers: int) -> Iterator[slice]:
    """Divide cells of equally many readings into parts that a cache holds.

    Parameters
    ----------
    readings : ndarray of int, shape (c, k)
        Readings of each cell.
    numbers : int
        How many numbers are needed for each reading.

    Yields
    ------
    slice
        Some of the cells, at least one.

    Examples
    --------
    >>> import numpy as np
    >>> readings = np.arange(10).reshape(5, 2)
    >>> [readings[few].tolist() for few in few_at_a_time(readings, 30_000)]
    [[[0, 1], [2, 3]], [[4, 5], [6, 7]], [[8, 9]]]
    """
    cells, each = readings.shape
    step = max(_CACHED // max(each * numbers, 1), 1)
    for start in range(0, cells, step):
        yield slice(start, start + step)
