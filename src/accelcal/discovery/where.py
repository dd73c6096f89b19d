"""Where model and readings disagree: the share of each factor, and what its pattern looks like."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.columns import cycle
from accelcal.discovery.factors import Block
from accelcal.discovery.space import Space
from accelcal.discovery.spans import first_largest, orthonormal, squares_in, without
from accelcal.effects.conditions import Conditions
from accelcal.results.findings import Share

_HARMONICS = 8
_PURE = 0.8
"""Part of a pattern's squares that one harmonic must have to be called the pattern."""


def shares(seen: Array, blocks: Sequence[Block], single: Sequence[float]) -> tuple[Share, ...]:
    """Share of each factor in the disagreement, and the chance that it is noise.

    A single chance is that of a factor alone, see `accelcal.discovery.new_record.chances`, from
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
