"""Columns by what labels the readings: run, cycle, position, and all that repeats in a test."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array, Ints
from accelcal.effects.conditions import Conditions
from accelcal.head_angles import head_positions
from accelcal.numerics.grouping import cells

_CYCLES = 24
"""Cycles that are told apart; of longer runs as many stretches of cycles that follow each other."""

MOVES = 0.05
"""Range of recorded temperatures above which a level moves: usual slopes change K1 by 25 ppm."""

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

    There are none on a side of T0 where the recorded temperatures do not move.
    """
    runs = dummies(c.run)
    sides = np.stack([c.excess.clip(min=0.0), c.excess.clip(max=0.0)], axis=1)
    moved = sides - runs @ (runs.T @ sides / runs.sum(axis=0)[:, None])
    moved = moved[:, np.ptp(moved, axis=0) > MOVES]
    return np.hstack([moved, moved * c.input[:, None], moved * c.cross[:, None]])


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
