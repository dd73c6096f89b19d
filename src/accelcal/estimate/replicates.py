"""Readings at one and the same row of a design, brought down to their mean without any loss.

A least-squares fit needs of replicates only their weighted mean and the squares about it. A tumble
test of 54 readings has but 9 rows, and what follows has a sixth of the work.

Stacks are worked on stroke by stroke with the tables last, shape (m, g, T) for g rows of m
replicates each: every operation then runs along thousands of neighbours in memory, none along a
few. A mean is kept as a reading, or a rounded mean, and the little that the true mean is beside it.
The difference of readings that are close is exact, so the mean has twice the digits of a reading.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.memory import Memory

__all__ = ["Means", "Replicates"]

Array = NDArray[np.float64]

_MEMORY = Memory()

_GULP = 512  # tables that are in the cache together with their transpose


class Means(NamedTuple):
    """Replicates of g rows in T tables, about a reference near their mean.

    Attributes
    ----------
    reference : ndarray, shape (g, T)
        A value near the readings.
    weight : ndarray, shape (g, T)
        Sum of the weights.
    sums : ndarray, shape (g, T)
        Weighted sum of the differences of the readings to the reference.
    squares : ndarray, shape (g, T)
        Weighted sum of the squares of these differences.
    readings : ndarray, shape (T,)
        Number of readings of a table.
    """

    reference: Array
    weight: Array
    sums: Array
    squares: Array
    readings: Array

    def taken(self, tables: slice | NDArray[np.intp]) -> Means:
        """Those of some of the tables."""
        return Means(*[values[..., tables] for values in self])

    def of_whole(self, strokes: Array) -> None:
        """Fill in those of tables without gaps, shape (m, g, T); the reference is one of each."""
        first, others = strokes[0], strokes[1:]
        others -= first
        self.reference[:] = first
        self.weight[:] = len(strokes)
        self.sums[:] = np.add.reduce(others, axis=0)  # into pieces of rows it takes twice as long
        np.einsum("mgt,mgt->gt", others, others, out=self.squares)
        self.readings[:] = strokes.shape[0] * strokes.shape[1]

    def of_gaps(self, strokes: Array) -> None:
        """Fill in those of tables with NaN at gaps, shape (m, g, T); the reference is the mean."""
        missing = np.isnan(strokes, out=_MEMORY.array("missing", strokes.shape, np.bool_))
        few = np.min_scalar_type(len(strokes))  # a byte mostly, which is quickest to count in
        np.subtract(len(strokes), np.add.reduce(missing, axis=0, dtype=few), out=self.weight)
        np.add.reduce(self.weight, axis=0, out=self.readings)
        np.copyto(strokes, 0.0, where=missing)
        mean = np.add.reduce(strokes, axis=0)
        mean /= np.maximum(self.weight, 1.0)
        strokes -= mean
        self.reference[:] = mean
        np.copyto(strokes, 0.0, where=missing)
        self.sums[:] = np.add.reduce(strokes, axis=0)
        np.einsum("mgt,mgt->gt", strokes, strokes, out=self.squares)

    def of_weighted(self, strokes: Array, weight: Array) -> None:
        """Fill in those of tables with weights, zero at gaps; the reference is the mean."""
        np.add.reduce(weight > 0.0, axis=(0, 1), out=self.readings)
        np.copyto(strokes, 0.0, where=np.isnan(strokes))
        self.weight[:] = np.add.reduce(weight, axis=0)
        mean = np.einsum("mgt,mgt->gt", weight, strokes, out=self.reference)
        mean /= np.where(self.weight > 0.0, self.weight, 1.0)
        strokes -= mean
        weight *= strokes
        self.sums[:] = np.add.reduce(weight, axis=0)
        np.einsum("mgt,mgt->gt", weight, strokes, out=self.squares)


class Replicates(NamedTuple):
    """Which of n observations repeat one another, in g groups of one size.

    The size is the largest that divides how often every row occurs: a row that occurs twice as
    often as the others has two groups, and without any order in it each observation has its own.

    Attributes
    ----------
    first : ndarray of int, shape (g,)
        The first observation of each group.
    group : ndarray of int, shape (n,)
        Group of each observation.
    place : ndarray of int, shape (n,)
        Where each observation stands when they are brought into shape (m, g).
    size : int
        How many each group has, m.
    """

    first: NDArray[np.intp]
    group: NDArray[np.intp]
    place: NDArray[np.intp]
    size: int

    @classmethod
    def of(cls, rows: Array) -> Replicates:
        """Group equal rows, shape (n, k).

        Examples
        --------
        >>> found = Replicates.of(np.array([[1.0], [2.0], [2.0], [1.0], [2.0], [2.0]]))
        >>> found.size, found.first.tolist(), found.group.tolist(), found.place.tolist()
        (2, [0, 1, 4], [0, 1, 1, 0, 2, 2], [0, 1, 4, 3, 2, 5])
        """
        numbers: dict[bytes, int] = {}
        ordered = np.add(rows, 0.0, order="C")  # without -0.0
        whole = ordered.view(f"V{8 * rows.shape[1]}")[:, 0].tolist()
        equal = [numbers.setdefault(row, len(numbers)) for row in whole]
        order = np.argsort(np.array(equal), kind="stable")
        size = int(np.gcd.reduce(np.bincount(equal)))
        group, place = np.empty((2, order.size), dtype=np.intp)
        group[order], stroke = np.divmod(np.arange(order.size), size)
        place[order] = stroke * (order.size // size) + group[order]
        return cls(order[::size], group, place, size)

    def means(self, y: Array, weight: Array | None = None) -> Means:
        """Bring down tables of shape (T, n), NaN at gaps, by weights that are zero there, if given.

        They stand in memory that the next means of the same thread will overwrite.
        """
        shape = (self.first.size, len(y))
        reference, total, sums, squares = _MEMORY.array("means", (4, *shape))
        found = Means(reference, total, sums, squares, _MEMORY.array("count", shape[1:]))
        for at in range(0, len(y), _GULP):
            some = slice(at, at + _GULP)
            part = found.taken(some)
            largest = y[some].max()  # reading them in order fetches them into the cache
            strokes = self._strokes(y[some], "readings")
            if weight is not None:
                part.of_weighted(strokes, self._strokes(weight[some], "weights"))
            elif np.isnan(largest):
                part.of_gaps(strokes)
            else:
                part.of_whole(strokes)
        return found

    def _strokes(self, values: Array, name: str) -> Array:
        """Bring values of shape (T, n) into shape (m, g, T)."""
        rows = _MEMORY.array(name, values.T.shape)
        rows[self.place] = values.T
        return rows.reshape(self.size, -1, len(values))
