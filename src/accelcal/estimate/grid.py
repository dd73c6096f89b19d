"""The least value of smooth functions on grids of equal ratios, for many functions at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Grid"]

Array = NDArray[np.float64]

_STRIDE = 16


class Grid(NamedTuple):
    """Points exp(start + i * step), i from 0 to points - 1, for each of many functions.

    Attributes
    ----------
    start, step : array_like, shape (..., 1)
        Logarithms of the first point and of the ratio of the points.
    points : array_like, shape (..., 1)
        Numbers of points.
    """

    start: ArrayLike
    step: ArrayLike
    points: ArrayLike

    def at(self, place: NDArray[np.intp]) -> Array:
        """Return the points at some places, shape (..., m); the last one beyond the end."""
        inside = np.minimum(np.maximum(place, 0), np.asarray(self.points) - 1)
        return np.asarray(np.exp(self.start + inside * np.asarray(self.step)))

    def least(self, function: Callable[[Array], Array]) -> tuple[Array, Array]:
        """Find where each function is least.

        Parameters
        ----------
        function : callable
            Takes points, shape (..., m), and gives its values there. Its valleys are wider than
            sixteen points: each sixteenth is looked at, then those about the lowest of them.

        Returns
        -------
        points, values : ndarray, shape (..., 1)
            The lowest points and the functions there.

        Examples
        --------
        >>> grid = Grid(np.zeros((2, 1)), np.full((2, 1), 0.01), np.full((2, 1), 500))
        >>> middle = np.array([[2.0], [30.0]])
        >>> grid.least(lambda x: np.log(x / middle) ** 2)[0].round(1).ravel().tolist()
        [2.0, 30.0]
        """
        rough = np.arange(0, int(np.max(self.points)) + _STRIDE - 1, _STRIDE)
        near = rough[np.argmin(function(self.at(rough)), axis=-1)][..., None]
        points = self.at(near + np.arange(-_STRIDE, _STRIDE + 1))
        values = function(points)
        best = np.argmin(values, axis=-1)[..., None]
        points = np.take_along_axis(points, best, axis=-1)
        return points, np.take_along_axis(values, best, axis=-1)
