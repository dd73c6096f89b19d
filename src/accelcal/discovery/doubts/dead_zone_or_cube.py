"""A dead zone and what has its pattern at these positions: K1, K3 and M hang on which it is.

With steps of 45 deg one narrower than the misalignment acts as a_p^3 does. Where the readings tell
no more than that it is one of the two, nothing bounds what is another coefficient with the other.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from accelcal.discovery.comparison import Comparison
from accelcal.discovery.explanation import Explanation
from accelcal.discovery.instance import Instance, replaced
from accelcal.discovery.silence import DEAD_ZONE, silent_in
from accelcal.discovery.solution import changes, solution
from accelcal.discovery.unnamed.wandering import POSSIBLE
from accelcal.discovery.untold import fitted_sizes, squares_left
from accelcal.effects.catalogue import catalogue
from accelcal.model import symbol_of
from accelcal.results.findings import Change, FoundEffect

APART = 2.0
"""Standard uncertainties from which on a coefficient is another one."""


class Undecided(NamedTuple):
    """An effect, what could stand in its place, and the coefficients that are others then."""

    name: str
    rival: str
    coefficients: tuple[str, ...]


def said_of_rivals(
    comparison: Comparison, found: Sequence[Explanation]
) -> Iterator[tuple[str, list[str]]]:
    """Say of which coefficients nothing tells whether a dead zone acts on them, with the effect."""
    best = found[0]
    rivals = {item.effect.id: in_place_of(found, best, item.effect.id) for item in best.instances}
    for one in undecided(comparison, best.instances, rivals):
        names = ", ".join(map(symbol_of, one.coefficients))
        yield (
            f"{one.name} is not sure: {one.rival} explains these readings as well, with other"
            f" values of {names}; nothing bounds that, and no U counts it; to tell:"
            " positions 22.5 deg apart, or fine steps of the head about the two near 0 g",
            [one.name],
        )


def in_place_of(found: Sequence[Explanation], named: Explanation, name: str) -> tuple[str, ...]:
    """Ids that explain the readings too in place of one effect, the others being the same."""
    rest = named.ids - {name}
    others = [other.ids - rest for other in found if rest <= other.ids]
    return tuple(next(iter(ids)) for ids in others if len(ids) == 1 and name not in ids)


def undecided(
    comparison: Comparison, instances: Sequence[Instance], rivals: Mapping[str, Sequence[str]]
) -> Iterator[Undecided]:
    """Find effects with a rival as good, one of the two being a dead zone.

    The rivals are ids of what a discovery found in place of each effect. There are none where no
    coefficients hang on it, nor where some readings are silent, as a dead zone is sure then.
    """
    if silent_in(comparison.model.conditions).any():
        return
    entries = {entry.id: entry for entry in catalogue()}
    for place, item in enumerate(instances):
        for name in rivals.get(item.effect.id, ()):
            entry = entries.get(name)
            if DEAD_ZONE not in (name, item.effect.id) or not entry or len(entry.parameters) != 1:
                continue
            others = replaced(instances, place, Instance(entry, (1.0,), {}))
            apart = unlike(comparison, instances, others)
            if apart and _as_likely(comparison, instances, others, place):
                yield Undecided(item.effect.id, name, apart)


def _as_likely(
    comparison: Comparison, some: Sequence[Instance], others: Sequence[Instance], place: int
) -> bool:
    """Whether others, of which one is in the place of another, explain the readings as well."""
    worse = squares_left(comparison, others) - squares_left(comparison, some)
    (lowest,) = (parameter.minimum for parameter in others[place].amplitudes)
    size = fitted_sizes(comparison, others).of_each[place][0]
    return worse < -2.0 * float(np.log(POSSIBLE)) and bool(size > lowest)


def unlike(
    comparison: Comparison, some: Sequence[Instance], others: Sequence[Instance]
) -> tuple[str, ...]:
    """Coefficients that are not the same beside some effects and beside others.

    The slopes of the scale factor go with it, and are the same over it.
    """
    bare = solution(comparison)
    one, two = (changes(comparison, bare, solution(comparison, own)) for own in (some, others))
    pairs = zip(one, two, strict=True)
    unlike = [old.coefficient for old, new in pairs if apart(old, new) > APART]
    return tuple(name for name in unlike if not name.startswith("K1 "))


def apart(one: Change, other: Change) -> float:
    """Tell by how many standard uncertainties a coefficient is another one beside other effects."""
    uncertainty = one.after.standard_uncertainty
    if not uncertainty or one.after.value is None or other.after.value is None:
        return 0.0
    return abs(one.after.value - other.after.value) / uncertainty


def left_undecided(
    comparison: Comparison, instances: Sequence[Instance], effects: Sequence[FoundEffect]
) -> tuple[str, ...]:
    """Coefficients that hang on whether effects, as a discovery tells them, are a dead zone."""
    rivals = {found.id: found.indistinguishable for found in effects}
    found = undecided(comparison, instances, rivals)
    return tuple(dict.fromkeys(name for one in found for name in one.coefficients))


def in_fit(name: str) -> str:
    """Name of a coefficient in a calibration, which has one misalignment in each mounting."""
    return "M" if name.partition(" ")[0] in ("M", "M_O", "M_P") else name
