"""The budget of a stand: JCGM 100 and, where asked for, JCGM 101."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from accelcal.accelerometer import AL15, Accelerometer, BilinearLaw
from accelcal.arguments.kinds import expect
from accelcal.arguments.numbers import check_whole
from accelcal.arrays import Array
from accelcal.compensate.choice import compensation
from accelcal.estimate.tables import Method
from accelcal.estimate.uncertainty import welch_satterthwaite
from accelcal.model import COEFFICIENTS
from accelcal.numerics.probability import LEVEL, student_quantile
from accelcal.plural import counted
from accelcal.record import TumbleRecord
from accelcal.reference import USUAL_TEMPERATURE, fixture_angle
from accelcal.results.calibration import Calibration
from accelcal.results.stand_budget import StandBudget, StandShare
from accelcal.specification import Specification
from accelcal.stand_uncertainty.estimator import Estimator, estimator_of
from accelcal.stand_uncertainty.kinds import ERROR_QUANTITIES, KINDS
from accelcal.stand_uncertainty.monte_carlo import monte_carlo
from accelcal.stand_uncertainty.readings import StandReadings, readings_of
from accelcal.stand_uncertainty.requirements import requirements, sufficiency
from accelcal.stand_uncertainty.stand import Acting, Stand, acting
from accelcal.units import HOUR

__all__ = ["stand_budget"]

_STEP = 1e-4
"""Step of the central difference of a channel; its rounding error is 1e-12 of the slope."""

_UNSTABLE = (
    "the Monte Carlo ends are not yet known to a fifth of the tolerance with which they are"
    " compared; make more trials"
)


def stand_budget(
    stand: Stand,
    test: TumbleRecord,
    accelerometer: Accelerometer | Calibration = AL15,
    *,
    method: Method = "least-squares",
    trials: int | None = 0,
    seed: int | None = None,
    targets: Mapping[str, float | str] | None = None,
    specification: Specification | None = None,
) -> StandBudget:
    """Tell what a stand's errors make of each coefficient of a tumble test.

    Parameters
    ----------
    stand : Stand
        The errors with their distributions, as of `accelcal.read_stand`.
    test : TumbleRecord
        The test: angles, strokes, runs, temperatures, mountings and times of its readings, as of
        `accelcal.simulate` or `accelcal.read_table`. Its outputs are not used.
    accelerometer : Accelerometer or Calibration, default `AL15`
        The coefficients that the accelerometer has.
    method : str, default "least-squares"
        ``"least-squares"``, ``"closed-form"``, ``"sign-corrected"`` or ``"printed"``.
    trials : int or None, default 0
        Monte Carlo trials: 0 for none, None for as many as make the result stable.
    seed : int, optional
        Seed of the random numbers.
    targets : mapping of str to float or str, optional
        Largest expanded uncertainties, such as ``{"K1": "5 ppm"}``, numbers in the unit of the
        coefficient: what must each instrument be?
    specification : Specification, optional
        Data sheet: does the stand suffice for its limits?

    Returns
    -------
    StandBudget
        Standard uncertainty of every coefficient by component, degrees of freedom, expanded
        uncertainty and, where asked for, the Monte Carlo result with its verdict on the linear one.

    Raises
    ------
    InputError
        If a component needs what the stand does not tell, such as the load, or the test is none.
    DesignError
        If the angles do not determine K1.

    Notes
    -----
    JCGM 100, 5.1.2: each component acts through the readings (central differences of the exact
    model) and the estimator, a matrix, and through the quotients of the error model. Errors are
    independent between the classes that a component varies by, and common within one. JCGM 101
    takes every reading of every trial from the exact model.

    Examples
    --------
    >>> import accelcal
    >>> gain = accelcal.distribution("rectangular", half_width=30e-6)
    >>> voltmeter = accelcal.StandComponent("gain", "voltmeter-gain", gain)
    >>> stand = accelcal.Stand("voltmeter alone", (voltmeter,))
    >>> found = accelcal.stand_budget(stand, accelcal.simulate(seed=1))
    >>> round(found.contribution("K1")["gain"] / 1.35 * 1e6, 2)
    17.32
    """
    expect(stand, Stand)
    expect(test, TumbleRecord)
    if isinstance(accelerometer, Calibration):
        accelerometer = accelerometer_of(accelerometer)
    expect(accelerometer, Accelerometer)
    _check_options(trials, seed, specification)
    readings = readings_of(test, accelerometer, stand.conditions, fixture_angle(test))
    estimator = estimator_of(readings, method, stand.conditions.local_gravity)
    parts = [acting(component, readings) for component in stand.components]
    budget = _linear(stand, parts, readings, estimator)
    if targets is not None:
        budget = replace(budget, requirements=requirements(budget, targets))
    if specification is not None:
        limits = sufficiency(budget, specification, readings.unit)
        budget = replace(budget, data_sheet=limits)
    return budget if trials == 0 else _tried(budget, parts, readings, estimator, trials, seed)


def _check_options(
    trials: int | None, seed: int | None, specification: Specification | None
) -> None:
    for name, value in (("trials", trials), ("seed", seed)):
        if value is not None:
            check_whole(0, **{name: value})
    if specification is not None:
        expect(specification, Specification)


def _tried(
    budget: StandBudget,
    parts: Sequence[Acting],
    readings: StandReadings,
    estimator: Estimator,
    trials: int | None,
    seed: int | None,
) -> StandBudget:
    """Add the Monte Carlo result."""
    made = None if trials is None else int(trials)
    found = monte_carlo(parts, readings, estimator, budget, trials=made, seed=seed)
    said = () if found.stable else (_UNSTABLE,)
    return replace(budget, monte_carlo=found, warnings=(*budget.warnings, *said))


def _linear(
    stand: Stand, parts: Sequence[Acting], readings: StandReadings, estimator: Estimator
) -> StandBudget:
    coefficients = estimator.map @ readings.output({})
    slopes = _jacobian(estimator, coefficients)
    found = [_propagated(part, readings, estimator, slopes) for part in parts]
    shares = tuple(_share(part, *effect) for part, effect in zip(parts, found, strict=True))
    covariance = np.sum([through @ through.T for through, _ in found], axis=0)
    standard = np.sqrt(np.maximum(np.diagonal(covariance), 0.0))
    of_each = np.array([part.contributions for part in shares]) ** 2
    dof = welch_satterthwaite(of_each, [part.dof for part in shares])
    factor = np.array([student_quantile(LEVEL, float(own)) for own in dof])
    return StandBudget(
        stand=stand.name,
        source=stand.source,
        test=_described(readings),
        coefficients=estimator.named,
        nominal=estimator.estimates(np.append(coefficients, 1.0)),
        components=shares,
        standard_uncertainty=standard,
        dof=dof,
        coverage_factor=factor,
        expanded_uncertainty=factor * standard,
        covariance=covariance,
        warnings=tuple(_warnings(stand, readings, estimator)),
    )


def _channel_slopes(readings: StandReadings, channel: str) -> Array:
    """Change of the n readings, and behind them of the gravity, per unit of a channel, (n + 1,).

    By central differences. At T0, where bilinear laws break, it is the mean of both slopes.
    """
    n = len(readings.record)
    if channel == "gravity":
        return np.append(np.zeros(n), 1.0)
    step = np.full(n, _STEP)
    forward, back = (readings.output({channel: sign * step}) for sign in (1.0, -1.0))
    return np.append((forward - back) / (2.0 * _STEP), 0.0)


def _jacobian(estimator: Estimator, coefficients: Array) -> Array:
    """Derivative of all that is budgeted by coefficients and gravity, shape (q, p + 1).

    By a step in the complex plane, at coefficients without errors, shape (p,).
    """
    h = 1e-30
    known = np.append(coefficients, 1.0)
    return np.asarray(estimator.estimates(known + 1j * h * np.eye(known.size)).imag.T / h)


def _propagated(
    part: Acting, readings: StandReadings, estimator: Estimator, by_coefficient: Array
) -> tuple[Array, float]:
    """Bring one component, of m errors, through readings and estimator.

    That is the change of each coefficient by one standard uncertainty of each error, shape (q, m),
    and the part of the effect on the readings that the residuals show, NaN where there is no
    effect.
    """
    slopes = _channel_slopes(readings, part.channel)
    standard = part.component.distribution.standard
    effects = [slopes[:-1] * phase for phase in (standard * part.pattern).T]
    on_coefficients = [_by_error(estimator.map * effect, part) for effect in effects]
    along_fit = [_by_error(estimator.fitted.T * effect, part) for effect in effects]
    gravity = np.zeros((1, part.errors * len(effects)))
    gravity[0, 0] = slopes[-1] * standard
    known = np.vstack([np.hstack(on_coefficients), gravity])
    left = _part_left(estimator, effects, np.hstack(along_fit), known[:-1])
    return by_coefficient @ known, left


def _by_error(values: Array, part: Acting) -> Array:
    """Sums of the columns that share an error, shape (p, errors)."""
    return np.stack([np.bincount(part.error, row, minlength=part.errors) for row in values])


def _part_left(
    estimator: Estimator, effects: Sequence[Array], along_fit: Array, on_coefficients: Array
) -> float:
    """Size of the residuals e - F c of all errors, over that of their effects e."""
    squares = float(sum(effect @ effect for effect in effects))
    if squares == 0.0:
        return float("nan")
    across = float((along_fit * on_coefficients).sum())  # e F c
    gram = estimator.fitted.T @ estimator.fitted
    fitted = float((on_coefficients * (gram @ on_coefficients)).sum())
    return float(np.sqrt(max(squares - 2.0 * across + fitted, 0.0) / squares))


def _share(part: Acting, through: Array, residual: float) -> StandShare:
    own, single = part.component, through.shape[1] == 1
    return StandShare(
        name=own.name,
        kind=own.kind,
        standard_uncertainty=own.distribution.standard,
        unit=ERROR_QUANTITIES[KINDS[own.kind].quantity].unit,
        dof=own.distribution.dof,
        varies=own.varies,
        errors=part.errors,
        averages=own.averages,
        fixed=own.fixed,
        contributions=through[:, 0] + 0.0 if single else np.linalg.norm(through, axis=1),
        residual=residual,
        origin=own.origin,
    )


def _described(readings: StandReadings) -> str:
    """Tell the test in words."""
    record = readings.record
    levels = ", ".join(f"{t:g}" for t in dict.fromkeys(readings.temperature.round(6).tolist()))
    mountings = ", ".join(dict.fromkeys(record.mounting.tolist()))
    return (
        f"{len(record)} readings, {record.head_angles.size} positions,"
        f" {counted(record.stroke.max(), 'stroke')}, {counted(len(record.run_labels), 'run')}"
        f" at {levels} degC, mounting {mountings}"
    )


def _warnings(stand: Stand, readings: StandReadings, estimator: Estimator) -> Iterator[str]:
    lost = [name for name in COEFFICIENTS if any(name not in t.names for t in estimator.tables)]
    if lost:
        yield f"the angles do not determine {', '.join(lost)}, which the others take in"
    kinds = {part.kind for part in stand.components}
    if "foundation-drift" in kinds or "foundation-daily" in kinds:
        hours = readings.conditions.time.max() / HOUR
        yield f"the foundation moves over the {hours:.3g} h from the first reading to the last"
    temperature = {"chamber-temperature", "chamber-gradient"}
    if not kinds & temperature:
        yield "no component of the chamber: temperatures are taken as known"


def accelerometer_of(calibration: Calibration) -> Accelerometer:
    """Take the coefficients of a calibration as those of the accelerometer.

    They are those by which `accelcal.apply` takes the outputs; what was not determined is zero, and
    a slope that was not that of the other side.

    Raises
    ------
    InputError
        As `accelcal.compensate.choice.compensation`.

    Examples
    --------
    >>> import accelcal
    >>> found = accelerometer_of(accelcal.fit(accelcal.simulate(seed=1)))
    >>> round(found.scale_factor.at_T0, 3), round(found.scale_factor.above * 1e6)
    (1.35, 520)
    """
    found, reference = compensation(calibration, effects=False), calibration.T0_degC
    scale_factor, bias, misalignment = (
        BilinearLaw(law.at_T0, law.above.value, law.below.value)
        for law in (found.K1, found.k0, found.cross.delta)
    )
    return Accelerometer(
        scale_factor=scale_factor,
        bias=bias,
        misalignment=misalignment,
        k2=found.k2,
        k3=found.k3,
        cross_coupling=found.cross.delta_ip,
        reference_temperature=USUAL_TEMPERATURE if reference is None else reference,
        unit=calibration.output_unit,
        serial=calibration.serial,
    )
