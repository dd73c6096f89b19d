"""Which effects: the smallest sets of effects beside which nothing disagrees any more."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache, partial
from itertools import tee
from typing import NamedTuple

import numpy as np

from accelcal.discovery.columns import orthonormal, without
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.dead_zone import silent_first
from accelcal.discovery.explanation import Explanation, best_instances, best_place, explanation
from accelcal.discovery.family import Family, Judgement, chance, judge
from accelcal.discovery.instance import Instance
from accelcal.discovery.untold import scales
from accelcal.effects.time import APPROACH, USUAL

_BEAM = 12
"""Sets of effects from which larger sets are made."""

_TRIED = 36
"""Larger sets of effects that are fitted with all their parameters."""

_NEARLY_ALL, _CLEARLY = 0.98, 5.0
"""Part of the squares that effects take up which explain a disagreement in the main, and how many
times what they leave any other set must leave."""

_TAKEN_BACK = 0.1
"""Squares of effects together, as a share of those of each, below which they cancel."""

_UNNAMED = 0.5
"""Part of the false-alarm rate of a disagreement that has no name."""

_WORTH = 6.6
"""Squares that a time constant must take up: by noise alone it does so once in a hundred."""


def _levels(family: Family, alpha: float, most: int) -> Iterator[list[Explanation]]:
    """Sets of one effect, of two and so on, best first, each level made of the one before."""
    beam: list[frozenset[int]] = [frozenset()]
    for _ in range(most):
        found = _larger(family, beam, alpha)
        yield found
        beam = [_indices(family, e) for e in found[:_BEAM]]


class Findings(NamedTuple):
    """What a search found."""

    before: Judgement  # the family on the base model alone
    explanations: tuple[Explanation, ...]
    """Smallest sets of effects that leave nothing, best first, those behind in which effects
    cancel, then those with a bent law or less sure; empty where nothing disagrees or nothing in
    the catalogue explains it."""
    nearest: Explanation | None
    """Where nothing explains it, or noise as well, the effects that come nearest."""
    main: Explanation | None = None
    """Where nothing explains it whole, effects that take up nearly all of it, see `in_the_main`."""
    levels: Iterable[list[Explanation]] = ()  # all sets that were tried, and larger ones, once

    @property
    def named(self) -> tuple[Explanation, ...]:
        """Explanations of which the first has a name: those that leave nothing, or the main one."""
        return self.explanations or ((self.main,) if self.main else ())

    @property
    def instances(self) -> tuple[Instance, ...]:
        """Effects that have a name."""
        return self.named[0].instances if self.named else ()

    @property
    def best(self) -> Explanation | None:
        """The best explanation, or what comes nearest."""
        return self.explanations[0] if self.explanations else self.nearest

    @property
    def chance_without_name(self) -> float:
        """Chance that noise disagrees as much with the model, over the part that is for no name."""
        return min(1.0, self.before.p_value / _UNNAMED)


def search(family: Family, *, alpha: float = 0.01, most: int = 3) -> Findings:
    """Find the effects that explain a disagreement.

    The false-alarm rate alpha is that over the whole family; `most` is how many effects at once.
    """
    before = judge(family)
    levels, again = tee(_levels(family, alpha, most))  # worked out when somebody asks for them
    nearest: Explanation | None = None
    for tried in levels if before.p_value < alpha else ():
        needed = [e for e in tried if max(e.p_values) < alpha]
        # a bent law, or one a little less sure, is no name but a doubt about what is named
        passing = [e for e in tried if e.passes]
        passing.sort(key=lambda e: (not _is_sure(e, alpha), cancels(family.comparison, e)))
        if passing and _is_sure(passing[0], alpha):
            more = _beside_another_start(family, passing[0], alpha)
            found = silent_first(family.comparison, (*more, *passing), alpha)
            return Findings(before, found, None, None, again)
        # those that leave only noise come nearest; rounding alone orders nothing
        both = [*needed, *filter(None, [nearest])]
        nearest = max(both, key=lambda e: (e.passes, float(f"{e.squares:.6g}")), default=None)
    return Findings(before, (), nearest, None, again)


def in_the_main(
    comparison: Comparison, levels: Iterable[list[Explanation]], alpha: float
) -> Explanation | None:
    """Find the effects that explain nearly all of a disagreement which none explains whole.

    It is the smallest such set. There is none where another one leaves little more.
    """
    whole = float(comparison.seen @ comparison.seen)
    for tried in levels:
        near = [e for e in tried if _is_sure(e, alpha) and e.squares >= _NEARLY_ALL * whole]
        if near:
            left = whole - near[0].squares
            rivals = [e for e in tried if e is not near[0] and whole - e.squares < _CLEARLY * left]
            return None if rivals else near[0]
    return None


def _beside_another_start(
    family: Family, found: Explanation, alpha: float
) -> tuple[Explanation, ...]:
    """Set with one effect more, where runs that begin otherwise than usual hide its first readings.

    Such a beginning is chosen to suit them, so that what is left of a decay may pass for noise. It
    takes two parameters more than the beginning, and they must be worth it.
    """
    if all(item.shape.get(APPROACH, USUAL) == USUAL for item in found.instances):
        return ()
    space, seen = family.space, family.comparison.seen
    for more in _larger(family, [_indices(family, found)], alpha):
        others = [i for i in more.instances if i.shape.get(APPROACH, USUAL) != USUAL]
        if others or not more.passes or not _is_sure(more, alpha):
            continue
        variance = space.variance(without(seen, orthonormal(more.directions)))
        ratio = np.array((more.squares - found.squares) / 2.0 / variance)
        if chance(ratio, space.dof, 2) * family.tries.max() < alpha:
            return (more,)
    return ()


def _is_sure(found: Explanation, alpha: float) -> bool:
    return not found.bent and max(found.p_values) < alpha


def cancels(comparison: Comparison, found: Explanation) -> bool:
    """Whether effects mostly take back what the others of the set do, as large ones seldom will."""
    sizes = np.linalg.lstsq(found.directions, comparison.seen, rcond=None)[0]
    return bool(found.squares < _TAKEN_BACK * (sizes @ sizes))


def _indices(family: Family, found: Explanation) -> frozenset[int]:
    return frozenset(
        i for i, effect in enumerate(family.candidates.effects) if effect.id in found.ids
    )


def _larger(family: Family, beam: list[frozenset[int]], alpha: float) -> list[Explanation]:
    """Explanations with one effect more than those of the beam, best first."""
    every = range(len(family.candidates.effects))
    sets = {chosen | {other} for chosen in beam for other in every if other not in chosen}
    place = cache(partial(best_place, family))
    fitted = [best_instances(family, sorted(chosen), place) for chosen in sorted(sets, key=sorted)]
    fitted.sort(key=lambda item: -item[1])
    kept = fitted if beam == [frozenset()] else fitted[:_TRIED]
    found = [explanation(family, places, alpha) for places, _ in kept]
    worth = 0.0 if family.comparison.noise.rho else _WORTH
    return sorted(found, key=lambda one: (*_rank(one, worth), sorted(_indices(family, one))))


def _rank(found: Explanation, worth: float) -> tuple[float, float]:
    """The better fit first, then what noise makes rarer; rounding alone orders nothing.

    A decay of any length fits a straight drift and its noise, and must be worth its time constant.
    Where it passes for noise with a memory, nothing tells that yet.
    """
    spent = worth * sum(len(scales(item.effect)) for item in found.instances)
    return -float(f"{found.squares - spent:.6g}"), float(f"{max(found.p_values):.6g}")
