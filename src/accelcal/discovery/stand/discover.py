"""The stand or the unit: over several units of one stand, whose each effect is."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from accelcal.arguments.kinds import each_of
from accelcal.discovery.comparison import compared
from accelcal.discovery.dead_zone import (
    OPEN,
    in_place_of,
    said_of_silence,
    unbounded,
    without_bound,
)
from accelcal.discovery.discover import answered, check_search
from accelcal.discovery.family import judge
from accelcal.discovery.instance import Instance, searched_among
from accelcal.discovery.large_effects import DEAD_ZONE, silent_readings
from accelcal.discovery.look import Question
from accelcal.discovery.stand.ownership import (
    FEWEST,
    Looker,
    Own,
    common_effects,
    explained,
    head_of,
    instances_in,
    one_value,
    own_effects,
)
from accelcal.discovery.stand.units import (
    Unit,
    check_one_plan,
    coefficients,
    mean_unit,
    on_one_stand,
    without_head,
)
from accelcal.discovery.unwritten import as_searched
from accelcal.effects.effect import Effect
from accelcal.errors import InputError
from accelcal.estimate.at_positions import refuse_twice
from accelcal.numerics.one_thread import in_one_thread
from accelcal.plural import listed
from accelcal.record import TumbleRecord
from accelcal.reference import fixture_angle, reference_temperature_of
from accelcal.results.discovery import Discovery
from accelcal.results.stand_discovery import StandDiscovery, StandEffect

__all__ = ["discover_stand"]


class _Stand(NamedTuple):
    """Records of one stand, what is asked of them, and the declared uncertainty of its head."""

    records: Sequence[TumbleRecord]
    question: Question
    head: float | None

    @property
    def alpha_of_a_unit(self) -> float:
        """False-alarm rate for what one unit has alone."""
        return self.question.alpha / (2.0 * len(self.records))


class _State(NamedTuple):
    """What is known after a round."""

    units: list[Unit]
    shared: tuple[Instance, ...]
    own: dict[int, Own]

    @property
    def ids(self) -> tuple[set[str], dict[int, set[str]]]:
        """Ids of the effects of the stand and of each unit."""
        own = {n: {item.effect.id for item in told.instances} for n, told in self.own.items()}
        return {item.effect.id for item in self.shared}, own


def discover_stand(
    records: Sequence[TumbleRecord],
    *,
    alpha: float = 0.01,
    max_effects: int = 3,
    reference_temperature: float | None = None,
    delta0: float | None = None,
    effects: Sequence[Effect] | None = None,
    seed: int = 0,
) -> StandDiscovery:
    """Find which effects belong to the stand and which to a unit, over several units of one stand.

    Parameters
    ----------
    records : sequence of TumbleRecord
        Readings of two or more units, each in the same plan.
    alpha : float, default 0.01
        False-alarm rate over all units and all that is searched: half of it for what they have in
        common, half for what each has alone.
    max_effects : int, default 3
        Effects at once, of the stand and of each unit.
    reference_temperature, delta0 : float, optional
        As in `accelcal.discover`.
    effects : sequence of Effect, optional
        Effects to look for, one or more; by default those of the catalogue.
    seed : int, default 0
        Of the noise that is simulated to find the false-alarm rate.

    Returns
    -------
    StandDiscovery
        Whose each effect is, the head positions, and the coefficients of each unit fitted alone
        and jointly.

    Raises
    ------
    InputError
        If the units have not one plan, one T0, one head, or too few replicates.

    Notes
    -----
    What units have in common shows in their mean, in which the noise of each averages out. An
    effect of the mean is the stand's if one size does for all of three units or more and they rule
    out a spread as of an effect that only half of them have. What a unit has alone is looked for
    beside the others, which tell the effects of the stand and the head positions; the units with
    effects of their own leave the common part one by one, the clearest first.

    Examples
    --------
    >>> import accelcal
    >>> backlash = accelcal.effect("backlash").of(2e-5)
    >>> same = accelcal.NoiseComponents(head=0.0)
    >>> records = [
    ...     accelcal.simulate(noise=same, effects=[backlash], seed=seed) for seed in (1, 2, 3)
    ... ]
    >>> found = accelcal.discover_stand(records)
    >>> [(item.id, item.verdict) for item in found.effects]
    [('backlash', 'stand')]
    """
    records = list(each_of(records, TumbleRecord))
    check_search(alpha, max_effects, seed)
    records = [as_searched(record, delta0) for record in records]
    check_one_plan(records)
    refuse_twice(records)
    question = Question(
        reference=_one_reference(records, reference_temperature),
        delta0=fixture_angle(records[0], delta0),
        effects=searched_among(effects),
        alpha=alpha,
        most=int(max_effects),
        seed=int(seed),
    )
    stand = _Stand(on_one_stand(records), question, records[0].apparatus.head_uncertainty)
    with in_one_thread():
        return _told(stand, *_settled(stand))


def _one_reference(records: Sequence[TumbleRecord], given: float | None) -> float:
    found = {reference_temperature_of(record, given) or 0.0 for record in records}
    if len(found) > 1:
        shown = listed(f"{value:g}" for value in sorted(found))
        raise InputError(
            f"T0 is {shown} degC in units of one stand; it is one: give reference_temperature=..."
        )
    return found.pop()


def _settled(stand: _Stand) -> tuple[Discovery, _State]:
    """Look at the mean and at each unit in turns, until no unit has anything new of its own."""
    question, head = stand.question, stand.head
    looker = Looker(question.effects, head or 0.0, question.seed)
    of_the_mean = question._replace(alpha=question.alpha / 2.0)
    state = _State(_units(stand, (), {}), (), {})
    for _ in range(len(stand.records) + 2):
        common = answered(mean_unit(state.units, state.shared, head), of_the_mean)
        shared = _shared(state.units, common, question.alpha)
        if any(item.effect.id == DEAD_ZONE for item in shared):
            state = state._replace(units=_units(stand, shared, state.own))
        own = _own(stand, looker, state, shared)
        before, state = state, _State(_units(stand, shared, own), shared, own)
        if state.ids == before.ids:
            break
    return common, state


def _units(stand: _Stand, shared: tuple[Instance, ...], own: dict[int, Own]) -> list[Unit]:
    """Units compared with the base model, what was found in them not taken for noise."""
    found = []
    for number, record in enumerate(stand.records):
        alone = own[number].instances if number in own else ()
        bare = record.with_apparatus(head_uncertainty=None)
        question = stand.question
        asked, known = (bare, question.reference, question.delta0), (*shared, *alone)
        zones = [item for item in known if item.effect.id == DEAD_ZONE]
        silent = silent_readings(*asked, zones[:1]) if zones else None
        found.append(Unit.of(compared(*asked, known, silent=silent), alone))
    return found


def _shared(units: Sequence[Unit], common: Discovery, alpha: float) -> tuple[Instance, ...]:
    """Effects of the mean that may be the stand's; it takes three units to know."""
    if len(units) < FEWEST:
        return ()
    found = instances_in(common)
    return tuple(item for item in found if one_value(units, item, found, alpha).verdict != "unit")


