"""The factors of a test, by which a disagreement is described: blocks of columns, in order."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.columns import cycle, dummies, stroke, worn
from accelcal.discovery.space import Space
from accelcal.discovery.spans import lengths, orthonormal, without
from accelcal.effects.conditions import LEVEL_CHANGE, Conditions
from accelcal.head_angles import head_positions

_NEW = 0.5
"""Part of a unit vector's square beyond others from which on it is not rounding."""


class Block(NamedTuple):
    """What a factor may do to the readings, beyond what factors before it can do."""

    factor: str
    basis: Array  # orthonormal basis in the space, (n, k)


def blocks(space: Space, c: Conditions, first: str = "position") -> tuple[Block, ...]:
    """Split the space by those factors that the test has, `first` before all others.

    Each is orthogonal to those before it. What they do to the indication goes with the scale factor
    of the run, as the terms of the model do.
    """
    found: list[Block] = []
    taken = space.nothing()
    for factor, columns in sorted(_columns(c), key=lambda item: item[0] != first):
        columns = c.gain[:, None] * columns
        seen = space.see(columns)
        whole, shown = (lengths(each).max(initial=0.0) for each in (columns, seen))
        left = without(seen, taken)
        kept = lengths(left) > 1e-3 * max(shown, whole * 1e-6)
        basis = _beyond(orthonormal(left[:, kept]), taken)
        if basis.shape[1]:
            found.append(Block(factor, basis))
            taken = np.hstack([taken, basis])
    return tuple(found)


def _beyond(basis: Array, taken: Array) -> Array:
    """Directions that are new: rounding makes some of those that are nearly taken already."""
    for _ in range(2):
        basis = without(basis, taken)
    return orthonormal(basis[:, (basis**2).sum(axis=0) > _NEW])


def _columns(c: Conditions) -> Iterator[tuple[str, Array]]:
    position = dummies(head_positions(c.angle))
    direction = c.rotation[:, None]
    axes = np.stack([np.ones_like(c.input), c.input, c.cross], axis=1)
    hours = c.run_time / max(float(c.run_time.max()), 1e-9) - 0.5
    clock = c.time / max(float(c.time.max()), 1e-9) - 0.5
    yield "position", position
    yield "stroke", direction
    yield "stroke*position", direction * position
    turn = dummies(np.round(c.angle, 6))
    yield "turn", turn
    yield "stroke*turn", direction * turn
    if np.ptp(c.excess) >= LEVEL_CHANGE:
        level = dummies(np.round(c.excess / LEVEL_CHANGE))
        rise = np.stack([c.excess, np.abs(c.excess)], axis=1) / np.abs(c.excess).max()
        yield "temperature", level
        yield "temperature*position", _products(rise, position)
    if np.ptp(c.heating) > 0.0:
        yield "heating/cooling", _products(c.heating[:, None], axes)
    yield "time", np.stack([hours, hours**2, hours**3], axis=1)
    yield "time*position", _products(np.stack([hours, clock], axis=1), axes)
    yield "cycle", dummies(cycle(c))
    yield "cycle*position", worn(c)
    yield "stroke*cycle", dummies(stroke(c))
    runs = dummies(c.run)
    if runs.shape[1] > 1:
        yield "run", _products(runs, axes)
        yield "run*time", _products(runs, hours[:, None])
        yield "run*position", _products(runs, position)
        yield "run*cycle", dummies(c.run, cycle(c))
        yield "run*stroke", dummies(c.run, stroke(c))


def _products(a: Array, b: Array) -> Array:
    return np.asarray((a[:, :, None] * b[:, None, :]).reshape(a.shape[0], -1))
