"""The least value of smooth functions on grids of equal ratios, for many functions at once."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from accelcal.arrays import Array, Places

# Three looks, each finer and nearer to the lowest point, evaluate half as much as two (16 and 1).
_STRIDES = (64, 8, 1)


class Grid(NamedTuple):
    """Points exp(start + i * step), i from 0 to points - 1, for each of many functions."""

    start: ArrayLike  # logarithm of the first point, shape (..., 1)
    step: ArrayLike  # of the ratio of the points, shape (..., 1)
    points: ArrayLike  # how many, shape (..., 1)

    def at(self, place: Places) -> Array:
        """Return the points at some places, shape (..., m); the last one beyond the end."""
        inside = np.minimum(np.maximum(place, 0), np.asarray(self.points) - 1)
        return np.asarray(np.exp(self.start + inside * np.asarray(self.step)))

    def least(self, function: Callable[[Array], Array]) -> tuple[Array, Array]:
        """Find the lowest point of each function and its value there, both of shape (..., 1).

        The function takes points, shape (..., m), and gives its values there. Its valleys are wider
        than 64 points: each 64th is looked at, then each eighth about the lowest of them, then
        each.

        Examples
        --------
        >>> grid = Grid(np.zeros((2, 1)), np.full((2, 1), 0.01), np.full((2, 1), 500))
        >>> middle = np.array([[2.0], [30.0]])
        >>> grid.least(lambda x: np.log(x / middle) ** 2)[0].round(1).ravel().tolist()
        [2.0, 30.0]
        """
        places = np.arange(0, int(np.max(self.points)) + _STRIDES[0] - 1, _STRIDES[0])
        for wide, step in pairwise(_STRIDES):
            lowest = _lowest(places, function(self.at(places)))
            places = lowest + np.arange(-wide, wide + 1, step)
        points = self.at(places)
        values = function(points)
        return _lowest(points, values), _lowest(values, values)


def _lowest(points: NDArray[Any], values: Array) -> NDArray[Any]:
    """Of the points of each function, the one with the least value, shape (..., 1)."""
    best = np.argmin(values, axis=-1)[..., None]
    return np.take_along_axis(np.broadcast_to(points, values.shape), best, axis=-1)