def _own(
    stand: _Stand, looker: Looker, state: _State, shared: tuple[Instance, ...]
) -> dict[int, Own]:
    """Effects of the units that had some already, and of the clearest one that is new."""
    level = stand.alpha_of_a_unit
    looks = [looker(state.units, number, shared) for number in range(len(state.units))]
    chance = [judge(look).p_value for look in looks]
    new = [n for n, p_value in enumerate(chance) if n not in state.own and p_value < level]
    new.sort(key=lambda n: (chance[n], -float(np.sum(looks[n].comparison.seen ** 2))))
    found = {}
    for number in [*state.own, *new[:1]]:
        explanations, complete = explained(looks[number], level, stand.question.most)
        if not explanations:
            found[number] = Own((), (), (), complete)
            continue
        best = explanations[0]
        others = tuple(in_place_of(explanations, best, item.effect.id) for item in best.instances)
        silence = tuple(said_of_silence(looks[number].comparison, best))
        found[number] = Own(best.instances, others, best.p_values, complete, silence)
    return found


def _told(stand: _Stand, common: Discovery, state: _State) -> StandDiscovery:
    units, alpha, head = state.units, stand.question.alpha, stand.head or 0.0
    names = _names(stand.records)
    level = without_head(units, state.shared, head)
    effects = (
        *common_effects(level, common, names, alpha),
        *own_effects(level, state.own, state.shared, names, alpha),
    )
    order = {"stand": 0, "undecided": 1, "unit": 2}
    hinging = _hinging_on_one_head(stand, state)
    of_stand = {item.id for item in effects if item.verdict == "stand"}
    shared = tuple(item for item in state.shared if item.effect.id in of_stand)
    gain = len(units) >= FEWEST and bool(shared or head)
    wide = {names[n] for n in _of_open_width(common, state)}
    told = coefficients(units, shared, head) if gain else ()
    return StandDiscovery(
        units=names,
        effects=tuple(
            _told_of(item, wide) for item in sorted(effects, key=lambda item: order[item.verdict])
        ),
        head=head_of(units, shared, head),
        coefficients={
            name: without_bound(changes, OPEN if name in wide else ())
            for name, changes in zip(names, told, strict=False)
        },
        common=common,
        notes=(*common.doubts, *_notes(state, names, hinging)),
        doubtful=(*common.doubtful, *_doubtful(state, hinging)),
        alpha=alpha,
    )


