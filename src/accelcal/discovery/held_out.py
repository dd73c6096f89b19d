"""The gap on readings that were not fitted: the model is fitted to the others and predicts them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from accelcal.discovery.candidates import Instance, column_of
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.noise import cells, cycle
from accelcal.grouping import grouped

__all__ = ["held_out_rms"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def held_out_rms(
    comparison: Comparison, instances: Sequence[Instance] = (), seed: int = 0
) -> float | None:
    """Rms of reading minus prediction, each reading predicted from other cycles.

    Parameters
    ----------
    comparison : Comparison
        The record and its noise.
    instances : sequence of Instance
        Effects in the model; their sizes are fitted anew, their nonlinear parameters kept.
    seed : int, default 0
        Of the cycle that is left out at each run, position and sense of rotation.

    Returns
    -------
    float or None
        The rms [g]; None where there is one cycle only.
    """
    c = comparison.model.conditions
    jacobian = comparison.model.jacobian(comparison.parameters)
    columns = np.column_stack([jacobian, *(column_of(item, c) for item in instances)])
    residual = comparison.model.residual(comparison.parameters)
    folds = list(_folds(comparison, np.random.default_rng(seed)))
    if not folds:
        return None
    squares = sum(float((_missed(comparison, columns, residual, out) ** 2).sum()) for out in folds)
    return float(np.sqrt(squares / sum(int(out.sum()) for out in folds)))


def _folds(comparison: Comparison, rng: np.random.Generator) -> Iterator[Mask]:
    """Readings left out in turn: in each cell another cycle, as a shuffled order has it."""
    c = comparison.model.conditions
    cycles = grouped(cycle(c))[0]
    if cycles.size < 2:
        return
    cell = cells(c.run, np.round(c.angle, 6), c.rotation)
    shift = rng.integers(cycles.size, size=int(cell.max()) + 1)
    turn = (np.searchsorted(cycles, cycle(c)) + shift[cell]) % cycles.size
    for fold in range(cycles.size):
        if (turn == fold).any() and (turn != fold).any():
            yield turn == fold


def _missed(comparison: Comparison, columns: Array, residual: Array, out: Mask) -> Array:
    """Reading minus prediction of those left out [g]."""
    lower = np.linalg.cholesky(comparison.spread[np.ix_(~out, ~out)])
    norms = np.sqrt((columns**2).sum(axis=0))
    norms[norms == 0.0] = 1.0
    scaled = np.linalg.solve(lower, columns[~out] / norms)
    solved = np.linalg.lstsq(scaled, np.linalg.solve(lower, residual[~out]), rcond=1e-9)[0]
    return np.asarray(residual[out] - (columns[out] / norms) @ solved)
