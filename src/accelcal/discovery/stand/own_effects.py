"""Effects that one unit has beside the others, whose readings tell what the stand does."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import NamedTuple

from accelcal.discovery.comparison import Comparison
from accelcal.discovery.explanation import Explanation
from accelcal.discovery.family import Family, family_of, judge, with_rates
from accelcal.discovery.instance import Instance
from accelcal.discovery.search import search
from accelcal.discovery.stand.joint_fit import (
    beside_the_others,
    known,
    of_another_head,
    shared_columns,
)
from accelcal.discovery.stand.mean_unit import Unit
from accelcal.discovery.stand.one_value import FEWEST
from accelcal.effects.effect import Effect


class OwnLook(NamedTuple):
    """A unit beside the others.

    Attributes
    ----------
    family : Family
        What is tested, on its readings without what the others tell of the stand.
    p_value : float
        Chance that noise alone disagrees as much.
    """

    family: Family
    p_value: float

    def explained(self, alpha: float, most: int) -> tuple[tuple[Explanation, ...], bool]:
        """Effects that explain the unit, best first, and whether they explain it fully."""
        found = search(self.family, alpha=alpha, most=most)
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
        self._families: dict[Hashable, Family] = {}

    def __call__(self, units: Sequence[Unit], number: int, shared: Sequence[Instance]) -> OwnLook:
        """Look at one unit."""
        unit = units[number]
        others = [*units[:number], *units[number + 1 :]] if len(units) >= FEWEST else []
        columns = shared_columns(unit, shared, self._head)
        told = known(others, shared, self._head, columns.shape[1])
        if not self._one_head:
            told = of_another_head(told, unit.head.shape[1], self._head)
        family = self._family(beside_the_others(unit, columns, told))
        return OwnLook(family, judge(family).p_value)

    def _family(self, comparison: Comparison) -> Family:
        """False-alarm rates hardly differ from unit to unit; the rest is that of the unit."""
        family = family_of(comparison, self._effects)
        if family.null not in self._families:
            self._families[family.null] = with_rates(family, self._seed)
        return family.with_rates_of(self._families[family.null])
