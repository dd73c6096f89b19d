"""Several strokes that are wrong alike, told by the wave that each of them holds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.gates.plan import TablePlan, once_a_plan
from accelcal.numerics.grouping import Grouped

FEWEST = 4
"""Strokes of which some may be wrong: of three, one is, or the other two are."""

_MOST = 0.7  # share of the squared residuals that must be waves: an order explains eight ninths


class Waves(NamedTuple):
    """Cosine and sine of the head angle, and how much of them is in each stroke.

    Attributes
    ----------
    columns : ndarray, shape (n, 2)
        Cosine and sine at each reading.
    inverse : ndarray, shape (S, 2, 2)
        Inverse of their normal matrix in each stroke.
    """

    columns: Array
    inverse: Array

    @classmethod
    def of(cls, angle: Array, strokes: Grouped) -> Waves:
        """Waves of readings at some angles [deg]."""
        phase = np.radians(angle)
        columns = np.stack([np.cos(phase), np.sin(phase)], axis=1)
        normal = strokes.products(columns, columns)
        return cls(columns, np.asarray(np.linalg.pinv(normal, hermitian=True), dtype=np.float64))

    def sums(self, values: Array, strokes: Grouped) -> Array:
        """Products with values of shape (n, T), summed over each stroke, shape (S, T, 2)."""
        return strokes.products(values, self.columns)

    def fit(self, values: Array, strokes: Grouped) -> Array:
        """Amplitudes of the waves in each stroke, shape (S, T, 2)."""
        return np.asarray(self.sums(values, strokes) @ self.inverse)


@once_a_plan
def _waves(plan: TablePlan) -> Waves:
    return Waves.of(plan.angle, plan.strokes)


def differ_by_waves(plan: TablePlan, residual: Array) -> Mask:
    """Tell where most of the residuals is a wave in each stroke.

    Parameters
    ----------
    plan : TablePlan
        Plan of the tables.
    residual : ndarray, shape (n, T)
        Their residuals.

    Returns
    -------
    ndarray of bool, shape (T,)
        Where some strokes may be wrong alike.
    """
    squares = (residual**2).sum(axis=0)
    if plan.strokes.key.size < FEWEST:
        return np.zeros(squares.size, dtype=np.bool_)
    waves = _waves(plan)
    sums = waves.sums(residual, plan.strokes)
    of_waves = np.einsum("stk,stk->t", sums @ waves.inverse, sums)
    return np.asarray(of_waves > _MOST * squares)


def odd_strokes(plan: TablePlan, output: Array, angle: Array, sign: float) -> Mask:
    """Find the strokes that hold the wave of most others once they are in another order.

    Parameters
    ----------
    plan : TablePlan
        Plan of the tables.
    output : ndarray, shape (n, T)
        Their readings.
    angle : ndarray, shape (n,)
        Angles of the readings in that order [deg].
    sign : float
        Sign of the outputs in it.

    Returns
    -------
    ndarray of bool, shape (S, T)
        Two strokes or more, at most half of all; none where there are no such ones.
    """
    strokes = plan.strokes
    given = _waves(plan).fit(output, strokes)
    other = sign * Waves.of(angle, strokes).fit(output, strokes)
    from_middle = np.linalg.norm(given - np.median(given, axis=0), axis=2)
    usual = np.take_along_axis(given, from_middle.argmin(axis=0)[None, :, None], axis=0)
    odd = np.linalg.norm(other - usual, axis=2) < np.linalg.norm(given - usual, axis=2)
    number = odd.sum(axis=0)
    return np.asarray(odd & (number >= 2) & (2 * number <= strokes.key.size))
