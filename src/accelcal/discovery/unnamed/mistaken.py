"""What is taken for an effect: a bias that oscillates, what is shifted for a time, any pattern.

An oscillation with a period near that of a stroke turns with the head, and looks like backlash or
hysteresis; one with a period near that of a run looks like drifts and decays.

A few positions show a few patterns, and effects that depend on the position alone come close to
nearly any of them: on 8 positions a voltmeter whose range changes is a fourth-order term, on 12 it
would pass for one beside an error of a head position.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.discovery.columns import (
    dummies,
    first_largest,
    lengths,
    orthonormal,
    squares_in,
    without,
)
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.explanation import BENT, CONTRADICTION, Explanation, chance_beside
from accelcal.discovery.family import NEW, Family, agrees
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


_OF_POSITION = 0.9
"""Part of an effect's squares that must be the same in all strokes and runs."""

_WEAK = 0.05
"""Part of the largest pattern from which on one counts."""

_Parity = tuple[int | None, int]

_OF_INPUT: _Parity = (None, 0)
"""What is a function of cos th, as of the acceleration along the input axis."""

_PARITIES: tuple[_Parity, ...] = ((0, 0), (0, 1), (1, 0), (1, 1))
"""Whether a pattern changes its sign with cos th, and with sin th."""


class AnyPattern(NamedTuple):
    """Effects that depend on the position alone, and what else would look like them."""

    ids: tuple[str, ...]  # effects of one kind
    patterns: int  # how many patterns of that kind the readings show
    chance: float
    """Of patterns of any shape, as large as this one, the share that some set of as many effects
    would explain as well."""


def any_patterns(family: Family, named: Explanation) -> Iterator[AnyPattern]:
    """Tell how often any pattern of the position would get such names.

    It is told for all effects that depend on the position alone, for those of them that are
    functions of cos th, and for those that change their signs alike with cos th and with sin th;
    not where the readings show what the effects do beside all patterns of that kind.

    Notes
    -----
    Of a random direction in d dimensions the share sin^2 that k directions leave is that of a Beta
    distribution with (d - k)/2 and k/2. It must be no more than what noise leaves of the pattern.
    There are as many sets as the tries of the effects allow, which bounds the chance.
    """
    comparison = family.comparison
    static = of_position(comparison, named.directions)
    for parity in (None, _OF_INPUT, *_PARITIES) if static.any() else ():
        patterns = _patterns(comparison, parity)
        own = static & _within(patterns, named.directions)
        if own.any() and not _show_more(comparison, named.directions, patterns, own):
            yield _told(family, named, patterns, own)


def of_position(comparison: Comparison, directions: Array) -> Mask:
    """Tell which effects depend on the position alone, by their unit vectors, shape (n, h)."""
    return _within(_patterns(comparison, None), directions)


def _show_more(comparison: Comparison, directions: Array, patterns: Array, own: Mask) -> bool:
    """Whether the readings show of some effects what no pattern of a kind has."""
    beside = orthonormal(np.hstack([patterns, directions[:, ~own]]))
    more = without(directions[:, own], beside)
    return chance_beside(comparison, more[:, lengths(more) > NEW], beside) < BENT


def _told(family: Family, named: Explanation, patterns: Array, own: Mask) -> AnyPattern:
    from scipy.special import betainc, binom  # type: ignore[import-untyped]

    count = int(np.count_nonzero(own))
    left = patterns.shape[1] - count
    ids = tuple(i.effect.id for i, is_own in zip(named.instances, own, strict=True) if is_own)
    if left <= 0:
        return AnyPattern(ids, patterns.shape[1], 1.0)
    of_noise = left + 2.0 * np.sqrt(2.0 * left)
    others = np.linalg.qr(named.directions[:, ~own])[0]
    size = squares_in(patterns, without(family.comparison.seen, others))
    share = min(1.0, of_noise / size)
    sets = float(binom(max(_tries(family, patterns), count), count))
    chance = -np.expm1(-sets * betainc(left / 2.0, count / 2.0, share))
    return AnyPattern(ids, patterns.shape[1], float(chance))


def _patterns(comparison: Comparison, parity: _Parity | None) -> Array:
    """Orthonormal basis of what repeats with the position in all strokes and runs, (n, d).

    With a parity, of what changes its sign with cos th and with sin th as often as that says.
    """
    c, space = comparison.model.conditions, comparison.space
    mounting, angle = comparison.record.mounting, np.radians(c.angle)
    cos, sin = np.round(np.cos(angle), 9), np.round(np.sin(angle), 9)
    if parity is None:
        columns = dummies(mounting, cos, sin)
    else:
        of_cos, of_sin = parity
        signs = np.sign(cos) ** (of_cos or 0) * np.sign(sin) ** of_sin
        columns = signs[:, None] * dummies(mounting, cos if of_cos is None else np.abs(cos))
    whole = space.whiten(c.gain[:, None] * columns[:, columns.any(axis=0)])
    vectors, sizes, _ = np.linalg.svd(space.left_of(whole) / lengths(whole), full_matrices=False)
    return np.asarray(vectors[:, sizes > _WEAK * sizes.max(initial=0.0)])


def _within(patterns: Array, directions: Array) -> Mask:
    return np.asarray(((patterns.T @ directions) ** 2).sum(axis=0) > _OF_POSITION)


def _tries(family: Family, patterns: Array) -> float:
    """Independent tries of the effects that make such patterns."""
    found = family.candidates
    within = _within(patterns, found.directions)
    own = [bool(np.median(within[found.of(i)])) for i in range(len(family.tries))]
    return float(family.tries[own].sum())
