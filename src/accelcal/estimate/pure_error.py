"""Pure error: the scatter of readings at one head position about their mean."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.numerics.grouping import Grouped

FEW = 3
"""Degrees of freedom below which a scatter of its own says too little."""


class Scatter(NamedTuple):
    """Sums of squares in units of the declared scatter, shape (R,), with their dof."""

    squares: Array
    dof: Any  # float, or ndarray of shape (R,)

    @property
    def variance(self) -> Array:
        """Mean square."""
        return np.asarray(self.squares / self.dof)

    @classmethod
    def pooled(cls, scatters: Iterable[Scatter]) -> Scatter:
        """Put those of several tables together."""
        squares, dof = np.zeros(1), 0.0
        for scatter in scatters:
            squares, dof = squares + scatter.squares, dof + scatter.dof
        return cls(squares, dof)


def pure_error(output: Array, size: Array, positions: Grouped) -> Scatter:
    """Scatter of replicates about their weighted means, in R records, shape (R, n) [output unit].

    It counts in units of the declared standard uncertainties, shape (n,), which may be ones; of
    shape (R, n) they are infinite where a record has no reading.

    Examples
    --------
    >>> from accelcal.numerics.grouping import grouped
    >>> found = pure_error(np.array([[1.0, 3.0, 9.0]]), np.ones(3), grouped(np.array([0, 0, 90])))
    >>> found.squares.tolist(), float(found.dof)
    ([2.0], 1.0)
    """
    weight = size**-2.0
    means = positions.weighted_sums(output, weight) / positions.sums(weight[..., None])[..., 0]
    apart = (output - means[:, positions.cell]) / size
    dof = np.isfinite(size).sum(axis=-1) - float(positions.key.size)
    return Scatter(np.einsum("rn,rn->r", apart, apart), dof)
