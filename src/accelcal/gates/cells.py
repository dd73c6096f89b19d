"""Readings brought together in cells, for sums over each."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.grouping import Alike, group_after_group, grouped, groups_alike, sums_of_groups

__all__ = ["Cells"]

Array = NDArray[np.float64]
Places = NDArray[np.intp]


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
        order = group_after_group(self.cell, self.members)
        return np.split(order, np.cumsum(self.members)[:-1])

    @property
    def alike(self) -> list[Alike]:
        """The cells, those of equally many readings together."""
        return groups_alike(self.cell, self.members)

    def sums(self, values: Array) -> Array:
        """Sum over the readings of each cell, from shape (..., n, k) to shape (..., m, k)."""
        return sums_of_groups(values, self.cell, self.members)

    def means(self, values: Array) -> Array:
        """Mean over the readings of each cell, from shape (..., n, k) to shape (..., m, k)."""
        return self.sums(values) / self.members[:, None]

    def centred(self, values: Array) -> Array:
        """Take the mean of its cell off each reading, shape (..., n, k)."""
        return np.asarray(values - np.take(self.means(values), self.cell, axis=-2))
