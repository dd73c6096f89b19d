"""Readings at one and the same row of a design, brought down to their mean without any loss.

A least-squares fit needs of replicates only their weighted mean and the squares about it. A tumble
test of 54 readings has but 9 rows, and what follows has a sixth of the work.

Stacks are worked on stroke by stroke with the tables last, shape (m, g, T) for g rows of m
replicates each: every operation then runs along thousands of neighbours in memory, none along a
few. A mean is kept as a reading, or a rounded mean, and the little that the true mean is beside it.
The difference of readings that are close is exact, so the mean has twice the digits of a reading.

The residuals are known far beyond the working precision of a product.

References
----------
K. Ozaki, T. Ogita, S. Oishi, S. M. Rump, "Error-free transformations of matrix multiplication by
using fast routines of matrix multiplication", Numerical Algorithms 59 (2012) 95-118.

T. Ogita, S. M. Rump, S. Oishi, "Accurate sum and dot product", SIAM J. Sci. Comput. 26 (2005)
1955-1988.
"""

from __future__ import annotations

import threading
from math import prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from accelcal.arrays import Array, Labels, Places

# A solution in multiples of its size / 2^23 and a design in multiples of 2^-24 have a product of
# up to 49 bits, so that it is exact in the 53 bits of a number, in whatever order it is summed.
_CUT_SOLUTION = 2.0**30
_CUT_DESIGN = 2.0**24

_HALF_OF_THE_BITS = 2.0**27 + 1.0


class CutDesign(NamedTuple):
    """A design matrix cut into the upper bits of its elements and the rest.

    Attributes
    ----------
    high, low : ndarray, shape (n, p)
        The matrix is their sum.
    """

    high: Array
    low: Array

    @classmethod
    def of(cls, matrix: Array) -> CutDesign:
        """Cut a matrix whose elements are of the size of one, shape (n, p)."""
        high = np.round(matrix * _CUT_DESIGN) / _CUT_DESIGN
        return cls(high, matrix - high)

    def near(self, solution: Array) -> Array:
        """Round solutions to the few bits that `subtract_fit` needs, shape (p, T)."""
        rounded = np.abs(solution, out=MEMORY.array("near", solution.shape))
        anchor = np.maximum.reduce(rounded, axis=0)
        anchor *= _CUT_SOLUTION
        np.add(solution, anchor, out=rounded)
        rounded -= anchor
        return rounded

    def subtract_fit(self, y: Array, solution: Array) -> Array:
        """Turn y, shape (n, T), into y - matrix @ solution for solutions of `near`.

        The first product is exact, and so is its difference to a y that it is close to.
        """
        for part in self:
            y -= np.matmul(part, solution, out=MEMORY.array("fit", y.shape))
        return y


def twice_precise_residual(y: Array, r: Array, matrix: Array, x: Array) -> Array:
    """Return y - r - matrix @ x, shape (..., n), as if summed in twice the working precision.

    The matrix is of shape (n, p).

    Examples
    --------
    >>> import numpy as np
    >>> tenth = np.array([0.1])
    >>> twice_precise_residual(np.array([1.0]), np.array([0.0]), tenth[:, None], np.array([10.0]))
    array([-5.55111512e-17])
    """
    total, rest = two_sum(y, -r)
    for column, factor in zip(matrix.T, np.moveaxis(x, -1, 0), strict=True):
        product, error = two_product(column, factor[..., None])
        total, lost = two_sum(total, -product)
        rest = rest + (lost - error)
    return np.asarray(total + rest)


# -- sums and products together with their rounding errors ---------------------------------------


def two_sum(a: Array, b: Array) -> tuple[Array, Array]:
    """Sum and its rounding error, exactly (Knuth); the shapes broadcast.

    Examples
    --------
    >>> [part.tolist() for part in two_sum(np.array([1.0]), np.array([2.0**-60]))]
    [[1.0], [8.673617379884035e-19]]
    """
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def two_product(a: Array, b: Array) -> tuple[Array, Array]:
    """Product and its rounding error, exactly (Dekker's product with Veltkamp's splitting).

    The factors are of less than 1e299 in size, in shapes that broadcast.

    Examples
    --------
    >>> [part.tolist() for part in two_product(np.array([0.1]), np.array([10.0]))]
    [[1.0], [5.551115123125783e-17]]
    """
    product = a * b
    (a_high, a_low), (b_high, b_low) = _split(a), _split(b)
    error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
    return product, error


def _split(a: Array) -> tuple[Array, Array]:
    """Sum of two numbers of half the bits."""
    scaled = _HALF_OF_THE_BITS * a
    high = scaled - (scaled - a)
    return high, a - high


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


