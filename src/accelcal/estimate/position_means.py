"""Means of the readings of a table at each head position, which alone can show a head error."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Places
from accelcal.estimate.tables import PreparedTable
from accelcal.numerics.grouping import Grouped


class PositionMeans(NamedTuple):
    """Means of a table at the positions of all, in units of their own uncertainty; zero elsewhere.

    Attributes
    ----------
    places : ndarray of int
        Positions of the table among the J of all.
    at_head : Grouped
        The readings of the table by its positions.
    weight : ndarray, shape (n,)
        Inverse variances of the readings.
    norms : ndarray, shape (J,)
        Inverse uncertainty of the mean at each position.
    model : ndarray, shape (J, p)
        Orthonormal columns of the model.
    rate : ndarray, shape (J, 6)
        Derivative of the design by the angle [1/rad].
    largest : ndarray, shape (J,)
        Inverse scatter of the surest reading.
    """

    places: Places
    at_head: Grouped
    weight: Array
    norms: Array
    model: Array
    rate: Array
    largest: Array

    @classmethod
    def of(cls, table: PreparedTable, positions: Array) -> PositionMeans:
        """Bring the readings of a table to means at some of J positions, shape (J,) [deg]."""
        at_head = table.at_head
        places, first = np.searchsorted(positions, at_head.key), at_head.starts
        order = at_head.order

        def all_over(values: Array) -> Array:
            whole = np.zeros((positions.size, *values.shape[1:]))
            whole[places] = values
            return whole

        weight = table.scatter**-2.0
        norms = np.sqrt(at_head.sums(weight[:, None]))
        basis = at_head.sums(table.least_squares.basis, 1.0 / table.scatter)
        model = np.linalg.qr(basis / norms)[0]
        rate, largest = table.angular[order[first]], np.maximum.reduceat(weight[order], first)
        found = (norms[:, 0], model, rate, np.sqrt(largest))
        return cls(places, at_head, weight, *map(all_over, found))

    def of_readings(self, y: Array) -> Array:
        """Means of readings of shape (R, n), shape (R, J)."""
        means = np.zeros((len(y), self.norms.size))
        sums = self.at_head.sums(y.T, self.weight)
        means[:, self.places] = sums.T / self.norms[self.places]
        return means

    def free(self) -> Array:
        """Orthonormal contrasts of the means that no coefficient absorbs, shape (f, J)."""
        model = self.model[self.places]
        free = np.zeros((len(model) - model.shape[1], self.norms.size))
        free[:, self.places] = np.linalg.qr(model, mode="complete")[0][:, model.shape[1] :].T
        return free
