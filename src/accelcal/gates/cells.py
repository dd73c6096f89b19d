"""Means of readings brought together in cells."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array
from accelcal.numerics.grouping import Grouped, grouped


class Cells(NamedTuple):
    """Readings brought together in cells, for the mean of each.

    Attributes
    ----------
    readings : Grouped
        The readings by what those of each cell share.
    weight : ndarray, shape (m,)
        Weight of the mean of each cell: the sum of those of its readings.
    precision : ndarray, shape (n,), or None
        One over the spread of each reading, in which the values are then counted, so that all have
        the same noise; None where they have it as they are.
    """

    readings: Grouped
    weight: NDArray[Any]
    precision: Array | None = None

    @classmethod
    def of(cls, keys: NDArray[Any], precision: Array | None = None) -> Cells:
        """Bring readings of one key together."""
        readings = grouped(keys)
        if precision is None:
            return cls(readings, readings.members)
        return cls(readings, np.bincount(readings.cell, precision**2), precision)

    def means(self, values: Array) -> Array:
        """Mean over the readings of each cell, from shape (..., n, k) to shape (..., m, k).

        Of values v = y p of precision p it is the weighted mean of y, the sum of v p over that of
        p^2.
        """
        own = 1.0 if self.precision is None else self.precision
        return np.asarray(self.readings.sums(values, own) / self.weight[:, None])

    def at_readings(self, means: Array) -> Array:
        """What is expected of the readings, from means of shape (..., m, k), shape (..., n, k)."""
        expected = np.take(means, self.readings.cell, axis=-2)
        return expected if self.precision is None else expected * self.precision[:, None]

    @property
    def own_share(self) -> Array:
        """Share of each reading's own error in the mean of its cell, shape (n,)."""
        own = 1.0 if self.precision is None else self.precision**2
        return np.asarray(own / self.weight[self.readings.cell])

    def centred(self, values: Array) -> Array:
        """Take the mean of its cell off each reading, shape (..., n, k)."""
        return np.asarray(values - self.at_readings(self.means(values)))
