"""Components of the errors of all coefficients of all tables, in a stack of records."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import accumulate, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arrays import Array
from accelcal.estimate.contrasts import LackOfFit, SeenErrors
from accelcal.estimate.correlated_noise import Correlation
from accelcal.estimate.head import HeadError
from accelcal.estimate.launch import RunShift
from accelcal.estimate.many_positions import ManyPositions, SeenAtMany
from accelcal.estimate.noise import ReadingNoise
from accelcal.estimate.tables import LinearEstimator
from accelcal.estimate.uncertainty import Component, counted
from accelcal.estimate.uneven_noise import UnevenNoise
from accelcal.model import SCALE_FACTOR
from accelcal.numerics.grouping import grouped

SHIFTED = {"launch": "K0", "launch_sf": "K1"}
"""The coefficient that each shift from run to run changes."""


class Errors(NamedTuple):
    """Errors of the readings of R records, as the least-squares fit shows them, and their way.

    Attributes
    ----------
    estimators : sequence of LinearEstimator
        What takes the readings of each table to coefficients, P in all; all records have them
        alike, but for gaps of their own.
    fitted : list of ndarray, shape (R, 6)
        Least-squares coefficients of each table.
    noises : list of ReadingNoise
        Reading noise of each table.
    lack_of_fit : LackOfFit or ManyPositions
        What the means of the positions show.
    of_head : HeadError
        Size of the errors of the head.
    seen : SeenErrors or SeenAtMany
        What is taken out of the readings.
    uneven : sequence of UnevenNoise
        Noise of each table by position.
    correlation : Correlation
        Correlation of each reading with the next one.
    influence : ndarray, shape (R, P, J)
        Of independent errors of J positions [output unit / rad].
    """

    estimators: Sequence[LinearEstimator]
    fitted: list[Array]
    noises: list[ReadingNoise]
    lack_of_fit: LackOfFit | ManyPositions
    of_head: HeadError
    seen: SeenErrors | SeenAtMany
    uneven: Sequence[UnevenNoise]
    correlation: Correlation
    influence: Array

    def predicted(self) -> list[Array]:
        """What the head errors that are seen do to the coefficients of each table, shape (R, p)."""
        whole = (self.influence @ self.seen.values[..., None])[..., 0]
        return np.split(whole, self._edges()[1:-1], axis=1)

    def reading(self) -> Component:
        """Errors by the noise of the readings, directly and through the prediction."""
        whole = self.seen.noise(self.influence)
        dof = self._per_coefficient(np.stack([n.dof for n in self.noises], axis=1))
        noises = zip(self.noises, self.uneven, strict=True)
        for e, (noise, uneven), part in zip(self.estimators, noises, self._parts(), strict=True):
            spread = e.map * np.nan_to_num(e.table.scatter, posinf=0.0)[..., None, :]
            own = noise.factor[:, None, None] ** 2 * (spread @ spread.mT)
            if uneven.differs.any():
                through = e.table.at_head.products(e.map.mT, e.map.mT)
                own[uneven.differs], dof[uneven.differs, part] = uneven.noise(through)
            if (some := self.correlation.counts).any():
                alone = own[some], dof[some, part]
                own[some], dof[some, part] = self.correlation.beside(e.table, spread, noise, *alone)
            whole[:, part, part] += own
        return Component(whole, dof)

    def head(self) -> dict[str, Component]:
        """Errors by what the prediction misses of the head's errors, where they are known."""
        head = self.of_head
        if head.source == "none":
            return {}
        missed = self.seen.missed(self.influence, head.uncertainty)
        dof = np.repeat(counted(head.dof)[:, None], missed.shape[1], axis=1)
        return {"head": Component(missed, dof)}

    def shifts(self, known: Mapping[str, RunShift]) -> dict[str, Component]:
        """Errors by the shifts from run to run, where they are known."""
        return {
            name: self._shift(SHIFTED[name], shift)
            for name, shift in known.items()
            if shift.source != "none"
        }

    def _shift(self, coefficient: str, shift: RunShift) -> Component:
        """Errors by the shift of one coefficient from run to run, common to a run's mountings."""
        run = grouped(np.array([e.table.run for e in self.estimators])).cell
        scale_factors = np.stack([k[:, SCALE_FACTOR] for k in self.fitted], axis=1)
        size = scale_factors * shift.of_run[:, run]
        names = [name for e in self.estimators for name in e.names]
        at = np.flatnonzero(np.equal(names, coefficient))
        table = self._per_coefficient(np.arange(run.size))[at]
        size_at, run_at = size[:, table], run[table]
        whole = np.zeros((len(size), len(names), len(names)))
        among = size_at[:, :, None] * size_at[:, None, :] * np.equal.outer(run_at, run_at)
        whole[:, at[:, None], at] = among
        dof = np.broadcast_to(counted(shift.dof_of_run)[run], size.shape)
        return Component(whole, self._per_coefficient(dof))

    def resolution(self, steps: Sequence[ArrayLike]) -> dict[str, Component]:
        """Rounding errors that the reading noise does not hold, where it does not hold all."""
        left = [
            noise.rounding(e.table, step)
            for e, noise, step in zip(self.estimators, self.noises, steps, strict=True)
        ]
        if not np.any(left):
            return {}
        whole = np.zeros((len(self.influence), *2 * self.influence.shape[1:2]))
        for e, (common, own), part in zip(self.estimators, left, self._parts(), strict=True):
            means = e.table.at_head.sums(e.map.mT).mT
            whole[:, part, part] += common[:, None, None] ** 2 * (means @ means.mT)
            whole[:, part, part] += own[:, None, None] ** 2 * (e.map @ e.map.mT)
        return {"resolution": Component(whole, np.full(whole.shape[:2], np.inf))}

    def _edges(self) -> list[int]:
        return [0, *accumulate(len(e.names) for e in self.estimators)]

    def _per_coefficient(self, values: ArrayLike) -> Array:
        """Repeat a value of each table, shape (..., tables), for each of its coefficients."""
        return np.repeat(values, [len(e.names) for e in self.estimators], axis=-1)

    def _parts(self) -> Iterator[slice]:
        """Places of the coefficients of each table."""
        return (slice(*edges) for edges in pairwise(self._edges()))


def influence_of_head(
    estimators: Sequence[LinearEstimator],
    coefficients: Sequence[Array],
    positions: Array,
    root: Array | None,
) -> Array:
    """What independent errors of the positions do to the coefficients of all tables.

    The root, shape (J, J), makes errors of the head of independent ones of one size; None where
    they are.
    """
    parts = [_influence(e, k, positions) for e, k in zip(estimators, coefficients, strict=True)]
    whole = np.concatenate(parts, axis=1)
    return whole if root is None else whole @ root


def _influence(estimator: LinearEstimator, coefficients: Array, positions: Array) -> Array:
    """What errors of the positions do to the coefficients of one table, shape (R, p, J)."""
    table = estimator.table
    acting = table.at_head.products(estimator.map.mT, table.angular)
    by_coefficient = np.zeros((*acting.shape[:-3], positions.size, *acting.shape[-2:]))
    by_coefficient[..., np.searchsorted(positions, table.at_head.key), :, :] = acting
    if by_coefficient.ndim == 3:
        return np.asarray(np.tensordot(coefficients, by_coefficient.T, axes=1))
    return np.asarray(np.einsum("rc,rjpc->rpj", coefficients, by_coefficient))
