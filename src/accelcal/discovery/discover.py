"""From a record to a discovery: the rooms of this package, wired together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from accelcal.arguments.kinds import expect
from accelcal.arguments.numbers import check_number, check_whole
from accelcal.arguments.options import check_flag
from accelcal.discovery.comparison import Comparison, compared
from accelcal.discovery.dead_zone import (
    OPEN,
    SILENCED,
    in_fit,
    in_place_of,
    left_undecided,
    may_be_wider,
    of_open_width,
    without_bound,
)
from accelcal.discovery.doubts.caveats import Caveat, caveats, not_sure
from accelcal.discovery.doubts.otherwise import (
    Alternative,
    alternatives,
    otherwise,
    rivals_of,
    with_others_counted,
)
from accelcal.discovery.explanation import Explanation
from accelcal.discovery.factors import by_factor, shares
from accelcal.discovery.faults.finder import faults
from accelcal.discovery.instance import Instance, searched_among
from accelcal.discovery.large_effects import silent_in
from accelcal.discovery.look import Look, Question, look_through
from accelcal.discovery.noise.of_readings import ReadingNoise, refuse_too_many, sources
from accelcal.discovery.noise.pure_error import LoudRun
from accelcal.discovery.parameters import parameters_of
from accelcal.discovery.prospects.audit import smallest_detectable, undetectable
from accelcal.discovery.prospects.next_measurement import outlooks, proposals
from accelcal.discovery.solution import changes, gap_of, gaps_along, solution
from accelcal.discovery.unexplained import (
    empirical_explanation,
    loudest,
    noise_caveats,
    what_is_left,
)
from accelcal.discovery.unwritten import as_searched
from accelcal.effects.effect import Effect
from accelcal.errors import InputError
from accelcal.estimate.same_head import HEAD, STAND, name_in
from accelcal.logs import tell
from accelcal.numerics.one_thread import in_one_thread
from accelcal.record import TumbleRecord, naming
from accelcal.reference import fixture_angle, reference_temperature_of
from accelcal.results.discovery import Discovery
from accelcal.results.findings import Fault, FoundEffect, Gap, Unexplained
from accelcal.version import SOFTWARE

__all__ = ["discover"]

_REMOUNTED, _TILT = "mounted anew", "foundation-tilt"


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
        If an argument is out of its range, or the record has too few replicates, or too many
        readings, positions and cycles.

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
    record = as_searched(record, delta0)
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
    return answered(record, question)


def answered(record: TumbleRecord, question: Question) -> Discovery:
    """Search a record in one clamping, as `discover` does."""
    tell("searching %r among %d effects", record.source, len(question.effects))
    with naming(record), in_one_thread():
        refuse_too_many(record)
        found, mended = faults(record, question.reference, question.delta0, question.alpha)
        look = look_through(mended, question)
        if found and all(fault.name == _REMOUNTED for fault in found):
            tilted = _of_a_tilt(look, record, question)
            look, found = (look, found) if tilted is None else (tilted, ())
        told = _discovery(look, record, found, question)
        # of readings that may be at fault, or could not be judged, and are kept
        known = {*record.notes, *(fault.finding for fault in found)}
        kept = [note for note in mended.notes if note not in known]
        return replace(told, notes=(*kept, *told.notes))


def _of_a_tilt(turned: Look, record: TumbleRecord, question: Question) -> Look | None:
    """Search without turning runs back, where nothing explains what this leaves, or runs are apart.

    A foundation that tilts slowly turns later runs as a mounting does, and turning them back leaves
    a tilt that no entry describes. It is one if it explains the readings as they are.
    """
    findings, apart = turned.findings, turned.comparison.model.apart
    if findings.before.p_value >= question.alpha or (findings.explanations and not apart):
        return None
    look = look_through(record, question)
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


def _discovery(
    look: Look, record: TumbleRecord, found: Sequence[Fault], question: Question
) -> Discovery:
    comparison, family, findings = look.comparison, look.family, look.findings
    named, unexplained, loud = _named_and_left(look, question)
    instances, p_values = (named.instances, named.p_values) if named else ((), ())
    within = solution(comparison, instances)
    strongest = sorted(zip(instances, p_values, strict=True), key=lambda item: item[1])
    steps = gaps_along(comparison, [item for item, _ in strongest], question.seed)
    also = alternatives(comparison, findings.instances)
    others = list(otherwise(comparison, findings.instances, also, rivals_of(findings.named)))
    said = [*caveats(look, unexplained, also, others), *noise_caveats(comparison, instances, loud)]
    said += _of_mountings(found, named)
    told = Discovery(
        noise=sources(comparison.noise, comparison.counted, record, free=True),
        before=_as_given(comparison, record, found, question) or steps[0],
        after=gap_of(within, steps[-1].heldout_rms),
        where=by_factor(shares(comparison.seen, family.blocks, findings.before.blocks.tolist())),
        effects=tuple(_effects(look, named, strongest, steps, also.places)) if named else (),
        unexplained=unexplained,
        undetectable=undetectable(comparison, family.candidates),
        smallest_detectable=smallest_detectable(family, question.alpha),
        faults=tuple(found),
        coefficients=changes(comparison, solution(comparison), within),
        scale_factor=comparison.model.nominal,
        output_unit=record.unit,
        next_measurement=_next_measurement(look, named, question) if named else "",
        notes=tuple(caveat.text for caveat in said),
        doubtful=tuple(dict.fromkeys(name for caveat in said for name in caveat.doubted)),
        reservations=tuple(caveat.reservation for caveat in said if caveat.reservation),
        p_value=_p_value(look, unexplained),
        alpha=question.alpha,
        serial=record.serial,
        T0_degC=question.reference,
        delta0_rad=question.delta0,
        readings=len(record),
        source=record.source,
        software=SOFTWARE,
        sha256=record.sha256,
        head_name=name_in(record.metadata, HEAD),
        stand_name=name_in(record.metadata, STAND),
    )
    return _without_bounds(with_others_counted(told, others), look)


def _without_bounds(told: Discovery, look: Look) -> Discovery:
    """Take the uncertainties from what hangs on a dead zone of which nothing tells how wide."""
    instances, effects = look.findings.instances, told.effects
    names = [change.coefficient for change in told.coefficients]
    open_ones = [name for name in names if look.silence and in_fit(name) in SILENCED]
    if may_be_wider(look.comparison, instances):
        open_ones += OPEN
        effects = tuple(map(of_open_width, effects))
    else:
        open_ones += left_undecided(look.comparison, instances, effects)
    coefficients = without_bound(told.coefficients, open_ones)
    return replace(told, coefficients=coefficients, effects=effects)


def _named_and_left(
    look: Look, question: Question
) -> tuple[Explanation | None, Unexplained | None, LoudRun | None]:
    """What is named, what is left beside it, and the run that scatters most beside the others."""
    family, findings = look.family, look.findings
    named = next(iter(findings.named), None)
    loud = loudest(look.comparison, named.instances if named else ())
    instead = look.silence or look.shift
    left = what_is_left(family, findings, instead, loud, question.alpha, question.seed)
    if named is None and left is not None and question.empirical:
        named = empirical_explanation(family)
        loud = loudest(look.comparison, named.instances if named else ())
    return named, left, loud


def _p_value(look: Look, unexplained: Unexplained | None) -> float:
    own = look.findings.before.p_value if look.findings.named else look.findings.chance_without_name
    return min(own, unexplained.p_value if unexplained else 1.0)


def _of_mountings(found: Sequence[Fault], named: Explanation | None) -> Iterator[Caveat]:
    """A tilt beside runs that are taken as turned back, which may all be one slip."""
    turned = any(fault.name == _REMOUNTED for fault in found)
    if turned and named is not None and _TILT in named.ids:
        yield not_sure(
            [_TILT],
            "runs are taken as turned back, as of a unit that was mounted anew, and a head that"
            " slips within a run looks like both; repeat the test without touching the clamp",
        )


def _next_measurement(look: Look, named: Explanation, question: Question) -> str:
    """What would tell the best explanation from the others; empty where there are none."""
    rivals = [other.instances for other in look.findings.explanations[1:]]
    if not rivals:
        return ""
    record, noise = look.comparison.record, look.comparison.noise
    foreseen = outlooks(record, noise, question.reference, question.delta0)
    found = proposals(look.comparison, foreseen, named.instances, rivals)
    none = "none of the further readings that were tried tells them apart"
    return found[0].text if found else none


def _as_given(
    comparison: Comparison, record: TumbleRecord, found: Sequence[Fault], question: Question
) -> Gap | None:
    """Gap of the record as it is, where the search was in another one or in another model.

    It is in the measure of the noise without the faults.
    """
    silent, apart = silent_in(comparison.model.conditions).any(), comparison.model.apart
    if not (found or silent or apart or comparison.record is not record):
        return None
    noise = noise_of_all(comparison.noise, found)
    given = compared(record, question.reference, question.delta0, noise=noise)
    return gaps_along(given, (), question.seed)[0]


def noise_of_all(noise: ReadingNoise, found: Sequence[Fault]) -> ReadingNoise:
    """Noise of readings and of the outliers that were set aside, which are as noisy as most."""
    if noise.relative is None:
        return noise
    outliers = np.sort([fault.readings[0] for fault in found if fault.id == "outlier"])
    places = outliers.astype(np.intp) - np.arange(outliers.size)  # among those that are kept
    return noise._replace(relative=np.insert(noise.relative, places, 1.0))


def _effects(
    look: Look,
    named: Explanation,
    strongest: Sequence[tuple[Instance, float]],
    steps: Sequence[Gap],
    places: Sequence[Alternative],
) -> Iterator[FoundEffect]:
    """Effects of the best explanation, each on top of those before it."""
    told = parameters_of(look.comparison, [item for item, _ in strongest])
    for (item, p_value), parameters, before, after in zip(
        strongest, told, steps, steps[1:], strict=False
    ):
        others = in_place_of(look.findings.explanations, named, item.effect.id)
        yield FoundEffect(
            id=item.effect.id,
            name=item.effect.name,
            parameters=parameters,
            p_value=p_value,
            **before.until(after),
            indistinguishable=others,
            to_tell_apart=item.effect.to_tell_apart if others else "",
            elsewhere=tuple(other.place for other in places if other.effect is item.effect),
        )