def _of_open_width(common: Discovery, state: _State) -> frozenset[int]:
    """Units in which a dead zone may be wider than it shows."""
    if set(OPEN) <= set(common.unbounded):
        return frozenset(range(len(state.units)))
    return frozenset(n for n, told in state.own.items() if any(ids for _, ids in told.silence))


def _told_of(effect: StandEffect, wide: Collection[str]) -> StandEffect:
    """Take the uncertainties from the widths of a dead zone in some units."""
    if effect.id != DEAD_ZONE:
        return effect
    sizes = {unit: unbounded(q) if unit in wide else q for unit, q in effect.sizes.items()}
    return replace(effect, sizes=sizes)


def _hinging_on_one_head(stand: _Stand, state: _State) -> tuple[int, ...]:
    """Units whose own effects a head of their own, as good as declared, could make as well."""
    if not stand.head or len(state.units) < FEWEST:
        return ()
    looker = Looker(stand.question.effects, stand.head, stand.question.seed, one_head=False)
    looks = {n: looker(state.units, n, state.shared) for n in sorted(state.own)}
    return tuple(n for n, look in looks.items() if judge(look).p_value >= stand.alpha_of_a_unit)


def _doubtful(state: _State, hinging: Sequence[int]) -> tuple[str, ...]:
    """Ids of effects that are not sure in all units that have them alone.

    They hinge on one head, do not explain all, or any dead zone could stand in their place.
    """
    sure, unsure = set[str](), set[str]()
    for number, told in state.own.items():
        ids = {item.effect.id for item in told.instances}
        silenced = {name for _, names in told.silence for name in names}
        doubted = ids if number in hinging or not told.complete else ids & silenced
        unsure |= doubted
        sure |= ids - doubted
    return tuple(sorted(unsure - sure))


def _names(records: Sequence[TumbleRecord]) -> tuple[str, ...]:
    """Serial numbers where they tell the units apart, else sources, else numbers."""
    for names in ([r.serial or "" for r in records], [r.source for r in records]):
        if all(names) and len(set(names)) == len(names):
            return tuple(names)
    return tuple(f"unit {number}" for number in range(1, len(records) + 1))


def _notes(state: _State, names: tuple[str, ...], hinging: Sequence[int]) -> Iterator[str]:
    if len(names) < FEWEST:
        yield "two units: what both have may be the stand's or the type's; measure a third"
    for number, told in state.own.items():
        if not told.complete:
            nearest = (
                "; those that are named come nearest and are not sure" if told.instances else ""
            )
            yield (
                f"{names[number]} disagrees with the others, and no known effect explains"
                f" how{nearest}"
            )
        yield from (f"{names[number]}: {said}" for said, _ in told.silence)
    if hinging:
        units = listed((names[n] for n in hinging), most=len(names))
        yield (
            f"what is found in {units} alone is not sure: errors of another head, or of the same"
            " one with the unit clamped at another angle, would look like it; it holds if one head,"
            " clamped alike, has measured all units"
        )
