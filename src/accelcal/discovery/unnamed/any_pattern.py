"""How often a pattern of the position alone that stands in no catalogue would get these names.

A few positions show a few patterns, and effects that depend on the position alone come close to
nearly any of them: on 8 positions a voltmeter whose range changes is a fourth-order term, on 12 it
would pass for one beside an error of a head position.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.discovery.columns import dummies
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.explanation import BENT, Explanation, chance_beside
from accelcal.discovery.family import NEW, Family
from accelcal.discovery.spans import lengths, orthonormal, squares_in, without

_OF_POSITION = 0.9
"""Part of an effect's squares that must be the same in all strokes and runs."""

_FAINT = 0.05
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
    share = min(1.0, of_noise / _size_of_pattern(family, named, patterns, own))
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
    return np.asarray(vectors[:, sizes > _FAINT * sizes.max(initial=0.0)])


def _within(patterns: Array, directions: Array) -> Mask:
    return np.asarray(((patterns.T @ directions) ** 2).sum(axis=0) > _OF_POSITION)


def _size_of_pattern(family: Family, named: Explanation, patterns: Array, own: Mask) -> float:
    """Squares of the pattern, without what the other effects of the explanation take up."""
    others = np.linalg.qr(named.directions[:, ~own])[0]
    return squares_in(patterns, without(family.comparison.seen, others))


def _tries(family: Family, patterns: Array) -> float:
    """Independent tries of the effects that make such patterns."""
    found = family.candidates
    within = _within(patterns, found.directions)
    own = [bool(np.median(within[found.of(i)])) for i in range(len(family.tries))]
    return float(family.tries[own].sum())
