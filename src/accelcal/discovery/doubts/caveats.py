"""What a reader of a discovery must know: what was not declared, what it would be otherwise."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from accelcal.discovery.columns import head_columns
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.dead_zone import said_of_rivals, said_of_silence
from accelcal.discovery.doubts.as_well import not_listed, said_of_ends
from accelcal.discovery.doubts.otherwise import Alternatives, Otherwise
from accelcal.discovery.explanation import Explanation
from accelcal.discovery.family import Family
from accelcal.discovery.instance import Instance, column_of
from accelcal.discovery.look import Look
from accelcal.discovery.parameters import parameters_of, said_of_not_shown
from accelcal.discovery.search import cancels
from accelcal.discovery.unnamed.mistaken import Instead, any_patterns
from accelcal.discovery.unnamed.slow import (
    LIKELY,
    POSSIBLE,
    Wandering,
    size_in_a_run,
    wandering_in_its_run,
)
from accelcal.discovery.unwritten import going_on, said_of_temperatures
from accelcal.effects.time import APPROACH, USUAL
from accelcal.estimate.at_positions import said_of_positions
from accelcal.plural import are, counted, listed
from accelcal.results.findings import Unexplained
from accelcal.results.quantity import Quantity
from accelcal.units import MICRO

_LIKE_THE_HEAD = 0.9
"""Part of an effect's squares that errors of the head positions must be able to take up."""

_LIKE_ANY = ": errors of the head look like effects of the position alone"

_OFTEN = 0.05
"""Share of patterns outside the catalogue that would get such names, from which on it is told."""

_OUTLIERS = 4
"""Readings on either side of a step in its run, fewer of which could as well be outliers."""

_CORRELATED = 0.3
"""Correlation of neighbours from which noise with a memory makes steps."""

_VAGUE = 1.0 / 3.0
"""Expanded uncertainty of a step over its size from which it could be no step."""

_MOVED = {"launch_uncertainty": "the bias", "launch_sf_uncertainty": "the scale factor"}
"""What of the launches may be declared, and what these move."""

_QUICK = 2.0
"""Intervals between readings within which a settling is that of the first reading alone."""


class Caveat(NamedTuple):
    """What a reader must know."""

    text: str  # a sentence
    doubted: Sequence[str] = ()
    """Ids of the named effects of which something outside the catalogue could be the cause."""
    reservation: str = ""
    """What the verdict must add where it says that nothing is missing; mostly empty."""


def not_sure(ids: Sequence[str], why: str) -> Caveat:
    """Tell why something outside the catalogue could be the cause of some effects."""
    return Caveat(f"{listed(ids)} {are(ids)} not sure: {why}", ids)


def caveats(
    look: Look,
    left: Unexplained | None,
    alternatives: Alternatives,
    others: Sequence[Otherwise],
) -> Iterator[Caveat]:
    """Tell what a reader must know of what a look named, or of what comes nearest.

    Something may be left beside it. Alternatives explain the readings as well; with others the
    coefficients are others too.
    """
    comparison, family, found = look.comparison, look.family, look.findings.named
    yield from _in_the_main(look)
    yield from map(Caveat, said_of_positions(comparison.record))
    yield from map(Caveat, said_of_temperatures(comparison.record))
    best = found[0].instances if found else ()
    if found:
        yield from map(Caveat, said_of_not_shown(comparison, best))
        yield from map(Caveat, said_of_ends(comparison, best, family.candidates.effects))
        for law in alternatives.laws:  # other places stand beside the own one
            to_tell = law.effect.to_tell_apart
            yield Caveat(f"{law.name} explains these readings as well; to tell: {to_tell}")
        yield from (Caveat(other.said) for other in others)
        of_any = list(_of_any_pattern(family, found[0]))
        yield from of_any
        if cancels(comparison, found[0]):
            yield not_sure(
                sorted(found[0].ids),
                "they mostly take back each other, and these readings show no more than what is"
                " left of them, which something outside the catalogue could as well be",
            )
        silence = list(said_of_silence(comparison, found[0]))
        yield from (Caveat(*said) for said in silence or said_of_rivals(comparison, found))
        yield from _of_the_first_readings(comparison, best)
        yield from map(Caveat, _of_the_start(best))
        yield from _of_steps(comparison, best, left)
        yield from _of_not_listed(comparison, best, {i for one in of_any for i in one.doubted})
        yield from _of_oscillations(look.waves)
        yield from _of_the_wrong_sense(comparison, best)
        yield from _of_the_chamber(comparison, best)
    if found or left:
        yield from _wandering(look.walks, named=bool(found))
    yield from _undeclared(comparison, best)
    yield from _untimed(comparison, best, left)


