"""Equal values brought together in groups, and sums over each group."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array, Places
from accelcal.numerics.one_thread import multiply
from accelcal.numerics.sorting import distinct

_CACHED = 2**17
"""Numbers of the groups that are worked on at a time, 1 MB, so that the cache holds them."""

_FEW = 100
"""Products of a row up to which all of them are written down, and summed afterwards."""

_SMALL = 2**17
"""Groups times values up to which sums are a product with a matrix, which the cache holds."""


def grouped(values: NDArray[Any]) -> tuple[NDArray[Any], Places, Places]:
    """Bring equal values together.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Values without NaN.

    Returns
    -------
    groups : ndarray, shape (m,)
        The different values, sorted.
    index : ndarray of int, shape (n,)
        Place of each value in `groups`.
    members : ndarray of int, shape (m,)
        How often each occurs.

    Examples
    --------
    >>> import numpy as np
    >>> [part.tolist() for part in grouped(np.array([3, 1, 3]))]
    [[1, 3], [1, 0, 1], [1, 2]]
    """
    groups = distinct(values)
    index = np.searchsorted(groups, values)
    return groups, index, np.bincount(index, minlength=groups.size)


class Alike(NamedTuple):
    """Groups of equally many values.

    Attributes
    ----------
    group : ndarray of int, shape (c,)
        Which groups they are.
    places : ndarray of int, shape (c, k)
        Places of their values.
    """

    group: Places
    places: Places


def groups_alike(index: Places, members: Places) -> list[Alike]:
    """Bring groups of equally many values together, so that they can be stacked.

    Parameters
    ----------
    index : ndarray of int, shape (n,)
        Group of each value.
    members : ndarray of int, shape (m,)
        How many each group has.

    Returns
    -------
    list of Alike
        The groups, those of the fewest values first.

    Examples
    --------
    >>> import numpy as np
    >>> found = groups_alike(np.array([2, 1, 0, 1, 2]), np.array([1, 2, 2]))
    >>> [(alike.group.tolist(), alike.places.tolist()) for alike in found]
    [([0], [[2]]), ([1, 2], [[1, 3], [0, 4]])]
    """
    order, ends = group_after_group(index, members), np.cumsum(members)
    found = []
    for count in distinct(members).tolist():
        group = np.flatnonzero(members == count)
        found.append(Alike(group, order[ends[group, None] + np.arange(-count, 0)]))
    return found


def group_after_group(index: Places, members: Places) -> Places:
    """Sort values by their group.

    Parameters
    ----------
    index : ndarray of int, shape (n,)
        Group of each value.
    members : ndarray of int, shape (m,)
        How many each group has.

    Returns
    -------
    ndarray of int, shape (n,)
        Places of the values of the first group, then those of the next; in their order each.

    Examples
    --------
    >>> import numpy as np
    >>> group_after_group(np.array([1, 0, 1]), np.array([1, 2])).tolist()
    [1, 0, 2]
    """
    if members.size <= np.iinfo(np.int16).max:
        index = index.astype(np.int16)  # numpy sorts these by radix, which is faster
    return np.argsort(index, kind="stable")


def few_at_a_time(places: Places, numbers: int) -> Iterator[slice]:
    """Divide groups of equally many values into parts that a cache holds.

    Parameters
    ----------
    places : ndarray of int, shape (c, k)
        Values of each group.
    numbers : int
        How many numbers are needed for each value.

    Yields
    ------
    slice
        Some of the groups, at least one.

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


def products_of_groups(
    values: Array,
    columns: Array,
    index: Places,
    members: Places,
) -> Array:
    """Sum the products of two matrices over the rows of each group.

    Parameters
    ----------
    values : ndarray, shape (n, j)
        One matrix.
    columns : ndarray, shape (n, k)
        The other.
    index : ndarray of int, shape (n,)
        Group of each row.
    members : ndarray of int, shape (m,)
        How many each group has, at least one.

    Returns
    -------
    ndarray, shape (m, j, k)
        The sums.

    Examples
    --------
    >>> import numpy as np
    >>> values, columns = np.array([[3.0], [1.0], [4.0]]), np.array([[1.0, 2.0]] * 3)
    >>> products_of_groups(values, columns, np.array([1, 0, 1]), np.array([1, 2])).tolist()
    [[[1.0, 2.0]], [[7.0, 14.0]]]
    """
    shape = members.size, values.shape[1], columns.shape[1]
    if shape[1] * shape[2] <= _FEW and index.size * shape[0] <= _SMALL:
        each = values[:, :, None] * columns[:, None]
        return sums_of_groups(each.reshape(index.size, -1), index, members).reshape(shape)
    found = np.empty(shape)
    for group, places in groups_alike(index, members):
        for few in few_at_a_time(places, shape[1]):
            own = values.take(places[few], axis=0).mT
            found[group[few]] = own @ columns.take(places[few], axis=0)
    return found


def sums_of_groups(
    values: Array,
    index: Places,
    members: Places,
    weight: Array | float = 1.0,
) -> Array:
    """Sum the values of each group.

    Parameters
    ----------
    values : ndarray, shape (..., n, k)
        Values.
    index : ndarray of int, shape (n,)
        Group of each.
    members : ndarray of int, shape (m,)
        How many each group has, at least one.
    weight : ndarray, shape (n,), or float
        What the values are multiplied by.

    Returns
    -------
    ndarray, shape (..., m, k)
        The sums.

    Examples
    --------
    >>> import numpy as np
    >>> values = np.array([[3.0], [1.0], [4.0]])
    >>> sums_of_groups(values, np.array([1, 0, 1]), np.array([1, 2])).tolist()
    [[1.0], [7.0]]
    """
    if index.size * members.size <= _SMALL:  # a product is faster, but grows as m n
        own = np.arange(members.size)[:, None] == index
        return multiply(own * weight, values)
    starts = np.cumsum(members) - members
    order = group_after_group(index, members)
    weighted = np.take(values * np.reshape(weight, (-1, 1)), order, axis=-2)
    return np.asarray(np.add.reduceat(weighted, starts, axis=-2))
