"""What a reader must know before using the numbers of a fit: each condition with its sentence."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from accelcal.arrays import Mask
from accelcal.calibrate.known_effects import said_of_effects
from accelcal.calibrate.table_weaknesses import of_large_turn, of_table
from accelcal.estimate.at_positions import said_of_positions
from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.reversal import clamping_of
from accelcal.estimate.tables import PreparedTable, linear_estimator
from accelcal.model import ERROR_TERMS
from accelcal.plural import degrees_of_freedom, listed
from accelcal.results.beyond_uncertainty import (
    FEWER,
    LEFT_OUT,
    NO_HEAT,
    NO_SHIFT,
    NOT_COUNTED,
    NOT_IN_U,
)
from accelcal.results.table import mountings_of_laws
from accelcal.sentences import Sentence, Told, first_of, of_each
from accelcal.temperature.laws import Slopes
from accelcal.temperature.one_meaning import said_of_meanings, telling_laws

if TYPE_CHECKING:
    from accelcal.calibrate.stack import CalibrationStack
    from accelcal.discovery.in_use.correction import Correction
    from accelcal.results.discovery import Discovery
    from accelcal.results.head_calibration import HeadCalibration

_FEW_REPEATS = 5
"""Degrees of freedom of a variance below which a report says that it is hardly known."""

# A head error that is estimated with few degrees of freedom, and that is no more than so many times
# the noise in the contrast which shows it best, cannot be told from the noise. With two degrees of
# freedom the 95 % intervals then held the truth in 93.9 to 99.0 %, with 1, 2 and 6 strokes on 8
# positions and a head error of 0 or 5e-6 (benchmarks/coverage.py).
_AS_LARGE_AS_NOISE = 4.0

# With one degree of freedom the estimate of the head is often near zero by chance: the 95 %
# intervals then held the truth in 92 to 100 % (benchmarks/coverage.py, 7 positions).
_FEW_HEAD_DOF = 2

# One stroke without the return to the first position needs this many residuals. With fewer, its
# 95 % intervals held the truth in 92 to 97 %, and in 91 to 98 % on 7 positions with the return
# (benchmarks/coverage.py).
_FEW_RESIDUALS = 15

_FEW_DOF = 3
"""Residual degrees of freedom that one stroke needs even with the return."""

_USUAL_ERROR = 0.1
"""Error of the temperature in a good chamber [degC]."""

_OF_METHOD = {
    "printed": (
        "NOT A CALIBRATION: the printed equations (6) are misprinted, and the symbols tell what"
        " they return instead; use least-squares or closed-form"
    ),
    "sign-corrected": "sign-corrected (6) does not estimate K3; K1 stands for K1 + 0.75 K3",
}


class Warned(NamedTuple):
    """Sentences about R records and about their tables, without a full stop."""

    of_record: Told  # those about each record
    of_tables: Sequence[Told]  # for each table, those of each record


def warnings_of(stack: CalibrationStack) -> Warned:
    """Say what a reader must know."""
    estimate, tables, records = stack.estimate, stack.tables, len(stack)
    slopes = stack.laws.slopes(records)
    said = (
        *_of_method(stack.options.method),
        *_of_misalignment(tables, estimate, stack.delta0),
        *_of_noise_and_head(estimate),
        *_of_correlation(estimate),
        *_of_launch(estimate, slopes.has_laws),
        *_of_laws(stack, slopes),
        *_of_temperature(tables, slopes),
        *_of_readings(_said_of_readings(stack)),
        *_of_effects(stack.options.model, stack.known),
        *_of_unbounded(stack.unbounded),
        *_of_calibrated_head(stack.options.head),
        Sentence(
            stack.options.left_out(stack.plan.records),
            "the head was calibrated from this table too: what this table told is left out here;"
            " the coefficients fitted jointly with the head are those of accelcal head",
        ),
    )
    uneven = [noise.clearly for noise in estimate.uneven]
    of_tables = map(of_table, tables, estimate.noises, uneven)
    return Warned(of_each(said, records), [of_each(own, records) for own in of_tables])


def _said_of_readings(stack: CalibrationStack) -> list[tuple[str, ...]]:
    """What was done with the readings of each record before they were fitted."""
    options, each = stack.options, zip(stack.plan.records, stack.at_rest.said, strict=True)
    said = [(*said_of_positions(record), *own) for record, own in each]
    if options.model is None:
        return said
    made = partial(linear_estimator, method=options.method, delta0=stack.delta0)
    estimators = list(map(made, stack.tables))
    told = said_of_effects(stack.given, stack.known, options.model, estimators)
    return [(*of_effects, *own) for of_effects, own in zip(told, said, strict=True)]


def _of_readings(said: Sequence[tuple[str, ...]]) -> Iterator[Sentence]:
    record, count = np.arange(len(said)), np.array(list(map(len, said)))
    for place in range(int(count.max())):
        yield Sentence(count > place, lambda i, place=place: said[i][place], [record])


def _of_effects(model: Discovery | None, known: Sequence[Correction]) -> Iterator[Sentence]:
    if model is None:
        return
    taken_out = [{effect.id for effect in item.effects} for item in known]
    doubts = [tuple(name for name in model.doubtful if name in own) for own in taken_out]
    for names in sorted(set(doubts) - {()}):
        own = np.array([names == each for each in doubts])
        yield Sentence(own, f"{listed(names)}: not sure, as the notes of the discovery say")
    if model.has_more or (model.unexplained and not model.effects):
        yield Sentence(True, f"{NOT_COUNTED} what the discovery found and no known effect explains")


def _of_calibrated_head(head: HeadCalibration | None) -> Iterator[Sentence]:
    if head is not None and head.is_disturbed:
        yield Sentence(
            True,
            f"{NOT_COUNTED} what disturbed the calibration of the head, whose residuals are too"
            " large; calibrate it again without the readings that accelcal head names",
        )


def _of_unbounded(unbounded: Sequence[tuple[str, ...]]) -> Iterator[Sentence]:
    for names in sorted(set(unbounded) - {()}):
        have = "have" if len(names) > 1 else "has"
        own = [ERROR_TERMS.get(name, name) for name in names]
        told = f"nothing bounds the error of {listed(own)}, which {have} no U;"
        there = np.array([names == each for each in unbounded])
        yield Sentence(there, f"{told} {NOT_COUNTED} it in the others")


# -- what is estimated -----------------------------------------------------------------------------


def _of_method(method: str) -> Iterator[Sentence]:
    if method in _OF_METHOD:
        yield Sentence(True, _OF_METHOD[method])


def _of_misalignment(
    tables: Sequence[PreparedTable], estimate: JointEstimate, delta0: float
) -> Iterator[Sentence]:
    if not any("M" in table.estimability.kept for table in tables):
        return
    mountings = _mountings(tables)
    given = "taken as 0" if delta0 == 0.0 else f"taken as {delta0:g} rad"
    effective = f"is the effective misalignment: it contains the fixture angle delta0, {given};"
    if len({mounting[0] for mounting in mountings}) < len(mountings):
        yield Sentence(
            True,
            f"delta of a table {effective} where both sides met a level, the two are told apart,"
            " and the laws are free of delta0",
        )
    else:
        yield Sentence(True, f"delta {effective} the reversed mounting would separate them")
    yield of_large_turn(tables, estimate, delta0)
    yield Sentence(
        True,
        "if the positions of all strokes were counted in the wrong direction, no residual shows it;"
        " only the signs of delta and delta_ip change",
    )


def _mountings(tables: Sequence[PreparedTable]) -> set[str]:
    return {table.mounting for table in tables}


def _of_noise_and_head(estimate: JointEstimate) -> Iterator[Sentence]:
    """At most one sentence a record: the first that holds says enough."""
    if estimate.head.source != "declared":
        yield from first_of((*_of_estimated_head(estimate), *_of_unknown_head(estimate)))


def _of_estimated_head(estimate: JointEstimate) -> Iterator[Sentence]:
    head = estimate.head
    # one source stands for the whole stack; a record that shows nothing of its head has dof 0
    estimated = (head.source == "estimated") & (head.dof > 0.0)
    yield Sentence(
        estimated & _rests_on_few_residuals(estimate),
        "noise and head error come from the same few residuals: no honest interval can be had, and"
        f" those given {FEWER} (91 to 98 in simulations);"
        " measure two strokes or declare head_uncertainty",
    )
    yield Sentence(
        estimated & (head.dof < _FEW_HEAD_DOF),
        "head error estimated from the lack of fit with 1 degree of freedom: no honest interval can"
        f" be had, and those given {FEWER} (92 to 100 in"
        " simulations); declare head_uncertainty or measure more positions",
    )
    told = head.uncertainty > 0.0, head.dof
    yield Sentence(estimated & _is_lost_in_noise(estimate), _lost_in_noise, told)
    yield Sentence(estimated, _head_of_few_dof, [head.dof])


def _of_unknown_head(estimate: JointEstimate) -> Iterator[Sentence]:
    unrepeated = np.any([noise.source == "residuals" for noise in estimate.noises], axis=0)
    yield Sentence(
        unrepeated & (estimate.lack_of_fit.number > 0),
        "head error not declared: the intervals hold it as far as the residuals show it; declare"
        " head_uncertainty",
    )
    yield Sentence(
        True,
        f"head error neither declared nor visible at these angles: {LEFT_OUT};"
        " declare head_uncertainty",
    )


def _rests_on_few_residuals(estimate: JointEstimate) -> Mask:
    """Whether noise and head error were told apart without a residual that is free of the head."""
    dof = estimate.noises[0].dof
    unrepeated = np.all([noise.source == "residuals" for noise in estimate.noises], axis=0)
    none_is_free = dof - estimate.lack_of_fit.number < 1.0
    return np.asarray(unrepeated & ((none_is_free & (dof < _FEW_RESIDUALS)) | (dof < _FEW_DOF)))


def _is_lost_in_noise(estimate: JointEstimate) -> Mask:
    """Whether an estimated head error is of the size of what the noise makes of it."""
    head = estimate.head
    shown = head.uncertainty * estimate.lack_of_fit.strongest
    return np.asarray((head.dof < _FEW_REPEATS) & (shown < _AS_LARGE_AS_NOISE))


def _lost_in_noise(shows: bool, dof: float) -> str:
    size = "head error as large as the noise" if shows else "no head error shows above the noise"
    left = (
        "the intervals of one test may be too wide or too narrow (in simulations of many such"
        " tests, 93 to 99 of 100 held the truth)"
        if shows
        else "U may lack one as large as the noise"
    )
    return (
        f"{size}, and {degrees_of_freedom(dof)} cannot tell the two apart: {left}; declare"
        " head_uncertainty or measure more positions"
    )


def _head_of_few_dof(dof: float) -> str:
    return (
        f"head error estimated from the lack of fit with {degrees_of_freedom(dof)}, as if the model"
        " lacked no effect, which accelcal discover looks for; declare head_uncertainty or measure"
        " more positions for narrower intervals"
    )


def _of_correlation(estimate: JointEstimate) -> Iterator[Sentence]:
    found = estimate.correlation
    yield Sentence(
        found.counts,
        lambda rho, as_one: (
            f"each reading is correlated with the next by {rho:.2f}, so that in a mean"
            f" {as_one:.2g} count as one: U counts that; wait longer between readings, or find what"
            " wanders, such as a filter, the temperature or the foundation"
        ),
        [found.rho, found.readings_as_one],
    )


def _of_launch(estimate: JointEstimate, has_laws: Mask) -> Iterator[Sentence]:
    if (shift := estimate.bias_shift).source == "estimated" and shift.dof < _FEW_REPEATS:
        yield Sentence(
            True,
            f"shift from launch to launch estimated with {degrees_of_freedom(shift.dof)}: no"
            f" honest interval can be had from so few repeats, and those given {FEWER}; declare"
            " launch_uncertainty or repeat a temperature more often",
        )
    if unknown := _unknown_shifts(estimate):
        own, declared = (listed(names) for names in (unknown.values(), unknown))
        slopes = f" and of {'their' if len(unknown) > 1 else 'its'} slopes"
        for there, also in ((has_laws, slopes), (~has_laws, "")):
            yield Sentence(
                there,
                f"U of {own}{also} {NO_SHIFT}, which is neither declared nor"
                f" measured; declare {declared}, or repeat a temperature",
            )


# -- temperature -----------------------------------------------------------------------------------


def _of_laws(stack: CalibrationStack, slopes: Slopes) -> Iterator[Sentence]:
    """Say what the temperature laws rest on, or why there are none."""
    has_laws, tables, records = slopes.has_laws, stack.tables, stack.plan.records
    given = stack.options.reference_temperature is not None
    yield Sentence(
        ~has_laws,
        "no temperature laws: they need the temperature of each run, and k0, K1 and delta at two"
        " temperatures more than 5 degC apart, one of them more than 5 degC from T0",
    )
    yield Sentence(
        has_laws & [not given and record.reference_temperature is None for record in records],
        "T0 was not given: it is the level nearest to 20 degC",
    )
    for said in said_of_meanings(tables, stack.estimate):
        yield Sentence(has_laws, said)
    main, second = mountings_of_laws(
        [table.mounting for table in tables], telling_laws(stack.estimate)
    )
    if len(_mountings(tables)) > 1:
        apart = f"; those of {second}, the other axis, stand apart" if second else ""
        yield Sentence(has_laws, f"the temperature laws are those of mounting {main}{apart}")
    if len({(t.mounting, clamping_of(t)) for t in tables}) > len(_mountings(tables)):
        at = listed(f"{clamping:g}" for clamping in sorted(set(map(clamping_of, tables))))
        yield Sentence(
            ~has_laws,
            f"the unit was clamped at {at} deg on the head, whose errors average over clampings: a"
            " mean of runs counts them as common, and its U is too wide; accelcal head tells them",
        )


def _unknown_shifts(estimate: JointEstimate) -> dict[str, str]:
    """What declares the shifts from run to run that nothing tells -> what they move."""
    shifts = (
        ("launch_uncertainty", "k0", estimate.bias_shift),
        ("launch_sf_uncertainty", "K1", estimate.scale_factor_shift),
    )
    return {name: moved for name, moved, shift in shifts if shift.source == "none"}


def _of_temperature(tables: Sequence[PreparedTable], slopes: Slopes) -> Iterator[Sentence]:
    """Say which error of the temperatures is in no interval, where it would matter."""
    declared = tables[0].record.apparatus.temperature_uncertainty
    if declared is None:
        by_heat = _USUAL_ERROR * slopes.steepest_of_scale_factor()
        yield Sentence(
            by_heat * np.abs(slopes.K1) > slopes.K1_uncertainty,
            lambda ppm: (
                f"temperature_uncertainty not declared: {NO_HEAT}"
                f" but its scatter within the runs; {_USUAL_ERROR:g} degC would"
                f" change K1 by {ppm:.0f} ppm"
            ),
            [np.rint(1e6 * by_heat)],
        )
    elif declared > 0.0:
        yield Sentence(
            np.isnan(slopes.K1),
            f"temperature_uncertainty of {declared:g} degC {NOT_IN_U}, as"
            " their slopes are unknown; they hold at the temperature that the run really had",
        )
