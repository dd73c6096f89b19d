"""Columns by what labels the readings, as run, cycle and position, and the spans of any columns.

A span has an orthonormal basis; what that leaves of other columns has lengths.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array, Ints, Places
from accelcal.effects.conditions import Conditions
from accelcal.head_angles import head_positions
from accelcal.numerics.grouping import cells

_CYCLES = 24
"""Cycles that are told apart; of longer runs as many stretches of cycles that follow each other."""

_MOVES = 0.02
"""Range on a side of T0 above which a level moves [degC]: usual slopes change K1 by 10 ppm."""

SMALL_UNITS = {"bias": "ug", "scale factor": "ppm", "misalignment": "urad"}
"""Unit of a millionth of what may change in the course of a run."""


def cycle_of(stroke: Ints) -> Ints:
    """Cycle of each stroke, a forward and a back one, from 0; or the stretch that it is in."""
    cycles = (stroke - 1) // 2
    return cycles * _CYCLES // max(int(cycles.max(initial=0)) + 1, _CYCLES)


def cycle(c: Conditions) -> Ints:
    """Cycle of each reading, or the stretch that it is in."""
    return cycle_of(c.stroke)


def stroke(c: Conditions) -> Ints:
    """Stroke of each reading, from 0; or its direction in a stretch of cycles."""
    return 2 * cycle(c) + (c.stroke - 1) % 2


def dummies(*keys: NDArray[np.generic]) -> Array:
    """Columns of zeros and ones, one for each combination of the keys that occurs."""
    index = cells(*keys)
    return np.asarray(index[:, None] == np.arange(index.max() + 1), dtype=np.float64)


def repeated(c: Conditions, mounting: NDArray[np.str_]) -> Array:
    """A column for each position of each run and mounting and sense of rotation, shape (n, k)."""
    return dummies(c.run, mounting, np.round(c.angle, 6), c.rotation)


def saturated(c: Conditions, mounting: NDArray[np.str_]) -> Array:
    """Columns that take up everything that repeats, so that only noise is left, shape (n, k).

    Run x mounting x position x sense of rotation, the cycles of each run, a drift in each run, a
    drift of each position from cycle to cycle, and what follows the temperature.
    """
    cycles = dummies(c.run, cycle(c))
    runs = dummies(c.run)
    drifts = runs * c.run_time[:, None]
    return np.hstack([repeated(c, mounting), cycles, drifts, worn(c), following(c)])


def following(c: Conditions) -> Array:
    """Bias, scale factor and misalignment that follow temperatures which move within runs, (n, k).

    There are none on a side of T0 where the recorded temperatures do not move, see `moves`.
    """
    runs = dummies(c.run)
    sides = np.stack([c.excess.clip(min=0.0), c.excess.clip(max=0.0)], axis=1)
    moved = sides - runs @ (runs.T @ sides / runs.sum(axis=0)[:, None])
    moved = moved[:, [moves(side, c) for side in moved.T]]
    return np.hstack([moved, moved * c.input[:, None], moved * c.cross[:, None]])


def moves(recorded: Array, c: Conditions) -> bool:
    """Tell whether recorded temperatures, shape (n,), move, and do more than scatter [degC].

    References
    ----------
    J. von Neumann, "Distribution of the ratio of the mean square successive difference to the
    variance", Ann. Math. Statist. 12 (1941) 367: of what scatters, it is about 2.
    """
    steps, away = np.diff(recorded[c.order]), recorded - recorded.mean()
    return bool(np.ptp(recorded) > _MOVES and steps @ steps < away @ away)


def worn(c: Conditions) -> Array:
    """Columns of positions that change from cycle to cycle, the same in all runs."""
    later = cycle(c) - cycle(c).mean()
    return np.asarray(dummies(head_positions(c.angle)) * later[:, None])


def head_columns(c: Conditions) -> Array:
    """Change of the readings with the angle of each head position [g/rad], shape (n, J)."""
    return (c.gain * c.per_radian)[:, None] * dummies(head_positions(c.angle))


def coefficient_columns(c: Conditions) -> dict[str, Array]:
    """Change of the indication with what may change in the course of a run [g per unit], (n,)."""
    return {"bias": np.ones_like(c.input), "scale factor": c.indicated, "misalignment": c.cross}


def lengths(columns: Array) -> Array:
    """Length of each column, shape (k,) for (n, k)."""
    return np.asarray(np.sqrt((columns**2).sum(axis=0)))


def scaled(columns: Array) -> tuple[Array, Array]:
    """Columns of length 1, and the lengths that they had; one of zeros stays, and has length 1."""
    norms = lengths(columns)
    norms[norms == 0.0] = 1.0
    return columns / norms, norms


def orthonormal(columns: Array) -> Array:
    """Orthonormal basis of the span of some columns, of whatever rank."""
    norms = lengths(columns)
    kept = columns[:, norms > 0.0] / norms[norms > 0.0]
    if kept.shape[1] < 2:
        return np.asarray(kept)
    values, vectors = _eigen(kept.T @ kept)
    good = values > 1e-11 * max(values[-1], 1.0)
    return np.asarray(kept @ (vectors[:, good] / np.sqrt(values[good])))


def beyond(basis: Array, taken: Array, least: float) -> Array:
    """Orthonormal basis of what another one, which is taken, leaves of a basis.

    It has the directions of which so much is left; which columns span the basis is all the same.
    """
    left = without(basis, taken)
    values, vectors = _eigen(left.T @ left)
    good = values > least**2
    return np.asarray(left @ (vectors[:, good] / np.sqrt(values[good])))


def _eigen(matrix: Array) -> tuple[Array, Array]:
    """Eigenvalues and vectors; where many are alike, LAPACK's quick way may not converge."""
    try:
        values, vectors = np.linalg.eigh(matrix)
    except np.linalg.LinAlgError:
        from scipy.linalg import eigh  # type: ignore[import-untyped]

        values, vectors = eigh(matrix, driver="ev")
    return values, vectors


def without(columns: Array, taken: Array) -> Array:
    """Take the span of an orthonormal basis out of some columns."""
    return np.asarray(columns - taken @ (taken.T @ columns))


def length_without(part: Array) -> Array:
    """Length that is left of unit vectors without a part of them, shape (k,).

    The part, shape (h, k), is that in an orthonormal basis.
    """
    return np.asarray(np.sqrt(np.maximum(1.0 - (part**2).sum(axis=0), 0.0)))


def squares_in(basis: Array, seen: Array) -> float:
    """Sum of squares of the part of a vector that an orthonormal basis spans."""
    return float(((basis.T @ seen) ** 2).sum())


def first_largest(values: Array, rounding: float = 1e-9) -> int:
    """Index of the first of `all_largest`."""
    return int(all_largest(values, rounding)[0])


def all_largest(values: Array, rounding: float = 1e-9) -> Places:
    """Indices of the largest of some values above zero, of all that are alike but for rounding.

    The largest alone would depend on the processor.
    """
    return np.flatnonzero(values >= (1.0 - rounding) * values.max(initial=0.0))
