"""Tests compared before anyone books the stand."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from itertools import product
from numbers import Real
from typing import Any

from accelcal.accelerometer import AL15, Accelerometer
from accelcal.arguments.kinds import expect, several
from accelcal.arguments.numbers import check_number, check_number_or_none
from accelcal.arguments.options import check_flag
from accelcal.arrays import Numbers
from accelcal.errors import InputError
from accelcal.model import SLOPES
from accelcal.planning.pace import Pace, hours_of, per_run, strokes_within
from accelcal.planning.prediction import forecasts, lost_coefficients, visibility
from accelcal.planning.targets import checked_targets, refuse_impossible
from accelcal.results.designs import BLIND, DesignComparison, TestDesign, Visibility, label
from accelcal.simulation import NoiseComponents, TumblePlan
from accelcal.units import HOUR
from accelcal.version import SOFTWARE

__all__ = ["PACE", "POSITIONS", "STAND", "STROKES", "TEMPERATURES"]
__all__ += ["blank_plan", "compared", "design", "design_of"]

POSITIONS = (4, 6, 8, 12, 16, 24, 36)
"""Positions in a turn that are compared."""

STROKES = (2, 6)
"""Strokes in a run that are compared: one cycle, and the three of the paper."""

TEMPERATURES = (-40.0, 20.0, 80.0)
STAND = NoiseComponents()
PACE = Pace()
_NO_SLOPES = (
    "the levels tell no slopes, so a fit of this test cannot state the error by temperature; it is"
    " foreseen here by the slopes of the nominal accelerometer"
)
_MOST = 500
_MOST_READINGS = 50_000


def design(
    *,
    positions: Sequence[int] = POSITIONS,
    angles: Numbers | Sequence[Numbers] = (),
    strokes: Sequence[int] = (),
    temperatures: Numbers | Sequence[Numbers] = (TEMPERATURES,),
    mountings: Sequence[Sequence[str]] = (("o+",),),
    noise: NoiseComponents = STAND,
    resolution: float = 0.0,
    pace: Pace = PACE,
    hours: float | None = None,
    targets: Mapping[str, float | str] | None = None,
    declare: bool = True,
    effects: bool = True,
    accelerometer: Accelerometer = AL15,
) -> DesignComparison:
    """Compare tests before anyone books the stand.

    Every choice of positions is combined with every number of strokes, every list of temperatures
    and every list of mountings.

    Parameters
    ----------
    positions : sequence of int
        Numbers of equally spaced positions in a turn.
    angles : sequence of float, or sequence of these
        Further choices: head angles of a forward stroke; a flat list is one choice [deg].
    strokes : sequence of int
        Strokes in a run. By default 2 and 6, or with `hours` as many whole cycles as fit.
    temperatures : sequence of float, or sequence of these
        Choices of levels; a flat list is the only choice [degC].
    mountings : sequence of sequence of str
        Choices of mountings; a flat list is the only choice.
    noise : NoiseComponents
        Standard uncertainties of readings and stand.
    resolution : float, default 0
        Step of the readings [g].
    pace : Pace
        Time that each action takes.
    hours : float, optional
        The most time [h]; longer tests are left out.
    targets : mapping of str to float or str, optional
        Standard uncertainties asked for, as ``{"K1": "5 ppm"}`` or ``{"K1": 5e-6}``, K1 relative;
        `accelcal.stand_budget` asks for expanded ones.
    declare : bool, default True
        Whether the errors of the stand will be declared to the fit, or estimated by it.
    effects : bool, default True
        Whether to tell which effects of the catalogue a test would show.
    accelerometer : Accelerometer, default `AL15`
        What is tested; its coefficients hardly matter.

    Returns
    -------
    DesignComparison
        The tests, in the order of the choices.

    Raises
    ------
    InputError
        If a choice breaks a rule, no test fits into the hours, or a target is below the floor of
        all tests.
    DesignError
        If a test does not determine the scale factor.

    Examples
    --------
    >>> import accelcal
    >>> found = accelcal.design(positions=[8], strokes=[6], effects=False)
    >>> round(found.designs[0].forecast("K2").standard_uncertainty * 1e6, 1)
    3.9
    """
    asked = checked_targets(targets)
    check_flag(declare=declare, effects=effects)
    expect(noise, NoiseComponents)
    check_number_or_none(hours=hours)
    blank = blank_plan(pace, resolution, accelerometer)
    stops: list[dict[str, Any]] = [{"positions": n} for n in several(positions)]
    stops += [{"angles": each} for each in _choices(angles)]
    choices = [
        replace(blank, temperatures=levels, mountings=sides, **where)
        for levels, sides, where in product(_choices(temperatures), _choices(mountings), stops)
    ]
    found = tuple(
        design_of(plan, noise, pace, accelerometer, declared=declare, effects=effects)
        for plan in _fitting(choices, several(strokes), pace, hours)
    )
    which = _choices_of_angles(choices)
    named = tuple(
        replace(each, choice=which.get(each.angles)) if each.positions is None else each
        for each in found
    )
    told = compared(named, noise, resolution, pace, asked, declared=declare)
    return replace(told, notes=_left_out(choices, which, several(strokes), pace, hours))


def compared(
    designs: tuple[TestDesign, ...],
    noise: NoiseComponents,
    resolution: float,
    pace: Pace,
    targets: Mapping[str, float],
    *,
    declared: bool,
) -> DesignComparison:
    """Put tests that were foreseen side by side, with what they have in common.

    The errors of the stand will be `declared` to the fit or not; the step of the readings is in g,
    targets are standard uncertainties.

    Raises
    ------
    InputError
        If a target is below the floor of all tests.
    """
    refuse_impossible(designs, targets)
    return DesignComparison(
        designs=designs,
        stand={**asdict(noise), "resolution": resolution},
        declared=declared,
        pace=asdict(pace),
        targets=targets,
        software=SOFTWARE,
    )


def _choices(given: Any) -> tuple[Any, ...]:
    """Choices of lists; a flat list is the only choice."""
    found = several(given)
    return (found,) if any(isinstance(each, str | Real) for each in found) else found


def _choices_of_angles(plans: Sequence[TumblePlan]) -> dict[tuple[float, ...], int]:
    """Number lists of angles, from 1, where several have as many."""
    lists: dict[int, list[tuple[float, ...]]] = {}
    for plan in plans:
        stops = tuple(plan.stops.tolist())
        alike = lists.setdefault(len(set(stops)), [])
        if plan.angles is not None and stops not in alike:
            alike.append(stops)
    several_alike = (alike for alike in lists.values() if len(alike) > 1)
    return {stops: n for alike in several_alike for n, stops in enumerate(alike, 1)}


def blank_plan(pace: Pace, resolution: float, accelerometer: Accelerometer) -> TumblePlan:
    """Make the plan of a test with its pace, and with a step of the readings [g]."""
    expect(pace, Pace)
    expect(accelerometer, Accelerometer)
    check_number(0.0, resolution=resolution)
    return TumblePlan(
        resolution=resolution * accelerometer.scale_factor.at_T0,
        seconds_per_reading=pace.reading + pace.turn,
        seconds_between_runs=HOUR * pace.soak,
        timed=True,
    )


def _fitting(
    choices: Sequence[TumblePlan], strokes: Sequence[int], pace: Pace, hours: float | None
) -> list[TumblePlan]:
    if not choices:
        raise InputError("no test to compare; give positions or angles, temperatures and mountings")
    found = []
    for choice in choices:
        for number in strokes or _usual_strokes(choice, pace, hours):
            plan = replace(choice, strokes=number)
            if hours is None or hours_of(plan, pace) <= hours * (1.0 + 1e-9):
                found.append(plan)
                _refuse_too_many(len(found), plan.readings)
    if not found:
        per_run(choices[0], pace, hours or 0.0)  # refuses it where the soaks alone take too long
        few = min(strokes or STROKES)
        quickest = min(hours_of(replace(choice, strokes=few), pace) for choice in choices)
        raise InputError(
            f"no test of these fits into {hours:g} h; allow {math.ceil(10.0 * quickest) / 10.0:g} h"
            " or more, or fewer positions, strokes, levels or mountings"
        )
    return found


def _left_out(
    choices: Sequence[TumblePlan],
    which: Mapping[tuple[float, ...], int],
    strokes: Sequence[int],
    pace: Pace,
    hours: float | None,
) -> tuple[str, ...]:
    """Say which choices are not compared, as the quickest test of them takes too many hours."""
    if hours is None:
        return ()
    number, long = min(strokes, default=min(STROKES)), []
    for choice in choices:
        plan = replace(choice, strokes=number)
        took = hours_of(plan, pace)
        if took > hours * (1.0 + 1e-9):
            where = plan.positions if plan.angles is None else None
            stops = tuple(plan.stops.tolist())
            long.append(f"{label(where, stops, number, which.get(stops))} ({took:.4g} h)")
    if not long:
        return ()
    return (f"left out, as it takes more than {hours:g} h: {', '.join(dict.fromkeys(long))}",)


def _usual_strokes(plan: TumblePlan, pace: Pace, hours: float | None) -> Sequence[int]:
    if hours is None:
        return STROKES
    most = strokes_within(plan, pace, hours)
    return (most,) if most else ()


def _refuse_too_many(tests: int, readings: int) -> None:
    if tests > _MOST:
        raise InputError(f"more than {_MOST} tests to compare; give fewer choices")
    if readings > _MOST_READINGS:
        raise InputError(
            f"a test of {readings} readings; at most {_MOST_READINGS} are foreseen, so give fewer"
            " strokes, positions or hours"
        )


def design_of(
    plan: TumblePlan,
    noise: NoiseComponents,
    pace: Pace,
    accelerometer: Accelerometer = AL15,
    *,
    declared: bool = True,
    effects: bool = False,
) -> TestDesign:
    """Foresee one test.

    Parameters
    ----------
    plan : TumblePlan
        The test.
    noise : NoiseComponents
        Standard uncertainties of readings and stand.
    pace : Pace
        Times.
    accelerometer : Accelerometer, default `AL15`
        What is tested.
    declared : bool, default True
        Whether the errors of the stand will be declared.
    effects : bool, default False
        Whether to tell which effects it would show.

    Returns
    -------
    TestDesign
        The test with its forecasts.

    Raises
    ------
    InputError
        If the readings have no noise.
    DesignError
        If the test does not determine the scale factor.
    """
    if noise.reading == 0.0:
        raise InputError(
            "noise of a reading is 0; readings are weighted by it, so give what they scatter by"
        )
    lost = lost_coefficients(plan)
    shown: tuple[Visibility, ...] = ()
    notes: tuple[str, ...] = ()
    if effects:
        try:
            shown = visibility(plan, noise, accelerometer, declared=declared)
        except InputError as error:
            notes = (f"{BLIND}: {error}",)
    told = forecasts(plan, noise, accelerometer, declared=declared)
    if noise.temperature > 0.0 and not any(f.name in SLOPES for f in told):
        notes = (*notes, _NO_SLOPES)
    return TestDesign(
        positions=plan.positions if plan.angles is None else None,
        angles=tuple(plan.stops.tolist()),
        strokes=plan.strokes,
        temperatures=tuple(plan.temperatures),
        mountings=tuple(plan.mountings),
        readings=plan.readings,
        hours=hours_of(plan, pace),
        forecasts=told,
        lost=lost,
        effects=shown,
        notes=notes,
    )
