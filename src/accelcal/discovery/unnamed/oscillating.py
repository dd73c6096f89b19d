"""A bias that oscillates where effects were taken for it.

With a period near that of a stroke it turns with the head, and looks like backlash or hysteresis;
with one near that of a run it looks like drifts and decays.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.columns import dummies
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.explanation import CONTRADICTION, Explanation
from accelcal.discovery.family import Family, agrees
from accelcal.discovery.spans import first_largest, orthonormal, squares_in, without
from accelcal.discovery.unnamed.passing import oscillations
from accelcal.results.findings import Unexplained

_SLOWEST = 1.0
"""Periods in the longest run from which on a bias oscillates; what is slower could be anything."""

_QUICKEST = 1.25
"""Periods in a stroke up to which it oscillates; what is quicker looks like any pattern of the
position."""

_FAINT = 1e-6
"""Part of the largest square of some waves that the model leaves, below which it leaves none."""


class Oscillation(NamedTuple):
    """The oscillation that explains most in place of some effects."""

    ids: tuple[str, ...]  # of these effects
    beside: Array  # orthonormal, (n, h): it and what stays
    squares: float  # that it takes up
    gain: float  # logarithm of its likelihood over theirs, less what its sizes may gain by chance
    of_the_angle: float  # the same over any function of the angle in place of them
    told: str


def oscillation_in_place(
    family: Family,
    found: Explanation,
    waves: Sequence[Oscillation],
    alpha: float,
    p_value: float,
) -> Unexplained | None:
    """Find a bias of one period, with a phase and a size in each run, that explains much better.

    It stands in place of some effects or of one of them. There is none where it gains no more than
    its sizes may by chance (Schwarz 1978), where any function of the angle explains as much, or
    where neither these effects nor it leave noise alone.
    The p-value is the chance that noise alone disagrees as much with the model.
    """
    whole = float(family.comparison.seen @ family.comparison.seen)
    for one in waves:
        better = min(one.gain, one.of_the_angle) >= 0.0
        if better and (found.passes or agrees(family, one.beside, CONTRADICTION * alpha)):
            return Unexplained(one.told, one.squares / whole, p_value)
    return None


def in_place_of_each(comparison: Comparison, found: Explanation) -> Iterator[Oscillation]:
    """Find the best oscillation in place of all effects, and of each."""
    space, c, seen = comparison.space, comparison.model.conditions, comparison.seen
    quickest = _QUICKEST * float(c.stroke.max())
    kind = oscillations(c, comparison.record.run_labels, _SLOWEST, quickest)
    if not kind.actions.size:
        return
    waves = kind.actions.toarray().T
    shown, patterns = space.see(waves), space.see(dummies(c.angle))
    margin = 2.0 * np.log(waves.shape[1] / kind.each) + (kind.each - 1) * np.log(seen.size)
    for ids, taken, squares in _places(comparison, found):
        gains, sizes = _gains(without(shown, taken), without(seen, taken), kind.each)
        best = first_largest(gains)
        own = slice(best * kind.each, (best + 1) * kind.each)
        of_the_angle = squares_in(orthonormal(without(patterns, taken)), without(seen, taken))
        yield Oscillation(
            ids=ids,
            beside=orthonormal(np.hstack([taken, shown[:, own]])),
            squares=float(gains[best]),
            gain=0.5 * float(gains[best] - squares - margin),
            of_the_angle=0.5 * float(gains[best] - of_the_angle - margin),
            told=kind.told(best, np.inf, waves[:, own] @ sizes[best]),
        )


def _places(
    comparison: Comparison, found: Explanation
) -> Iterator[tuple[tuple[str, ...], Array, float]]:
    """All effects and each: their ids, an orthonormal basis of the others, their squares."""
    ids = tuple(item.effect.id for item in found.instances)
    yield ids, comparison.space.nothing(), found.squares
    units, seen = found.directions, comparison.seen
    for place in range(units.shape[1] if units.shape[1] > 1 else 0):
        taken = orthonormal(np.delete(units, place, axis=1))
        own = orthonormal(without(units[:, [place]], taken))
        yield ids[place : place + 1], taken, squares_in(own, without(seen, taken))


def _gains(waves: Array, left: Array, each: int) -> tuple[Array, Array]:
    """Sum of squares that each period takes up, shape (s,), and the sizes of its waves, (s, k)."""
    columns = waves.T.reshape(-1, each, left.size)
    inverse = np.linalg.pinv(columns @ columns.mT, rcond=_FAINT, hermitian=True)
    shares = columns @ left
    sizes = (inverse @ shares[:, :, None])[:, :, 0]
    return (sizes * shares).sum(axis=1), sizes
