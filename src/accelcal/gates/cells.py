"""Readings brought together in cells, for sums over each."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array, Places
from accelcal.numerics.grouping import (
    Alike,
    group_after_group,
    grouped,
    groups_alike,
    sums_of_groups,
)


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
    weight : ndarray, shape (m,)
        Weight of the mean of each cell: the sum of those of its readings.
    precision : ndarray, shape (n,), or None
        One over the spread of each reading, in which the values are then counted, so that all have
        the same noise; None where they have it as they are.
    """

    key: NDArray[Any]
    cell: Places
    members: Places
    weight: NDArray[Any]
    precision: Array | None = None

    @classmethod
    def of(cls, keys: NDArray[Any], precision: Array | None = None) -> Cells:
        """Bring readings of one key together."""
        key, cell, members = grouped(keys)
        if precision is None:
            return cls(key, cell, members, members)
        return cls(key, cell, members, np.bincount(cell, precision**2), precision)

    @property
    def parts(self) -> list[Places]:
        """Readings of each cell."""
        order = group_after_group(self.cell, self.members)
        return [order[start:end] for start, end in pairwise([0, *np.cumsum(self.members).tolist()])]

    @property
    def alike(self) -> list[Alike]:
        """The cells, those of equally many readings together."""
        return groups_alike(self.cell, self.members)

    def sums(self, values: Array) -> Array:
        """Sum over the readings of each cell, from shape (..., n, k) to shape (..., m, k)."""
        return sums_of_groups(values, self.cell, self.members)

    def means(self, values: Array) -> Array:
        """Mean over the readings of each cell, from shape (..., n, k) to shape (..., m, k).

        Of values v = y p of precision p it is the weighted mean of y, the sum of v p over that of
        p^2.
        """
        own = 1.0 if self.precision is None else self.precision
        return np.asarray(
            sums_of_groups(values, self.cell, self.members, own) / self.weight[:, None]
        )

    def at_readings(self, means: Array) -> Array:
        """What is expected of the readings, from means of shape (..., m, k), shape (..., n, k)."""
        expected = np.take(means, self.cell, axis=-2)
        return expected if self.precision is None else expected * self.precision[:, None]

    @property
    def own_share(self) -> Array:
        """Share of each reading's own error in the mean of its cell, shape (n,)."""
        own = 1.0 if self.precision is None else self.precision**2
        return np.asarray(own / self.weight[self.cell])

    def centred(self, values: Array) -> Array:
        """Take the mean of its cell off each reading, shape (..., n, k)."""
        return np.asarray(values - self.at_readings(self.means(values)))
