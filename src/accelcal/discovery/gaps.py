"""The gap between model and readings: of those fitted, and of those that the others predict."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.discovery.columns import cycle
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.instance import Instance, columns_of
from accelcal.discovery.noise.covariance import whitener_of
from accelcal.discovery.solution import Solution, solution
from accelcal.discovery.spans import scaled
from accelcal.numerics.grouping import cells, grouped
from accelcal.results.findings import Gap

_FOLDS = 10


def gap_of(fit: Solution, held_out: float | None) -> Gap:
    """Gap that a fit leaves, with that of readings left out."""
    return Gap(float(np.sqrt(np.mean(fit.residual**2))), held_out, fit.chi2 / fit.dof)


def gaps_along(comparison: Comparison, instances: Sequence[Instance], seed: int = 0) -> list[Gap]:
    """Gap without effects, with the first one, the first two, to all, see `held_out_rms`."""
    sets = [instances[:k] for k in range(len(instances) + 1)]
    held = held_out_rms(comparison, sets, seed)
    return [gap_of(solution(comparison, own), out) for own, out in zip(sets, held, strict=True)]


def held_out_rms(
    comparison: Comparison, sets: Sequence[Sequence[Instance]], seed: int = 0
) -> list[float | None]:
    """Rms of reading minus prediction, each reading predicted from other cycles [g].

    There is one for each set of effects in the model, whose sizes are fitted anew and nonlinear
    parameters kept; None where there is one cycle only. The seed is that of the cycle that is left
    out at each run, position and sense of rotation.
    """
    c = comparison.model.conditions
    jacobian = comparison.model.jacobian(comparison.parameters)
    models = [np.hstack([jacobian, columns_of(effects, c)]) for effects in sets]
    residual = comparison.residual
    models = [np.column_stack([scaled(own)[0], residual]) for own in models]
    squares, readings = np.zeros(len(sets)), 0
    for out in _folds(comparison, np.random.default_rng(seed)):
        others = whitener_of(comparison.spread.among(~out))
        missed = [_missed(others.whitened(own[~out]), own[out]) for own in models]
        squares += [float(part @ part) for part in missed]
        readings += int(out.sum())
    return [float(np.sqrt(total / readings)) if readings else None for total in squares]


def _folds(comparison: Comparison, rng: np.random.Generator) -> Iterator[Mask]:
    """Readings left out in turn: in each cell another cycle, as a shuffled order has it.

    Of more than `_FOLDS` cycles, several are left out at a time.
    """
    c = comparison.model.conditions
    cycles = grouped(cycle(c))[0]
    if cycles.size < 2:
        return
    cell = cells(c.run, np.round(c.angle, 6), c.rotation)
    shift = rng.integers(cycles.size, size=int(cell.max()) + 1)
    turn = (np.searchsorted(cycles, cycle(c)) + shift[cell]) % cycles.size
    turn %= _FOLDS
    for fold in range(min(cycles.size, _FOLDS)):
        if (turn == fold).any() and (turn != fold).any():
            yield turn == fold


def _missed(others: Array, out: Array) -> Array:
    """Reading minus prediction of those left out [g].

    Both are columns of the model and the readings beside them, those of the others whitened.
    """
    solved = np.linalg.lstsq(others[:, :-1], others[:, -1], rcond=1e-9)[0]
    return np.asarray(out[:, -1] - out[:, :-1] @ solved)
