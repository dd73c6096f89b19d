"""A look at a record: compared, searched, and beside what is no effect but could look like one."""

from __future__ import annotations

from collections.abc import Callable
from itertools import chain
from typing import NamedTuple

from accelcal.arrays import Mask
from accelcal.discovery.comparison import Comparison, compared
from accelcal.discovery.dead_zone import likeliest_silence, silence_beside
from accelcal.discovery.explanation import CONTRADICTION, Explanation
from accelcal.discovery.family import Family, family_of, with_rates
from accelcal.discovery.large_effects import DEAD_ZONE, silent_readings, straightened, zone_among
from accelcal.discovery.noise.of_readings import FEWEST_REPLICATES
from accelcal.discovery.search import Findings, in_the_main, search
from accelcal.discovery.solution import gap_of, solution
from accelcal.discovery.unnamed.mistaken import (
    Instead,
    far_better,
    oscillations_in_place,
    shifts_in_place,
)
from accelcal.discovery.unnamed.slow import LIKELY, Wandering, drift_anew, wandering
from accelcal.discovery.unwritten import going_on, shows_pauses
from accelcal.effects.effect import Effect
from accelcal.record import TumbleRecord
from accelcal.results.findings import Unexplained

_SAME_NOISE = 0.01

_WIDER = 1.05
"""Ratio of the gap with some effects to that without from which they are none."""

_EXACT = 3
"""Most searches by exact laws, each with the effects of the one before."""


class Question(NamedTuple):
    """What is asked of a record: T0 [degC], fixture angle [rad], how to search, what is silent.

    Runs may be apart, see `accelcal.discovery.base`. A family that it is like has its false-alarm
    rates.
    """

    reference: float
    delta0: float
    effects: tuple[Effect, ...]
    alpha: float
    most: int
    seed: int
    empirical: bool = False
    silent: Mask | None = None
    apart: bool = False
    like: Family | None = None


class Look(NamedTuple):
    """A record compared with the base model and searched, and what stands in place of the best.

    Walks and waves could, of which nobody knows why they wander and oscillate; a shift or silent
    readings do.
    """

    family: Family
    findings: Findings
    walks: tuple[Wandering, ...] = ()
    waves: tuple[Instead, ...] = ()
    shift: Unexplained | None = None
    silence: Unexplained | None = None

    @property
    def comparison(self) -> Comparison:
        """The comparison that was searched."""
        return self.family.comparison

    def beside(self, best: Explanation) -> Look:
        """The same with what wanders and oscillates in place of some effects."""
        walks = tuple(wandering(self.comparison, best.instances))
        return self._replace(walks=walks, waves=tuple(oscillations_in_place(self.comparison, best)))

    def sorted(self, key: Callable[[Explanation], bool]) -> Look:
        """The same with other explanations first, which stay in their order besides."""
        before = self.findings.explanations
        found = tuple(sorted(before, key=key))
        look = self._replace(findings=self.findings._replace(explanations=found))
        return look.beside(found[0]) if found and found[0] is not before[0] else look


def look_through(record: TumbleRecord, question: Question) -> Look:
    """Search a record whose faults are mended for effects, and for what could look like them.

    Where nothing explains all, a dead zone is looked for that silences readings.
    """
    first = _judged(record, question)
    if (freed := _with_runs_apart(first, question)) is not None:
        first, question = freed, question._replace(apart=True)
    if (beside := _beside_silence(first, question)) is not None:
        return beside
    look = _by_exact_laws(first, question)
    if look.findings.explanations or look.findings.chance_without_name >= question.alpha:
        return look
    return _of_any_width(look, question)


def _with_runs_apart(look: Look, question: Question) -> Look | None:
    """Search with runs apart, where pauses nobody knows part them.

    Something slow goes on in a pause that no times tell. It is told so where it takes fewer effects
    to explain all than without pauses. What begins anew in each run does not move the runs, and
    comes behind.
    """
    findings = look.findings
    if findings.before.p_value >= question.alpha or not shows_pauses(look.comparison):
        return None
    most = min((len(one.ids) for one in findings.explanations), default=question.most + 1)
    if most < 2 or drift_anew(look.family, question.alpha):
        return None
    apart = _judged(look.comparison.record, question._replace(apart=True))
    comparison, found = apart.comparison, apart.findings.explanations

    def moves_runs(one: Explanation) -> bool:
        return bool(going_on(comparison.model.conditions, one.instances))

    if not any(len(one.ids) < most and moves_runs(one) for one in found):
        return None
    return apart.sorted(lambda one: not moves_runs(one))


def _by_exact_laws(first: Look, question: Question) -> Look:
    """Search once more where the exact laws of large effects are not those of small ones.

    The readings of the look are without the difference. What comes nearest may explain all by it.
    """
    look = first
    for _ in range(_EXACT):
        known = next(iter(look.findings.named), look.findings.nearest)
        if known is None:
            return look
        straight = straightened(first.comparison, known.instances)
        if straight is None:
            return look
        asked = question._replace(like=look.family)
        again = _judged(straight, asked)
        if not again.findings.named or not known.ids & again.findings.named[0].ids:
            return look
        look = again
        if look.findings.named[0].ids == known.ids:
            break
    return look


def _beside_silence(look: Look, question: Question) -> Look | None:
    """Search with the readings silent that a dead zone would silence, if it is found so."""
    zone = zone_among(question.effects)
    findings, comparison = look.findings, look.comparison
    named = next(iter(findings.explanations), None)
    if zone is None or findings.before.p_value >= question.alpha:
        return None
    if named is not None and DEAD_ZONE not in named.ids:
        return None
    record = comparison.record
    silent = silent_readings(
        record, question.reference, question.delta0, [zone], noise=comparison.noise
    )
    if silent is None:
        return None
    again = _in_silence(record, question, silent)
    return again if _is_sure_of_zone(again, question.alpha) else None


