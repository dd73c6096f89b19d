"""Faults of the readings, found and named before physics is.

Outliers, exchanged readings, strokes in a wrong order, a visible step of the voltmeter, and noise
that grows with the lever of the angle. All but the order is judged by replicates, never by the
residuals of a model, which may lack an effect.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.discovery.faults.all_readings import (
    VisibleStep,
    chance_of_vibration,
    vibration,
    vibration_over_noise,
    visible_step,
)
from accelcal.discovery.faults.suspects import Suspect, Views, suspects, views_of
from accelcal.discovery.faults.wrong_tables import (
    SMALLEST,
    mounted_anew,
    of_run,
    run_of_another_size,
    told_fault,
    turned_tables,
    wrong_orders,
)
from accelcal.discovery.noise.of_readings import FEWEST_REPLICATES, in_units_of, relative_noise
from accelcal.discovery.noise.pure_error import PureError, moving, pure_error, tilting
from accelcal.effects.conditions import LEVEL_CHANGE, Conditions, conditions_of
from accelcal.gates.verdict import acceleration, reading_name
from accelcal.numerics.decimal_steps import decimal_step
from accelcal.numerics.grouping import median
from accelcal.numerics.probability import written_p_value
from accelcal.plural import degrees_of_freedom
from accelcal.record import TumbleRecord
from accelcal.results.findings import Fault
from accelcal.results.quantity import Quantity

_OF_NORMAL = 1.4826  # standard deviation over the median size of a normal deviation

_NOT_JUDGED = (
    "outliers, exchanged readings and vibration were not looked for: the readings leave {freedom}"
    f" of pure error, it takes {FEWEST_REPLICATES}; measure two or more cycles"
    " of a forward and a back stroke in each run"
)


class _Scene(NamedTuple):
    """A record with the strokes in order, as the search sees it."""

    record: TumbleRecord
    c: Conditions
    nominal: float  # scale factor [output unit / g]
    readings: Array  # [g]
    relative: Array | None  # noise of each, as declared
    view: PureError  # within runs, in units of that


def _beside(columns: Array, readings: Array, relative: Array | None) -> PureError:
    """What columns leave of the readings, in units of their noise as declared."""
    return pure_error(in_units_of(relative, readings), in_units_of(relative, columns))


def faults(
    record: TumbleRecord,
    reference_temperature: float,
    delta0: float = 0.0,
    alpha: float = 0.01,
) -> tuple[tuple[Fault, ...], TumbleRecord]:
    """Find the faults of the readings, each kind at a false-alarm rate, and mend the record.

    T0 is in degC, the fixture angle in rad. Faults are wrong orders of strokes and tables, units
    mounted anew between runs, a run in another unit, exchanged readings, outliers, the step of the
    readings, and vibration, which is not looked for beside a visible step. In the record strokes
    are put in order, runs of one size and turned back, exchanged readings exchanged back, outliers
    set aside, and a step that was found is declared. Its notes say so, and what could not be judged
    for want of replicates.

    Raises
    ------
    InputError
        If a table is none of a tumble test, see `accelcal.estimate.tables.prepare`.

    Examples
    --------
    >>> import accelcal
    >>> wrong = accelcal.effect("outlier").of(1e-3, reading=17)
    >>> record = accelcal.simulate(effects=[wrong], seed=1)
    >>> found, mended = faults(record, 20.0)
    >>> [fault.id for fault in found], len(record) - len(mended)
    (['outlier'], 1)
    """
    orders, ordered = wrong_orders(record, delta0)
    sizes, ordered = run_of_another_size(ordered, delta0)
    turns, ordered = mounted_anew(ordered, delta0)
    scene = _scene(ordered, reference_temperature, delta0)
    step = visible_step(ordered.output, _scatter(scene))
    single, mended = _of_single_readings(scene, step, 0.0, alpha)
    rest = _scene(mended, reference_temperature, delta0) if single else scene
    step = step or visible_step(ordered.output, _scatter(rest))
    # Where readings are rounded to a visible step, the scatter of a cell depends on where in a step
    # its mean lies. That would pass for vibration, so it is not looked for.
    view = _beside(tilting(rest.c, mended.mounting), rest.readings, rest.relative)
    chance = 1.0 if step else chance_of_vibration(view, rest.c, mended.mounting)
    shaken: tuple[Fault, ...] = ()
    if chance < alpha:
        ratio = vibration_over_noise(view, rest.c, mended.mounting)
        single, mended = _of_single_readings(scene, step, ratio, alpha)
        shaken = (_of_vibration(_scene(mended, reference_temperature, delta0), chance),)
    stepped = () if step is None else (_of_step(step, rest),)
    outliers = [fault.readings[0] for fault in single if len(fault.readings) == 1]
    turned = turned_tables(mended, delta0, np.delete(np.arange(len(record)), outliers))
    notes = [fault.finding for fault in (*orders, *sizes, *turns, *single)]
    if scene.view.dof < FEWEST_REPLICATES:
        notes.append(_NOT_JUDGED.format(freedom=degrees_of_freedom(max(int(scene.view.dof), 0))))
    mended = replace(mended, notes=(*mended.notes, *notes))
    if step is not None:
        mended = mended.with_apparatus(resolution=step.step)
    return (*orders, *sizes, *turns, *turned, *single, *stepped, *shaken), mended


def _of_single_readings(
    scene: _Scene, step: VisibleStep | None, ratio: float, alpha: float
) -> tuple[tuple[Fault, ...], TumbleRecord]:
    """Outliers and exchanges, where the variance of the noise is 1 + `ratio` a_p^2.

    It is no smaller than the digits of the readings allow.
    """
    if scene.view.dof < FEWEST_REPLICATES:
        return (), scene.record
    weight = in_units_of(scene.relative, 1.0 / np.sqrt(1.0 + ratio * scene.c.cross**2))
    digit = decimal_step(scene.record.output) if step is None else step.step
    rounding = 4.0 * float(np.finfo(float).eps) * float(np.abs(scene.readings).max())
    least = max(0.5 * digit / abs(scene.nominal), rounding)
    return single_readings(scene.record, scene.c, scene.nominal, weight, least, alpha)


def _scene(record: TumbleRecord, reference_temperature: float, delta0: float) -> _Scene:
    c = conditions_of(record, reference_temperature, delta0)
    nominal = nominal_scale(record, c)
    readings = record.output / nominal
    relative = relative_noise(record)
    view = _beside(moving(c, record.mounting), readings, relative)
    return _Scene(record, c, nominal, readings, relative, view)


def _scatter(scene: _Scene) -> float:
    """Standard deviation of a reading, whatever the outliers [output unit]."""
    scaled = scene.view.scaled[scene.view.telling] * scene.nominal
    return _OF_NORMAL * median(np.abs(scaled)) if scaled.size else np.inf


def _of_step(step: VisibleStep, scene: _Scene) -> Fault:
    size, error = (value / abs(scene.nominal) for value in (step.step, step.uncertainty))
    declared = scene.record.apparatus.resolution
    known = declared is not None and step.step < 1.5 * declared
    said = "as declared" if known else f"declare '# resolution: {step.step:.6g}'"
    return told_fault(
        "quantization",
        f"all readings are multiples of {step.step:.6g} {scene.record.unit or 'output units'}"
        f" ({acceleration(size)}), which their noise does not hide; {said}, or read more digits",
        {"step": Quantity(size, error, "g")},
        step.p_value,
        range(len(scene.record)),
    )


def _of_vibration(scene: _Scene, chance: float) -> Fault:
    shaking, uncertainty, sigma = vibration(scene.readings, scene.c, scene.record.mounting)
    return told_fault(
        "vibration-noise",
        f"readings scatter by {acceleration(sigma)} where the angle does not matter and"
        f" by {acceleration(float(np.hypot(sigma, shaking)))} where it matters most,"
        f" {written_p_value(chance)}; nothing is taken out for it; quiet the stand",
        {"sigma": Quantity(shaking, uncertainty, "g")},
        chance,
    )


def nominal_scale(record: TumbleRecord, c: Conditions, kept: Mask | None = None) -> float:
    """Slope of the readings next to the reference temperature against the input [output unit / g].

    It is half the range of the readings where there is no slope, 1 where there is no range. The
    readings that are `kept`, shape (n,), are used.
    """
    away = np.abs(c.excess)
    own = away <= away.min() + LEVEL_CHANGE
    own &= True if kept is None else kept
    x = c.input[own] - c.input[own].mean() if own.any() else np.zeros(0)
    slope = float(x @ record.output[own] / ((x @ x) or np.inf))
    return slope or float(np.ptp(record.output)) / 2.0 or 1.0


def single_readings(
    record: TumbleRecord, c: Conditions, nominal: float, weight: Array, least: float, alpha: float
) -> tuple[tuple[Fault, ...], TumbleRecord]:
    """Find outliers and exchanged readings, with a scale factor [output unit / g].

    The weight, shape (n,), is the relative inverse standard deviation of each reading's noise,
    which is no smaller than `least` [g]. Faults are exchanges, then outliers. In the record,
    exchanged readings are exchanged back and outliers set aside; its notes name readings that are
    kept though only heavy tails of the noise explain them.
    """
    views = views_of(record.output / nominal, c, record.mounting, weight, least)
    steps, after, doubtful = suspects(views, alpha)
    exchanges = [step for step in steps if step.is_exchange]
    found = [_exchange(record, c, step) for step in exchanges]
    for step in exchanges:
        record = _exchanged(record, list(step.readings))
    outliers = [step for step in steps if step.is_outlier]
    kept = np.ones(len(record), dtype=np.bool_)
    kept[[step.readings[0] for step in outliers]] = False
    ratio = nominal / nominal_scale(record, c, kept)  # now without the faults
    for step, (e, u) in zip(outliers, _errors(views, after, steps), strict=True):
        found.append(_outlier(record, c, step, e * ratio, u * abs(ratio)))
    notes = [_doubt(record, step) for step in doubtful]
    return tuple(found), replace(record.select(kept), notes=(*record.notes, *notes))


def _exchanged(record: TumbleRecord, pair: list[int]) -> TumbleRecord:
    """Put two readings into each other's place, with what is known of their scatter."""
    changed = {}
    for name in ("output", "std", "count"):
        values = getattr(record, name)
        if values is not None:
            values = values.copy()
            values[pair] = values[pair[::-1]]
            changed[name] = values
    return replace(record, **changed)