def _in_the_main(look: Look) -> Iterator[Caveat]:
    """Say how much effects explain that do not explain all."""
    main, seen = look.findings.main, look.comparison.seen
    if main is not None:
        names, share = sorted(main.ids), 100.0 * main.squares / float(seen @ seen)
        yield Caveat(
            f"of the disagreement {min(share, 99.9):.1f} % is that of {listed(names)}; the"
            " rest is more than noise, of something else or of these beyond their laws for small"
            " sizes, and U does not count it",
            names,
        )


def _of_any_pattern(family: Family, best: Explanation) -> Iterator[Caveat]:
    """Effects of the position alone, where patterns that nobody listed would look like them."""
    told = (each for each in any_patterns(family, best) if each.chance > _OFTEN)
    often = sorted(told, key=lambda each: -each.chance)
    doubted: set[str] = set()
    for each in often:
        if set(each.ids) <= doubted:
            continue
        doubted |= set(each.ids)
        kind, them = ("its", "it") if len(each.ids) == 1 else ("their", "them")
        yield not_sure(
            each.ids,
            f"these positions show {counted(each.patterns, 'pattern')} of {kind} kind, and what no"
            f" catalogue has, as a voltmeter of two ranges or a worn head, would look as much like"
            f" {them} in up to {100.0 * each.chance:.0f} % of cases; measure at positions between"
            " these",
        )


def _of_the_first_readings(
    comparison: Comparison, instances: Sequence[Instance]
) -> Iterator[Caveat]:
    """Settling that is over after a reading or two, as a first reading reached otherwise makes."""
    c = comparison.model.conditions
    steps = np.diff(c.time[c.order])[np.diff(c.run[c.order]) == 0]
    for item in instances:
        tau = item.shape.get("tau", np.inf)
        if steps.size and tau < _QUICK * float(np.median(steps)):
            yield not_sure(
                [item.effect.id],
                f"with tau = {tau:.2g} s it rests on the first reading of each run; where that is"
                " not reached by a forward turn, hysteresis and backlash make such a difference:"
                " turn the head there once before the first reading",
            )


def _of_the_start(instances: Sequence[Instance]) -> Iterator[str]:
    """How runs begin, which their first readings alone tell."""
    for item in instances:
        if item.shape.get(APPROACH, USUAL) != USUAL:
            yield (
                f"{item.effect.id}: how the runs begin (approach = {item.shape[APPROACH]:g}) rests"
                " on their first readings; if the head was turned to the first position in the"
                " sense of the stroke, a warm-up that is over after a reading or two is there"
            )


def _of_steps(
    comparison: Comparison, instances: Sequence[Instance], left: Unexplained | None
) -> Iterator[Caveat]:
    """Steps that outliers or something slower could as well be."""
    walks = {
        walk.instead_of.shape["reading"]: walk
        for walk in wandering_in_its_run(comparison, instances)
        if walk.is_as_likely(POSSIBLE)
    }
    for place, item in enumerate(instances):
        if item.effect.id == "bias-step":
            step, first = parameters_of(comparison, instances)[place]["step"], item.shape["reading"]
            reasons = list(_reasons(comparison, first, step, left))
            if walk := walks.get(first):
                reasons.append(f"a {walk.what} that wanders in its run alone is as likely")
            if reasons:
                yield not_sure([item.effect.id], f"{listed(reasons)}; repeat the run")


def _reasons(
    comparison: Comparison, first: float, step: Quantity, left: Unexplained | None
) -> Iterator[str]:
    """Reasons to take a step for outliers, or for something slower."""
    c = comparison.model.conditions
    own = c.number[c.run == c.run[c.order[int(first) - 1]]]
    fewest = min(np.count_nonzero(own < first), np.count_nonzero(own >= first))
    if 0 < fewest < _OUTLIERS:
        yield f"{fewest} readings alone, which may be outliers, lie on one side of it in its run"
    if left is not None:
        yield "something shows beside it that no effect explains"
    if (rho := comparison.noise.rho) > _CORRELATED:
        yield f"neighbouring readings are correlated ({rho:+.2f})"
    if (step.expanded_uncertainty or 0.0) > _VAGUE * abs(step.value or 0.0):
        yield "its uncertainty is more than a third of it"


def _of_the_wrong_sense(comparison: Comparison, instances: Sequence[Instance]) -> Iterator[Caveat]:
    """A head that runs ahead of its scale, which no backlash does."""
    for place, item in enumerate(instances):
        if item.effect.id != "backlash":
            continue
        lag = parameters_of(comparison, instances)[place]["lag"].value
        if lag is not None and lag < 0.0:
            yield not_sure(
                [item.effect.id],
                "its lag is below zero, and no gear runs ahead; are forward and back strokes taken"
                " for each other?",
            )