def _in_silence(record: TumbleRecord, question: Question, silent: Mask) -> Look:
    """Search with readings silent, for which a dead zone is likelier than what looks like it."""
    inside = question._replace(silent=silent)
    return _judged(record, inside).sorted(lambda one: DEAD_ZONE not in one.ids)


def _is_sure_of_zone(look: Look, alpha: float) -> bool:
    best = next(iter(look.findings.explanations), None)
    return best is not None and DEAD_ZONE in best.ids and max(best.p_values) < alpha


def _of_any_width(look: Look, question: Question) -> Look:
    """Find what explains all beside a dead zone as wide as the misalignment, at some levels or all.

    Where K1 and K3 take up its width, it is told as silence; else it has its name.
    """
    comparison = look.comparison
    zone = zone_among(question.effects)
    silent = None if zone is None else likeliest_silence(comparison, zone)
    if silent is None:
        return look
    again = _in_silence(comparison.record, question, silent)
    if _is_sure_of_zone(again, question.alpha):
        return again
    found, p_value = again.findings.explanations, again.findings.before.p_value
    if not found and p_value < CONTRADICTION * question.alpha:
        return look
    main = found[0].seen_in(comparison) if found else None
    instances = main.instances if main else ()
    return look._replace(
        findings=look.findings._replace(main=main),
        walks=again.walks,
        waves=tuple(oscillations_in_place(comparison, main)) if main else (),
        silence=silence_beside(comparison, instances, look.findings.chance_without_name),
    )


def _searched(record: TumbleRecord, question: Question) -> Look:
    """Search, and once more with the noise judged beside what was found."""
    comparison = compared(
        record,
        question.reference,
        question.delta0,
        silent=question.silent,
        apart=question.apart,
    )
    look = _look(comparison, question)
    if not look.findings.explanations and look.comparison.noise.rho > 0.0:
        look = _without_memory(look, question) or look
    found = look.findings.best
    if found is None or not _leaves_noise(look, found):
        return look
    known = look.comparison.judged_beside(found.instances)
    one, other = look.comparison.noise, known.noise
    same_size = abs(one.sigma / other.sigma - 1.0) < _SAME_NOISE
    return look if same_size and one.rho == other.rho else _look(known, question)


def _without_memory(first: Look, question: Question) -> Look | None:
    """Search for effects that alone make the noise look as if it had a memory.

    A slow effect within a cycle correlates neighbours. It is found as if they were independent, and
    holds if they are so beside it, and if it is sure at the square of the false-alarm rate: noise
    with a memory has made two tries of it by then.
    """
    look = _look(first.comparison.judged_beside((), memory=False), question)
    found = look.findings.best
    if found is None or not _leaves_noise(look, found):
        return None
    beside = look.comparison.judged_beside(found.instances)
    if beside.noise.rho:
        return None
    known = _look(beside, question)
    sure = known.findings.explanations and known.findings.before.p_value < question.alpha**2
    return known if sure else None


def _judged(record: TumbleRecord, question: Question) -> Look:
    """Search, and give no name where what wanders is as likely, or a shift for a time likelier.

    Effects that explain nearly all beside a shift, or beside what nothing explains, keep theirs.
    """
    look = _searched(record, question)
    findings, best = look.findings, look.findings.best
    if best is None:
        return look
    look = look.beside(best)
    asked = question.alpha, findings.before.p_value
    waves = [own for own in look.waves if own.of_the_angle >= 0.0]
    instead = chain(shifts_in_place(look.comparison, best), waves)
    shift = far_better(look.family, best, instead, *asked)
    if shift or _widens_the_gap(look.comparison, best) or _wanders(look):
        findings = findings._replace(explanations=(), nearest=best)
    look = look._replace(findings=findings, shift=shift)
    return look if findings.explanations or _wanders(look) else _with_main(look, question)


def _with_main(look: Look, question: Question) -> Look:
    """Give effects that explain nearly all their names, unless what wanders is as likely."""
    main = in_the_main(look.comparison, look.findings.levels, question.alpha)
    if main is None:
        return look
    beside = look.beside(main)
    if _wanders(beside) or _widens_the_gap(look.comparison, main):
        return look
    return beside._replace(findings=look.findings._replace(main=main))


def _wanders(look: Look) -> bool:
    return all(walk.is_as_likely(LIKELY) for walk in look.walks)


def _widens_the_gap(comparison: Comparison, found: Explanation) -> bool:
    """Whether readings are farther from the model with some effects than without.

    Noise with a memory leaves much room for that, and what shows in it is no such effect. Launches
    do so too, and are free to.
    """
    if comparison.noise.rho <= 0.0:
        return False
    without, within = (solution(comparison, effects) for effects in ((), found.instances))
    rms = [gap_of(fit, None).rms for fit in (without, within)]
    return rms[1] > _WIDER * rms[0]


def _look(comparison: Comparison, question: Question) -> Look:
    family, like = family_of(comparison, question.effects), question.like
    if like is not None and family.null == like.null:
        family = family.with_rates_of(like)
    else:
        family = with_rates(family, question.seed)
    found = search(family, alpha=question.alpha, most=question.most)
    return Look(family, found)


def _leaves_noise(look: Look, found: Explanation) -> bool:
    """Whether enough replicates tell of the noise beside some effects, whatever these take up."""
    taken = sum(len(item.amplitudes) for item in found.instances)
    return look.comparison.noise.dof - taken >= FEWEST_REPLICATES
