"""From a record to a discovery: the rooms of this package, wired together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from accelcal.arguments.kinds import expect
from accelcal.arguments.numbers import check_number, check_whole
from accelcal.arguments.options import check_flag
from accelcal.discovery.candidates import searched_among
from accelcal.discovery.caveats import Caveat, caveats, of_partners
from accelcal.discovery.comparison import Comparison, compared
from accelcal.discovery.empirical_terms import empirical_explanation
from accelcal.discovery.explanation import Explanation
from accelcal.discovery.family import Family, family_of, with_rates
from accelcal.discovery.faults.finder import faults
from accelcal.discovery.gap_as_given import gap_as_given, of_all_readings
from accelcal.discovery.gaps import gap_of, gaps_with
from accelcal.discovery.instance import Instance
from accelcal.discovery.noise import (
    FEWEST_REPLICATES,
    refuse_too_many,
    sources,
)
from accelcal.discovery.noise_caveats import noise_caveats
from accelcal.discovery.one_clamping import refuse_several_clampings
from accelcal.discovery.passing import shift_in_place_of_one
from accelcal.discovery.prospects.audit import smallest_detectable, undetectable
from accelcal.discovery.prospects.next_measurement import proposals
from accelcal.discovery.prospects.outlook import outlooks
from accelcal.discovery.search import Findings, in_the_main, search
from accelcal.discovery.solution import changes, parameters_of, solution
from accelcal.discovery.unexplained import what_is_left
from accelcal.discovery.wandering import LIKELY, Wandering, wandering
from accelcal.discovery.where import shares
from accelcal.effects.effect import Effect
from accelcal.errors import InputError
from accelcal.estimate.at_positions import at_positions
from accelcal.logs import tell
from accelcal.numerics.one_thread import in_one_thread
from accelcal.record import TumbleRecord, naming
from accelcal.reference import fixture_angle, reference_temperature_of
from accelcal.results.discovery import Discovery
from accelcal.results.findings import Fault, FoundEffect, Gap, Unexplained
from accelcal.version import SOFTWARE

__all__ = ["discover"]

_SAME_NOISE = 0.01
_REMOUNTED, _TILT = "mounted anew", "foundation-tilt"

_WIDER = 1.05
"""Ratio of the gap with some effects to that without from which they are none."""


class Question(NamedTuple):
    """What is asked of a record: T0 [degC], fixture angle [rad], and how to search."""

    reference: float
    delta0: float
    effects: tuple[Effect, ...]
    alpha: float
    most: int
    seed: int
    empirical: bool = False


class _Look(NamedTuple):
    """A record compared with the base model and searched, and what stands in place of the best."""

    family: Family
    findings: Findings
    walks: tuple[Wandering, ...] = ()
    shift: Unexplained | None = None

    @property
    def comparison(self) -> Comparison:
        return self.family.comparison


def discover(
    record: TumbleRecord,
    *,
    alpha: float = 0.01,
    max_effects: int = 3,
    reference_temperature: float | None = None,
    delta0: float | None = None,
    effects: Sequence[Effect] | None = None,
    empirical: bool = False,
    seed: int = 0,
) -> Discovery:
    """Find where the model and the readings of a record disagree, and name the missing effect.

    Parameters
    ----------
    record : TumbleRecord
        Readings of one accelerometer, each position in at least two cycles of a run.
    alpha : float, default 0.01
        An effect is named if noise makes anything of all that is searched look like it with a
        chance below this.
    max_effects : int, default 3
        Effects at once.
    reference_temperature : float, optional
        T0; by default that of the record, else the level nearest to 20 degC [degC].
    delta0 : float, optional
        Fixture angle; by default that of the record, else 0 [rad].
    effects : sequence of Effect, optional
        Effects to look for, one or more; by default those of the catalogue. What uses the result
        looks them up there: `accelcal.register` those of your own.
    empirical : bool, default False
        Add a term for the pattern of a disagreement that no effect explains, where it depends on
        the head position.
    seed : int, default 0
        Of the noise that is simulated to find the false-alarm rate.

    Returns
    -------
    Discovery
        Where they disagree, the effects, what they change, and what this test cannot show.

    Raises
    ------
    InputError
        If an argument is out of its range, or the record has too few replicates, or more than 8000
        readings.

    Notes
    -----
    What passes for noise is the pure error of replicates; head, launch and temperature errors are
    taken as declared. A launch shift that is not declared is free in each run, a head error that
    is not declared is taken as zero, which the notes say.

    Examples
    --------
    >>> import accelcal
    >>> record = accelcal.simulate(effects=[accelcal.effect("backlash").of(2e-5)], seed=1)
    >>> accelcal.discover(record)
    <Discovery serial AL-15: backlash>
    """
    expect(record, TumbleRecord)
    check_search(alpha, max_effects, seed)
    check_flag(empirical=empirical)
    refuse_several_clampings(record)
    t0 = reference_temperature_of(record, reference_temperature)
    question = Question(
        reference=0.0 if t0 is None else t0,
        delta0=fixture_angle(record, delta0),
        effects=searched_among(effects),
        alpha=alpha,
        most=int(max_effects),
        seed=int(seed),
        empirical=empirical,
    )
    return answered(at_positions(record, delta0), question)


def answered(record: TumbleRecord, question: Question) -> Discovery:
    """Search a record in one clamping, as `discover` does."""
    tell("searching %r among %d effects", record.source, len(question.effects))
    with naming(record), in_one_thread():
        refuse_too_many(record)
        found, mended = faults(record, question.reference, question.delta0, question.alpha)
        look = _beyond_disturbances(_searched(mended, question), question)
        if found and all(fault.name == _REMOUNTED for fault in found):
            tilted = _of_a_tilt(look, record, question)
            look, found = (look, found) if tilted is None else (tilted, ())
        return _discovery(look, record, found, question)


def _of_a_tilt(turned: _Look, record: TumbleRecord, question: Question) -> _Look | None:
    """Search without turning runs back, where nothing explains what this leaves.

    A foundation that tilts slowly turns later runs as a mounting does, and turning them back leaves
    a tilt that no entry describes. It is one if it explains the readings as they are.
    """
    if turned.findings.explanations or turned.findings.before.p_value >= question.alpha:
        return None
    look = _beyond_disturbances(_searched(record, question), question)
    named = look.findings.explanations
    return look if named and _TILT in named[0].ids else None


def check_search(alpha: float, max_effects: int, seed: int) -> None:
    """Refuse a false-alarm rate, a number of effects and a seed that no search has."""
    check_number(alpha=alpha)
    check_whole(0, seed=seed)
    check_whole(1, max_effects=max_effects)
    if not 1e-6 <= alpha <= 0.5:
        raise InputError(f"alpha is {alpha:g}; it is a false-alarm rate from 1e-6 to 0.5")
    if max_effects > 5:
        raise InputError(f"max_effects is {max_effects}; it is a whole number from 1 to 5")


def _searched(record: TumbleRecord, question: Question) -> _Look:
    """Search, and once more with the noise judged beside what was found."""
    look = _look(record, question, ())
    if not look.findings.explanations and look.comparison.noise.rho > 0.0:
        look = _without_memory(record, question) or look
    found = _best(look.findings)
    if found is None or not _leaves_noise(look, found):
        return look
    known = _look(record, question, found.instances)
    return look if _same_noise(look.comparison, known.comparison) else known


def _without_memory(record: TumbleRecord, question: Question) -> _Look | None:
    """Search for effects that alone make the noise look as if it had a memory.

    A slow effect within a cycle correlates neighbours. It is found as if they were independent, and
    holds if they are so beside it, and if it is sure at the square of the false-alarm rate: noise
    with a memory has made two tries of it by then.
    """
    look = _look(record, question, (), memory=False)
    found = _best(look.findings)
    if found is None or not _leaves_noise(look, found):
        return None
    known = _look(record, question, found.instances)
    sure = known.findings.explanations and known.findings.before.p_value < question.alpha**2
    return known if sure and not known.comparison.noise.rho else None


def _beyond_disturbances(look: _Look, question: Question) -> _Look:
    """Give no name where what wanders is as likely, or a shift for a time likelier.

    Effects that explain nearly all beside a shift, or beside what nothing explains, keep theirs.
    """
    findings, best = look.findings, _best(look.findings)
    if best is None:
        return look
    walks = tuple(wandering(look.comparison, best.instances))
    shift = shift_in_place_of_one(look.comparison, best.instances, findings.before.p_value)
    if shift or _widens_the_gap(look.comparison, best) or _wanders(walks):
        findings = findings._replace(explanations=(), nearest=best)
    look = look._replace(findings=findings, walks=walks, shift=shift)
    return look if findings.explanations or _wanders(walks) else _with_main(look, question)


def _with_main(look: _Look, question: Question) -> _Look:
    """Give effects that explain nearly all their names, unless what wanders is as likely."""
    main = in_the_main(look.family, alpha=question.alpha, most=question.most)
    if main is None:
        return look
    walks = tuple(wandering(look.comparison, main.instances))
    if _wanders(walks) or _widens_the_gap(look.comparison, main):
        return look
    return look._replace(findings=look.findings._replace(main=main), walks=walks)


def _wanders(walks: Sequence[Wandering]) -> bool:
    return all(walk.is_as_likely(LIKELY) for walk in walks)


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


def _look(
    record: TumbleRecord, question: Question, known: tuple[Instance, ...], *, memory: bool = True
) -> _Look:
    comparison = compared(record, question.reference, question.delta0, known, memory=memory)
    family = with_rates(family_of(comparison, question.effects), question.seed)
    return _Look(family, search(family, alpha=question.alpha, most=question.most))


def _leaves_noise(look: _Look, found: Explanation) -> bool:
    """Whether enough replicates tell of the noise beside some effects, whatever these take up."""
    taken = sum(len(item.amplitudes) for item in found.instances)
    return look.comparison.noise.dof - taken >= FEWEST_REPLICATES


def _best(findings: Findings) -> Explanation | None:
    return findings.explanations[0] if findings.explanations else findings.nearest


def _same_noise(one: Comparison, other: Comparison) -> bool:
    same_size = abs(one.noise.sigma / other.noise.sigma - 1.0) < _SAME_NOISE
    return same_size and one.noise.rho == other.noise.rho


def _discovery(
    look: _Look, record: TumbleRecord, found: Sequence[Fault], question: Question
) -> Discovery:
    comparison, family, findings = look.comparison, look.family, look.findings
    named = next(iter(findings.named), None)
    unexplained = what_is_left(family, findings, look.shift, question.alpha, question.seed)
    if named is None and unexplained is not None and question.empirical:
        named = empirical_explanation(family)
    bare = solution(comparison)
    within = solution(comparison, named.instances) if named else bare
    strongest = _strongest_first(named) if named else ()
    sets = [[item for item, _ in strongest[:k]] for k in range(len(strongest) + 1)]
    steps = gaps_with(comparison, sets, question.seed)
    said = list(_caveats(look, named, unexplained))
    as_given = _as_given(comparison, record, found, question) if found else None
    return Discovery(
        noise=sources(comparison.noise, record.apparatus, record, free=("launch", "launch_sf")),
        before=as_given or steps[0],
        after=gap_of(within, steps[-1].heldout_rms),
        where=shares(comparison.seen, family.blocks, findings.before.blocks.tolist()),
        effects=tuple(_effects(look, named, strongest, steps)) if named else (),
        unexplained=unexplained,
        undetectable=undetectable(comparison, family.candidates),
        smallest_detectable=smallest_detectable(family, question.alpha),
        faults=tuple(found),
        coefficients=changes(comparison, bare, within),
        scale_factor=comparison.model.nominal,
        output_unit=record.unit,
        next_measurement=_next_measurement(look, named, question) if named else "",
        notes=tuple(caveat.text for caveat in said),
        doubtful=tuple(dict.fromkeys(name for caveat in said for name in caveat.doubted)),
        reservations=tuple(caveat.reservation for caveat in said if caveat.reservation),
        p_value=min(findings.before.p_value, unexplained.p_value if unexplained else 1.0),
        alpha=question.alpha,
        serial=record.serial,
        T0_degC=question.reference,
        delta0_rad=question.delta0,
        readings=len(record),
        source=record.source,
        software=SOFTWARE,
        sha256=record.sha256,
    )


def _caveats(look: _Look, named: Explanation | None, left: Unexplained | None) -> Iterator[Caveat]:
    said = [*_in_the_main(look), *caveats(look.family, look.findings.named, look.walks, left)]
    instances = named.instances if named else ()
    said += noise_caveats(look.comparison, instances)
    yield from said
    if instances:
        doubted = {name for caveat in said for name in caveat.doubted}
        yield from of_partners(look.comparison, instances, doubted)


def _in_the_main(look: _Look) -> Iterator[Caveat]:
    """Say how much effects explain that do not explain all."""
    main, seen = look.findings.main, look.comparison.seen
    if main is not None:
        names, share = sorted(main.ids), 100.0 * main.squares / float(seen @ seen)
        yield Caveat(
            f"of the disagreement {min(share, 99.9):.1f} % is that of {' and '.join(names)}; the"
            " rest is more than noise, and nothing explains it",
            names,
        )


def _next_measurement(look: _Look, named: Explanation, question: Question) -> str:
    """What would tell the best explanation from the others; empty where there are none."""
    rivals = [other.instances for other in look.findings.explanations[1:]]
    if not rivals:
        return ""
    record, noise = look.comparison.record, look.comparison.noise
    foreseen = outlooks(record, noise, question.reference, question.delta0)
    found = proposals(look.comparison, foreseen, named.instances, rivals)
    good = [item for item in found if item.blocks is not None]
    in_one_clamping = [item for item in good if not item.block.clocking]
    best = next(iter(in_one_clamping or good), None)
    return best.text if best else "nothing on the menu of further readings tells them apart"


def _as_given(
    comparison: Comparison, record: TumbleRecord, found: Sequence[Fault], question: Question
) -> Gap:
    noise = of_all_readings(comparison.noise, found)
    return gap_as_given(record, question.reference, question.delta0, question.seed, noise)


def _strongest_first(named: Explanation) -> tuple[tuple[Instance, float], ...]:
    """Effects of an explanation with their p-values."""
    both = zip(named.instances, named.p_values, strict=True)
    return tuple(sorted(both, key=lambda item: item[1]))


def _effects(
    look: _Look,
    named: Explanation,
    strongest: Sequence[tuple[Instance, float]],
    steps: Sequence[Gap],
) -> Iterator[FoundEffect]:
    """Effects of the best explanation, each on top of those before it."""
    told = parameters_of(look.comparison, [item for item, _ in strongest])
    for (item, p_value), parameters, before, after in zip(
        strongest, told, steps, steps[1:], strict=False
    ):
        others = _indistinguishable(look.findings, named, item.effect)
        yield FoundEffect(
            id=item.effect.id,
            name=item.effect.name,
            parameters=parameters,
            p_value=p_value,
            **before.until(after),
            indistinguishable=others,
            to_tell_apart=item.effect.to_tell_apart if others else "",
        )


def _indistinguishable(findings: Findings, named: Explanation, effect: Effect) -> tuple[str, ...]:
    """Ids that explain the readings too in place of one effect, the others being the same."""
    rest = named.ids - {effect.id}
    found = [other.ids - rest for other in findings.explanations if rest <= other.ids]
    return tuple(next(iter(ids)) for ids in found if len(ids) == 1 and effect.id not in ids)