def _of_not_listed(
    comparison: Comparison, instances: Sequence[Instance], doubted: Collection[str]
) -> Iterator[Caveat]:
    """Effects in place of which something explains as much that no catalogue lists.

    Of those that any pattern would look like, which are in doubt, it says no more.
    """
    found = [each for each in not_listed(comparison, instances) if each[0] not in doubted]
    for what, remedy in dict.fromkeys((other.what, other.remedy) for _, other in found):
        ids = [name for name, other in found if other.what == what]
        yield not_sure(ids, f"{what} explains these readings as well; {remedy}")


def _of_oscillations(waves: Sequence[Instead]) -> Iterator[Caveat]:
    """Effects in step with an oscillation, as a backlash with one of the period of a stroke."""
    for wave in waves:
        if wave.gain > np.log(POSSIBLE):
            said = f"it could as well be that {wave.told}; repeat the test at another pace"
            yield not_sure(wave.ids, said)


def _of_the_chamber(comparison: Comparison, instances: Sequence[Instance]) -> Iterator[Caveat]:
    """Slow effects that a drift of the chamber would look like, where no slopes are known."""
    slow = [item.effect.id for item in instances if item.effect.bend]
    model = comparison.model
    if slow and not model.moving.any() and not model.conditions.per_degree.any():
        yield Caveat(
            "one level tells no slopes with the temperature: a drift of the chamber could as well"
            f" be the cause of {listed(slow)}; log the temperature of each reading",
            slow,
        )


def _wandering(walks: Sequence[Wandering], *, named: bool) -> Iterator[Caveat]:
    """Effects that a bias, or another coefficient, without any law would look like."""
    verdict, bound = ("not sure", POSSIBLE) if named else ("not named", LIKELY)
    likely = [walk for walk in walks if walk.is_as_likely(bound)]
    for what in dict.fromkeys(walk.what for walk in likely):
        own = [walk for walk in likely if walk.what == what]
        names = [walk.instead_of.effect.id for walk in own]
        size = size_in_a_run(what, max(walk.rms for walk in own))
        yield Caveat(
            f"{listed(names)} {are(names)} {verdict}: a {what} that wanders, as a random walk,"
            f" flicker noise or noise with a memory, of {size}, could as well be what these"
            " readings show; repeat the test: what comes back the same is no noise",
            names if named else [],
        )


def _undeclared(comparison: Comparison, instances: Sequence[Instance]) -> Iterator[Caveat]:
    declared = comparison.record.apparatus
    if declared.head_uncertainty is None:
        like = list(_like_the_head(comparison, instances))
        told = "".join(text for _, text in like) or _LIKE_ANY
        names = [name for name, _ in like]
        yield Caveat(f"head_uncertainty is not declared and taken as zero{told}", names)
    free = [name for name in _MOVED if getattr(declared, name) is None]
    if free and len(comparison.record.run_labels) > 1:
        moved = listed(_MOVED[name] for name in free)
        yield Caveat(
            f"{listed(free)} {are(free)} not declared: {moved} {are(free)} free in each run, and"
            " effects on what is free are not seen from run to run"
        )


def _untimed(
    comparison: Comparison, instances: Sequence[Instance], left: Unexplained | None
) -> Iterator[Caveat]:
    if comparison.record.time is not None:
        return
    slow = going_on(comparison.model.conditions, instances)
    anew = not slow and (left is not None or any(item.effect.bend for item in instances))
    several = len(comparison.record.run_labels) > 1
    pauses = ", and no pause between runs" if several and not anew else ""
    if comparison.model.apart:
        pauses = (
            f", and pauses of any length between runs, in which {listed(slow)} may go on: bias,"
            " scale factor and misalignment are free in each run, and effects on them from run to"
            " run cannot be seen"
        )
    yield Caveat(f"no times: one reading a minute is assumed, in the order of the strokes{pauses}")


def _like_the_head(
    comparison: Comparison, instances: Sequence[Instance]
) -> Iterator[tuple[str, str]]:
    """Effects that errors of the head positions would look like, and how large they would be."""
    c, space = comparison.model.conditions, comparison.space
    acting = head_columns(c)
    head = space.see(acting[:, np.abs(acting).max(axis=0) > _LIKE_THE_HEAD / 10.0])
    for item in instances:
        effect = space.see(column_of(item, c))
        size = float(effect @ comparison.seen) / float(effect @ effect)
        errors = np.linalg.lstsq(head, size * effect, rcond=1e-6)[0]
        missed = size * effect - head @ errors
        if missed @ missed < (1.0 - _LIKE_THE_HEAD) * size**2 * float(effect @ effect):
            rms = float(np.sqrt(np.mean(errors**2))) * MICRO
            name = item.effect.id
            yield name, f"; head errors of {rms:.2g} urad rms would look like {name}"
