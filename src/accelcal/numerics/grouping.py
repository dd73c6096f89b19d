"""Equal values brought together in groups, sums over each group, different values, medians.

numpy.unique and numpy.median import numpy.ma, which takes as long as the fit of a table; what is
here sorts.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator
from itertools import groupby
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array, Places
from accelcal.numerics.one_thread import multiply


def distinct(values: NDArray[Any]) -> NDArray[Any]:
    """Sort the values, none of them NaN, and keep one of each.

    Examples
    --------
    >>> import numpy as np
    >>> distinct(np.array([3, 1, 3])).tolist()
    [1, 3]
    """
    ordered = np.sort(values)
    first = np.concatenate([[True], ordered[1:] != ordered[:-1]])[: ordered.size]
    return np.asarray(ordered[first])


def median(values: NDArray[Any]) -> float:
    """Median of one value or more, none of them NaN.

    Examples
    --------
    >>> import numpy as np
    >>> median(np.array([4.0, 1.0, 3.0])), median(np.array([1.0, 2.0]))
    (3.0, 1.5)
    """
    ordered = np.sort(values)
    half = values.size // 2
    return float(ordered[half] if values.size % 2 else 0.5 * (ordered[half - 1] + ordered[half]))


_CACHED = 2**17
"""Numbers of the groups that are worked on at a time, 1 MB, so that the cache holds them."""

_FEW = 100
"""Products of a row up to which all of them are written down, and summed afterwards."""

_SMALL = 2**17
"""Groups times values up to which sums are a product with a matrix, which the cache holds."""


class Grouped(NamedTuple):
    """Values brought together in cells of equal ones.

    Attributes
    ----------
    key : ndarray, shape (m,)
        The different values, sorted.
    cell : ndarray of int, shape (n,)
        Place of each value in `key`.
    members : ndarray of int, shape (m,)
        How often each occurs, at least once.

    Examples
    --------
    >>> import numpy as np
    >>> found = grouped(np.array([3, 1, 3]))
    >>> found.sums(np.array([[3.0], [1.0], [4.0]])).tolist()
    [[1.0], [7.0]]
    >>> [own.tolist() for own in found.parts]
    [[1], [0, 2]]
    """

    key: NDArray[Any]
    cell: Places
    members: Places

    @property
    def order(self) -> Places:
        """Places of the values of the first cell, then those of the next; in their order each."""
        cell = self.cell
        if self.members.size <= np.iinfo(np.int16).max:
            cell = cell.astype(np.int16)  # numpy sorts these by radix, which is faster
        return np.argsort(cell, kind="stable")

    @property
    def starts(self) -> Places:
        """Where each cell begins in `order`, shape (m,)."""
        return np.asarray(np.cumsum(self.members) - self.members)

    @property
    def parts(self) -> list[Places]:
        """Places of the values of each cell."""
        return np.split(self.order, self.starts[1:])

    @property
    def alike(self) -> list[tuple[Places, Places]]:
        """Cells of equally many values together, so that they can be stacked; the small first.

        Of each k, which cells they are, shape (c,), and the places of their values, shape (c, k).
        """
        order, starts = self.order, self.starts
        found = []
        for count in distinct(self.members).tolist():
            group = np.flatnonzero(self.members == count)
            found.append((group, order[starts[group, None] + np.arange(count)]))
        return found

    def sums(self, values: Array, weight: Array | float = 1.0) -> Array:
        """Sum values, shape (..., n, k), times a weight, over each cell: shape (..., m, k).

        The weight is one for all, or of shape (n,).
        """
        if self.cell.size * self.members.size <= _SMALL:  # a product is faster, but grows as m n
            own = np.arange(self.members.size)[:, None] == self.cell
            return multiply(own * weight, values)
        weighted = np.take(values * np.reshape(weight, (-1, 1)), self.order, axis=-2)
        return np.asarray(np.add.reduceat(weighted, self.starts, axis=-2))

    def weighted_sums(self, rows: Array, weight: Array) -> Array:
        """Sum rows of shape (R, n) over each cell, shape (R, m), by weights of (n,) or (R, n)."""
        if weight.ndim == 1:
            return self.sums(rows.T, weight).T
        return self.sums((rows * weight).T).T

    def products(self, values: Array, columns: Array) -> Array:
        """Sum the products of (..., n, j) and (..., n, k) over the rows of each cell.

        Gives shape (..., m, j, k); what has leading axes is written down product by product.
        """
        shape = self.members.size, values.shape[-1], columns.shape[-1]
        each = shape[1] * shape[2] <= _FEW and self.cell.size * shape[0] <= _SMALL
        if each or max(values.ndim, columns.ndim) > 2:
            pairs = values[..., :, None] * columns[..., None, :]
            sums = self.sums(pairs.reshape(*pairs.shape[:-2], -1))
            return sums.reshape(*sums.shape[:-2], *shape)
        found = np.empty(shape)
        for group, places in self.alike:
            for few in few_at_a_time(places, shape[1]):
                own = values.take(places[few], axis=0).mT
                found[group[few]] = own @ columns.take(places[few], axis=0)
        return found


def grouped(values: NDArray[Any]) -> Grouped:
    """Bring equal values together, which are not NaN, shape (n,).

    Examples
    --------
    >>> import numpy as np
    >>> [part.tolist() for part in grouped(np.array([3, 1, 3]))]
    [[1, 3], [1, 0, 1], [1, 2]]
    """
    key = distinct(values)
    cell = np.searchsorted(key, values)
    return Grouped(key, cell, np.bincount(cell, minlength=key.size))


def cells(*keys: NDArray[np.generic]) -> Places:
    """Number the combinations of some keys, from 0; shape (n,).

    Examples
    --------
    >>> import numpy as np
    >>> cells(np.array([1, 1, 2, 1]), np.array(["b", "a", "a", "b"])).tolist()
    [1, 0, 2, 1]
    """
    label = np.zeros(keys[0].size, dtype=np.int64)
    for key in keys:
        groups, index, _ = grouped(key)
        label = label * groups.size + index
    return grouped(label).cell


def places_of_equals(keys: Iterable[Hashable]) -> list[list[int]]:
    """Find the places of equal keys, those of the key that comes first before the others.

    Neighbours mostly have equal keys, and comparing two keys of kilobytes is quicker than hashing
    one. So runs of equal neighbours are found first, and each is hashed once.

    Examples
    --------
    >>> places_of_equals(["b", "b", "a", "b"])
    [[0, 1, 3], [2]]
    """
    places: dict[Hashable, list[int]] = {}
    for key, run in groupby(enumerate(keys), key=itemgetter(1)):
        places.setdefault(key, []).extend(place for place, _ in run)
    return list(places.values())


def few_at_a_time(places: Places, numbers: int) -> Iterator[slice]:
    """Divide groups of equally many values, shape (c, k), into parts that a cache holds.

    So many numbers are needed for each value. A part is one group at least.

    Examples
    --------
    >>> import numpy as np
    >>> places = np.arange(10).reshape(5, 2)
    >>> [places[few].tolist() for few in few_at_a_time(places, 30_000)]
    [[[0, 1], [2, 3]], [[4, 5], [6, 7]], [[8, 9]]]
    """
    groups, each = places.shape
    step = max(_CACHED // max(each * numbers, 1), 1)
    for start in range(0, groups, step):
        yield slice(start, start + step)