def _errors(views: Views, after: Views, steps: list[Suspect]) -> list[tuple[float, float]]:
    """Error of each outlier and its standard uncertainty [g], all estimated together."""
    wrong = [step.readings[0] for step in steps if step.is_outlier]
    for step in steps:
        views = views if step.is_outlier else views.after(step)
    weight = views.weight[wrong]
    view, rest = views.pooled, after.pooled
    inverse = np.linalg.pinv(view.among(wrong), hermitian=True)
    values = inverse @ view.residual[wrong] / weight
    sigma = np.sqrt(max(rest.squares / max(rest.dof, 1.0), views.least**2))
    spread = sigma * np.sqrt(np.diagonal(inverse)) / weight
    return list(zip(values.tolist(), spread.tolist(), strict=True))


def _where(record: TumbleRecord, reading: int) -> str:
    return of_run(record, reading) + reading_name(record, reading, record.line)


def _doubt(record: TumbleRecord, step: Suspect) -> str:
    if_normal, p = written_p_value(step.if_normal), written_p_value(step.p_value)
    return (
        f"{_where(record, step.readings[0])} is {step.deviation:.1f} standard deviations off its"
        f" replicates: an outlier if the noise is normal ({if_normal}), but with"
        f" tails as heavy as the other readings allow it may be none ({p}); it"
        " is kept: look it up, or repeat it"
    )


