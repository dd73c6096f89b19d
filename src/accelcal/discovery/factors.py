"""The factors of a test, by which a disagreement is described: blocks of columns, in order.

Each has a share of the disagreement, and a pattern that looks like something.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.columns import (
    cycle,
    dummies,
    first_largest,
    lengths,
    orthonormal,
    squares_in,
    stroke,
    without,
    worn,
)
from accelcal.discovery.space import Space
from accelcal.effects.conditions import LEVEL_CHANGE, Conditions
from accelcal.head_angles import head_positions
from accelcal.results.findings import Share

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


_HARMONICS = 8
_PURE = 0.8
"""Part of a pattern's squares that one harmonic must have to be called the pattern."""


def shares(seen: Array, blocks: Sequence[Block], single: Sequence[float]) -> tuple[Share, ...]:
    """Share of each factor in the disagreement, and the chance that it is noise.

    A single chance is that of a factor alone, see `accelcal.discovery.new_record.judgement`, from
    which those of Holm are made. What the shares leave of 1 is the repeatability.
    """
    total = float(seen @ seen) or 1.0  # without any disagreement all shares are 0
    return tuple(
        Share(block.factor, squares_in(block.basis, seen) / total, p)
        for block, p in zip(blocks, _holm(single), strict=True)
    )


def by_factor(found: Sequence[Share]) -> tuple[Share, ...]:
    """Join the shares of one factor: both ends of a turn, at one head angle, are two positions."""
    joined: dict[str, Share] = {}
    for each in found:
        factor = each.factor.replace("turn", "position")
        other = joined.get(factor, Share(factor, 0.0, 1.0))
        least = min(other.p_value, each.p_value)
        joined[factor] = Share(factor, other.share + each.share, least)
    return tuple(joined.values())


def _holm(p: Sequence[float]) -> list[float]:
    """p-values made honest for their number, after Holm."""
    honest, largest = [1.0] * len(p), 0.0
    for rank, place in enumerate(np.argsort(p)):
        largest = max(largest, min(1.0, p[place] * (len(p) - rank)))
        honest[place] = largest
    return honest


def pattern(space: Space, seen: Array, block: Block, taken: Array | None = None) -> Array:
    """Part of the readings that a factor has, beside what has been explained [g], shape (n,).

    Taken, shape (n, h), is an orthonormal basis of that.
    """
    basis = block.basis if taken is None else orthonormal(without(block.basis, taken))
    return space.unwhitened(basis @ (basis.T @ seen))


def structure(c: Conditions, runs: Sequence[str], factor: str, shape: Array) -> str:
    """Describe the pattern of a factor, shape (n,) [g]: what it follows, its harmonic and size."""
    largest = first_largest(np.abs(shape), 1e-6)
    size = float(np.sqrt(np.mean(shape**2)))
    sense = "forward" if c.rotation[largest] > 0 else "back"
    place = [f"{c.angle[largest]:g} deg"]
    if factor in _OF_THE_RUN:
        place.append(f"run {runs[c.run[largest]]}")
    elif factor in _OF_THE_SENSE:
        place.append(sense)
    elif factor not in _OF_THE_ANGLE:
        place += [f"{sense} stroke {c.stroke[largest]}", f"run {runs[c.run[largest]]}"]
    return (
        f"{_FOLLOWS.get(factor, factor)}{_harmonic(c, factor, shape)};"
        f" {size * 1e6:.3g} ug rms, largest {shape[largest] * 1e6:+.3g} ug at {', '.join(place)}"
    )


_FOLLOWS = {
    "position": "the same at each position in all strokes and runs",
    "stroke": "an offset between forward and back strokes",
    "stroke*position": "by position, opposite on forward and back strokes",
    "turn": "another at the end of a turn than at its start",
    "stroke*turn": "another at the end of a turn than at its start, opposite on back strokes",
    "temperature": "by the temperature of the run",
    "temperature*position": "by position, growing with the temperature",
    "heating/cooling": "by the way to the temperature, heating or cooling",
    "time": "along the time in each run",
    "time*position": "by position, growing with time",
    "cycle": "by the cycle of the run",
    "cycle*position": "by position, growing from cycle to cycle",
    "stroke*cycle": "by the stroke of the run",
    "run": "bias, scale factor or misalignment from run to run",
    "run*time": "along the time, otherwise in each run",
    "run*position": "by position, otherwise in each run",
    "run*cycle": "by the cycle, otherwise in each run",
    "run*stroke": "by the stroke, otherwise in each run",
}


_OF_THE_ANGLE = ("position", "turn")
_OF_THE_SENSE = ("stroke", "stroke*position", "stroke*turn")
_OF_THE_RUN = ("temperature", "temperature*position", "heating/cooling", "run", "run*position")
"""Factors whose pattern is the same in all strokes and runs, in all runs, or in all strokes."""


def _harmonic(c: Conditions, factor: str, shape: Array) -> str:
    """Name the harmonic of the head angle that a pattern mostly is."""
    signs = {
        "position": np.ones_like(c.angle),
        "stroke*position": c.rotation,
        "temperature*position": c.excess,
        "time*position": c.time - c.time.mean(),
        "cycle*position": cycle(c) - cycle(c).mean(),
    }
    if factor not in signs:
        return ""
    best, name = 0.0, ""
    for told, wave in _waves(np.radians(c.angle)):
        column = signs[factor] * wave
        norm = float(column @ column)
        part = float(column @ shape) ** 2 / norm if norm > 1e-9 else 0.0
        if part > best + 1e-9 * best:
            best, name = part, told
    return f", {name}" if best > _PURE * float(shape @ shape) else ""


def _waves(angle: Array) -> Iterator[tuple[str, Array]]:
    """What is alike at all head angles [rad], and the harmonics, with their names."""
    yield "alike at all angles", np.ones_like(angle)
    for n in range(1, _HARMONICS + 1):
        times = f"{n}th" if n > 1 else "th"
        yield f"as sin {times}", np.sin(n * angle)
        yield f"as cos {times}", np.cos(n * angle)
