"""Where model and readings disagree: the share of each factor, and what its pattern looks like."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from accelcal.discovery.comparison import Comparison
from accelcal.discovery.factors import Block
from accelcal.discovery.family import chance, without
from accelcal.discovery.noise import orthonormal
from accelcal.results.findings import Share

__all__ = ["pattern", "shares", "structure"]

Array = NDArray[np.float64]

_HARMONICS = 8
_PURE = 0.8
"""Part of a pattern's squares that one harmonic must have to be called the pattern."""


def shares(comparison: Comparison, blocks: Sequence[Block]) -> tuple[Share, ...]:
    """Share of each factor in the disagreement, and the chance that it is noise.

    Parameters
    ----------
    comparison : Comparison
        Record and model.
    blocks : sequence of Block
        The factors, each orthogonal to those before it.

    Returns
    -------
    tuple of Share
        With Holm's p-values; what the shares leave of 1 is the repeatability.
    """
    space, seen = comparison.space, comparison.seen
    variance = float(space.pure_error(seen)) / space.dof
    squares = [float(((block.basis.T @ seen) ** 2).sum()) for block in blocks]
    single = [
        float(
            chance(np.array(s / block.basis.shape[1] / variance), space.dof, block.basis.shape[1])
        )
        for s, block in zip(squares, blocks, strict=True)
    ]
    total = float(seen @ seen)
    return tuple(
        Share(block.factor, s / total, p)
        for block, s, p in zip(blocks, squares, _holm(single), strict=True)
    )


def _holm(p: Sequence[float]) -> list[float]:
    """p-values made honest for their number, after Holm."""
    honest, largest = [1.0] * len(p), 0.0
    for rank, place in enumerate(np.argsort(p)):
        largest = max(largest, min(1.0, p[place] * (len(p) - rank)))
        honest[place] = largest
    return honest


def pattern(comparison: Comparison, block: Block, taken: Array | None = None) -> Array:
    """Part of the readings that a factor has, beside what has been explained [g], shape (n,).

    Parameters
    ----------
    comparison : Comparison
        Record and model.
    block : Block
        The factor.
    taken : ndarray, shape (m, h), optional
        Orthonormal basis of what has been explained.

    Returns
    -------
    ndarray, shape (n,)
        The pattern.
    """
    basis = block.basis if taken is None else orthonormal(without(block.basis, taken))
    whitened = comparison.space.rotation @ (basis @ (basis.T @ comparison.seen))
    return np.asarray(np.linalg.solve(comparison.space.whitener, whitened))


def structure(comparison: Comparison, block: Block, taken: Array | None = None) -> str:
    """Describe the pattern of a factor in words.

    Parameters
    ----------
    comparison : Comparison
        Record and model.
    block : Block
        The factor.
    taken : ndarray, shape (m, h), optional
        Orthonormal basis of what has been explained.

    Returns
    -------
    str
        What it follows, its harmonic, its size and where it is largest.
    """
    shape = pattern(comparison, block, taken)
    c = comparison.model.conditions
    largest = int(np.argmax(np.abs(shape)))
    size = float(np.sqrt(np.mean(shape**2)))
    sense = "forward" if c.rotation[largest] > 0 else "back"
    return (
        f"{_FOLLOWS.get(block.factor, block.factor)}{_harmonic(comparison, block.factor, shape)};"
        f" {size:.2g} g rms, largest {shape[largest]:+.2g} g at {c.angle[largest]:g} deg, {sense}"
        f" stroke {c.stroke[largest]}, run {comparison.record.run_labels[c.run[largest]]}"
    )


_FOLLOWS = {
    "position": "the same at each position in all strokes and runs",
    "stroke": "an offset between forward and back strokes",
    "stroke*position": "by position, opposite on forward and back strokes",
    "temperature": "by the temperature of the run",
    "temperature*position": "by position, growing with the temperature",
    "heating/cooling": "by the way to the temperature, heating or cooling",
    "time": "along the time in each run",
    "time*position": "by position, growing with time",
    "cycle": "by the cycle of the run",
    "run": "from run to run",
    "run*time": "along the time, otherwise in each run",
    "run*position": "by position, otherwise in each run",
    "run*cycle": "by the cycle, otherwise in each run",
}


def _harmonic(comparison: Comparison, factor: str, shape: Array) -> str:
    """Name the harmonic of the head angle that a pattern mostly is."""
    c = comparison.model.conditions
    signs = {
        "position": np.ones_like(c.angle),
        "stroke*position": c.rotation,
        "temperature*position": c.excess,
        "time*position": c.time - c.time.mean(),
    }
    if factor not in signs:
        return ""
    angle, best, name = np.radians(c.angle), 0.0, ""
    for n in range(1, _HARMONICS + 1):
        for word, wave in (("sin", np.sin(n * angle)), ("cos", np.cos(n * angle))):
            column = signs[factor] * wave
            norm = float(column @ column)
            part = float(column @ shape) ** 2 / norm if norm > 1e-9 else 0.0
            if part > best + 1e-9 * best:
                best, name = part, f"{word} {n}th" if n > 1 else f"{word} th"
    return f", as {name}" if best > _PURE * float(shape @ shape) else ""