def _outlier(
    record: TumbleRecord, c: Conditions, step: Suspect, size: float, uncertainty: float
) -> Fault:
    (reading,), chance = step.readings, step.p_value
    return told_fault(
        "outlier",
        f"{_where(record, reading)} is {acceleration(size)} off its replicates (standard"
        f" uncertainty {acceleration(uncertainty)}, {written_p_value(chance)}): set aside as an"
        " outlier; repeat the reading",
        {
            "error": Quantity(size, uncertainty, "g"),
            "reading": Quantity(float(c.number[reading]), 0.0, "1"),
        },
        chance,
        [reading],
    )


def _exchange(record: TumbleRecord, c: Conditions, step: Suspect) -> Fault:
    chance = max(step.p_value, SMALLEST)
    first, second = sorted(step.readings, key=lambda reading: int(c.number[reading]))
    apart = float(c.number[second] - c.number[first])
    other = reading_name(record, second, record.line)
    return told_fault(
        "swapped-positions",
        f"{_where(record, first)} and {other} are written at each other's place"
        f" ({written_p_value(chance)}): exchanged back; check the protocol",
        {
            "reading": Quantity(float(c.number[first]), 0.0, "1"),
            "apart": Quantity(apart, 0.0, "1"),
        },
        chance,
        [first, second],
    )
