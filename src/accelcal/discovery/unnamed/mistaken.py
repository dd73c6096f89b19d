"""What is taken for an effect: a bias that oscillates, or what is shifted for a time.

An oscillation with a period near that of a stroke turns with the head, and looks like backlash or
hysteresis; one with a period near that of a run looks like drifts and decays.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.columns import dummies
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.explanation import CONTRADICTION, Explanation
from accelcal.discovery.family import NEW, Family, agrees
from accelcal.discovery.spans import first_largest, lengths, orthonormal, squares_in, without
from accelcal.discovery.unnamed.beside_noise import MOST, Kind
from accelcal.discovery.unnamed.passing import once, oscillations
from accelcal.plural import listed
from accelcal.results.findings import Unexplained

_SLOWEST = 1.0
"""Periods in the longest run from which on a bias oscillates; what is slower could be anything."""

_QUICKEST = 1.25
"""Periods in a stroke up to which it oscillates; what is quicker looks like any pattern of the
position."""

_FAINT = 1e-6
"""Part of the largest square of some waves that the model leaves, below which it leaves none."""


class Instead(NamedTuple):
    """What explains most in place of some effects, of all of one kind."""

    ids: tuple[str, ...]  # of these effects
    beside: Array  # orthonormal, (n, h): it and what stays
    squares: float  # that it takes up
    gain: float  # logarithm of its likelihood over theirs, less what its sizes may gain by chance
    of_the_angle: float  # the same over any function of the angle in place of them
    told: str


def far_better(
    family: Family, found: Explanation, instead: Iterable[Instead], alpha: float, p_value: float
) -> Unexplained | None:
    """Find what explains much better than some effects, or than one of them, in their place.

    There is none where it gains no more than its sizes may by chance (Schwarz 1978), or where
    neither these effects nor it leave noise alone. The p-value is the chance that noise alone
    disagrees as much with the model. What it stands beside is told with it: a run that alone does
    not warm up settles the other way beside a warm-up.
    """
    whole = float(family.comparison.seen @ family.comparison.seen)
    for one in instead:
        if one.gain >= 0.0 and (found.passes or agrees(family, one.beside, CONTRADICTION * alpha)):
            stay = sorted(found.ids.difference(one.ids))
            told = f"beside {listed(stay)}: {one.told}" if stay else one.told
            return Unexplained(told, one.squares / whole, p_value)
    return None


def oscillations_in_place(comparison: Comparison, found: Explanation) -> Iterator[Instead]:
    """Find the best oscillation of the bias in place of all effects, and of each."""
    c = comparison.model.conditions
    quickest = _QUICKEST * float(c.stroke.max())
    kind = oscillations(c, comparison.record.run_labels, _SLOWEST, quickest)
    yield from _in_place(comparison, found, kind)


def shifts_in_place(comparison: Comparison, found: Explanation) -> Iterator[Instead]:
    """Find the best of what is shifted for a time, steps or settles in one run, in the same places.

    There is none where there are more than 600 degrees of freedom.
    """
    if comparison.space.dof <= MOST:
        kind = once(comparison.model.conditions, comparison.record.run_labels)
        yield from _in_place(comparison, found, kind)


def _in_place(comparison: Comparison, found: Explanation, kind: Kind) -> Iterator[Instead]:
    if not kind.actions.size:
        return
    space, seen = comparison.space, comparison.seen
    columns = kind.actions.toarray().T
    shown, is_shown = space.shown(columns)
    shown = np.where(is_shown, shown, 0.0)
    patterns = space.see(dummies(comparison.model.conditions.angle))
    margin = 2.0 * np.log(columns.shape[1] / kind.each) + (kind.each - 1) * np.log(seen.size)
    for ids, taken, squares in _places(comparison, found):
        left, own = without(seen, taken), without(shown, taken)
        own = np.where(lengths(own) > NEW * lengths(shown), own, 0.0)
        gains, sizes = _gains(own, left, kind.each)
        best = first_largest(gains)
        chosen = slice(best * kind.each, (best + 1) * kind.each)
        of_the_angle = squares_in(orthonormal(without(patterns, taken)), left)
        yield Instead(
            ids=ids,
            beside=orthonormal(np.hstack([taken, own[:, chosen]])),
            squares=float(gains[best]),
            gain=0.5 * float(gains[best] - squares - margin),
            of_the_angle=0.5 * float(gains[best] - of_the_angle - margin),
            told=kind.told(best, np.inf, columns[:, chosen] @ sizes[best]),
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
