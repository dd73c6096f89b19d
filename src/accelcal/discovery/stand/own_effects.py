"""Effects that one unit has beside the others, whose readings tell what the stand does."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from accelcal.discovery.candidates import Instance, candidates
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.explanation import Explanation
from accelcal.discovery.factors import blocks
from accelcal.discovery.family import Family, family_of, judge
from accelcal.discovery.search import search
from accelcal.discovery.stand.joint_fit import (
    beside_the_others,
    known,
    of_another_head,
    shared_columns,
)
from accelcal.discovery.stand.mean_unit import Unit
from accelcal.effects.effect import Effect

FEWEST = 3
"""Units of which the others tell what the stand does."""


class OwnLook(NamedTuple):
    """A unit beside the others.

    Attributes
    ----------
    comparison : Comparison
        Its readings without what the others tell of the stand.
    family : Family
        What is tested.
    p_value : float
        Chance that noise alone disagrees as much.
    """

    comparison: Comparison
    family: Family
    p_value: float

    def explained(self, alpha: float, most: int) -> tuple[tuple[Explanation, ...], bool]:
        """Effects that explain the unit, best first, and whether they explain it fully."""
        c = self.comparison.model.conditions
        found = search(self.family, self.comparison.seen, c, alpha=alpha, most=most)
        near = () if found.nearest is None else (found.nearest,)
        return found.explanations or near, bool(found.explanations) or found.before.p_value >= alpha


class Looker:
    """Looks at units beside the others; the null of one plan and kind of noise is simulated once.

    Parameters
    ----------
    effects : sequence of Effect
        Effects to look for.
    head : float
        Declared uncertainty of a head position [rad].
    seed : int
        Of the simulated noise.
    one_head : bool, default True
        Whether the head positions that the others tell are those of the unit too.
    """

    def __init__(
        self, effects: Sequence[Effect], head: float, seed: int, *, one_head: bool = True
    ) -> None:
        self._effects, self._head, self._seed = effects, head, seed
        self._one_head = one_head or not head
        self._families: dict[object, Family] = {}

    def __call__(self, units: Sequence[Unit], number: int, shared: Sequence[Instance]) -> OwnLook:
        """Look at one unit."""
        unit = units[number]
        others = [*units[:number], *units[number + 1 :]] if len(units) >= FEWEST else []
        columns = shared_columns(unit, shared, self._head)
        told = known(others, shared, self._head, columns.shape[1])
        if not self._one_head:
            told = of_another_head(told, unit.head.shape[1], self._head)
        comparison = beside_the_others(unit, columns, told)
        family = self._family(comparison)
        return OwnLook(comparison, family, judge(family, comparison.seen).p_value)

    def _family(self, comparison: Comparison) -> Family:
        """False-alarm rates hardly differ from unit to unit; the rest is that of the unit."""
        c, noise = comparison.model.conditions, comparison.noise
        found = candidates(self._effects, comparison.space, c)
        factors = blocks(comparison.space, c)
        ids = tuple(effect.id for effect in found.effects)
        key = (ids, len(factors), bool(noise.rho), noise.tails)
        if key not in self._families:
            self._families[key] = family_of(
                comparison.space, found, factors, comparison.roots, noise.tails, self._seed
            )
        return self._families[key]._replace(
            space=comparison.space, candidates=found, blocks=factors
        )