_GULP = 400
"""Tables that are transposed at a time, so that the cache holds them and their transpose."""


class Means(NamedTuple):
    """Replicates of g rows in T tables, about a reference near their mean.

    They stand in memory that the next means of the same thread will overwrite.

    Attributes
    ----------
    reference : ndarray, shape (g, T)
        A value near the readings.
    weight : ndarray, shape (g, T) or (1, 1)
        Sum of the weights, or that of all rows where no table has a gap.
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
    readings: NDArray[Any]

    def taken(self, tables: slice | Places) -> Means:
        """Those of some of the tables."""
        return Means(*[values[..., tables] for values in self])

    @classmethod
    def of_whole(cls, strokes: Array) -> Means:
        """Those of tables without gaps, shape (m, g, T), overwritten, about one reading."""
        first, others = strokes[0], strokes[1:]
        others -= first
        weight = np.full((1, 1), float(len(strokes)))
        readings = np.full(strokes.shape[2], strokes.shape[0] * strokes.shape[1])
        return cls(first, weight, *_summed(others, others), readings)

    @classmethod
    def of_gaps(cls, strokes: Array) -> Means:
        """Those of tables with NaN at gaps, shape (m, g, T), overwritten, about their mean."""
        missing = np.isnan(strokes, out=MEMORY.array("missing", strokes.shape, np.bool_))
        few = np.min_scalar_type(len(strokes))  # mostly a byte, the quickest
        gaps = np.add.reduce(missing, axis=0, dtype=few)
        weight = np.subtract(len(strokes), gaps, out=MEMORY.array("weight", gaps.shape))
        np.copyto(strokes, 0.0, where=missing)
        mean = np.add.reduce(strokes, axis=0, out=MEMORY.array("reference", gaps.shape))
        mean /= np.maximum(weight, 1.0)
        strokes -= mean
        np.copyto(strokes, 0.0, where=missing)
        return cls(mean, weight, *_summed(strokes, strokes), np.add.reduce(weight, axis=0))

    @classmethod
    def of_weighted(cls, strokes: Array, weights: Array) -> Means:
        """Those of tables with weights, zero at gaps, both overwritten, about their mean."""
        readings = np.add.reduce(weights > 0.0, axis=(0, 1))
        np.copyto(strokes, 0.0, where=np.isnan(strokes))
        weight = np.add.reduce(weights, axis=0)
        mean = np.einsum("mgt,mgt->gt", weights, strokes)
        mean /= np.where(weight > 0.0, weight, 1.0)
        strokes -= mean
        weights *= strokes
        return cls(mean, weight, *_summed(weights, strokes), readings)


def _summed(weighted: Array, differences: Array) -> tuple[Array, Array]:
    """Sums of differences and of their squares, shape (g, T)."""
    sums, squares = MEMORY.array("sums", (2, *differences.shape[1:]))
    np.add.reduce(weighted, axis=0, out=sums)
    np.einsum("mgt,mgt->gt", weighted, differences, out=squares)
    return sums, squares


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

    first: Places
    group: Places
    place: Places
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
        ordered = np.add(rows, 0.0, order="C")  # without -0.0
        whole = ordered.view(f"V{8 * rows.shape[1]}")[:, 0].tolist()
        equal = Labels.of(whole).code
        order = np.argsort(equal, kind="stable")
        size = int(np.gcd.reduce(np.bincount(equal)))
        group, place = np.empty((2, order.size), dtype=np.intp)
        group[order], stroke = np.divmod(np.arange(order.size), size)
        place[order] = stroke * (order.size // size) + group[order]
        return cls(order[::size], group, place, size)

    def means(self, y: Array, weight: Array | None = None) -> Means:
        """Bring down tables of shape (T, n), NaN at gaps, by weights that are zero there."""
        strokes, gaps = self._strokes(y, "readings")
        if weight is not None:
            return Means.of_weighted(strokes, self._strokes(weight, "weights")[0])
        return Means.of_gaps(strokes) if gaps else Means.of_whole(strokes)

    def _strokes(self, values: Array, name: str) -> tuple[Array, bool]:
        """Bring values of shape (T, n) into shape (m, g, T), and tell whether any is NaN."""
        rows, gaps = MEMORY.array(name, values.T.shape), False
        for at in range(0, len(values), _GULP):
            some = values[at : at + _GULP]
            largest = some.max()  # NaN where there is one; and all are in the cache after it
            gaps |= bool(largest != largest)
            rows[self.place, at : at + _GULP] = some.T
        return rows.reshape(self.size, -1, len(values)), gaps
