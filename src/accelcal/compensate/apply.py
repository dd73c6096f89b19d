"""From outputs to accelerations with their uncertainties."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arguments.numbers import (
    check_number,
    check_side_by_side,
    number_array,
    refuse_other_order,
)
from accelcal.arguments.options import check_choice, check_flag
from accelcal.arguments.temperatures import temperature_array
from accelcal.arrays import Array
from accelcal.compensate.assumptions import warn_of
from accelcal.compensate.choice import BY, By, compensation
from accelcal.compensate.coefficients import Compensation
from accelcal.compensate.inversion import invert, invert_with, slope
from accelcal.compensate.measured import MeasuredAcceleration, in_blocks
from accelcal.compensate.propagation import Part, interval_of_parts
from accelcal.compensate.ranges import (
    CALIBRATE_THERE,
    MORE_THAN_TESTS,
    WIDEST,
    outside_temperatures,
    refuse_metres,
    within_accelerations,
    within_temperatures,
)
from accelcal.compensate.triad import apply_triad, assumptions_of_triad, refuse_for_triad
from accelcal.effects.static import Samples
from accelcal.errors import InputError
from accelcal.plural import counted, listed
from accelcal.results.calibration import Calibration
from accelcal.results.triad import TriadCalibration

__all__ = ["apply", "compensate"]


def apply(
    calibration: Calibration | TriadCalibration,
    output: ArrayLike,
    temperature: ArrayLike | None = None,
    *,
    a_p: ArrayLike | None = None,
    a_o: ArrayLike | None = None,
    run: str | int | None = None,
    by: By = "laws",
    extrapolate: bool = False,
    same_launch: bool = False,
    output_uncertainty: float = 0.0,
    temperature_uncertainty: float = 0.0,
) -> MeasuredAcceleration:
    """Turn outputs of a calibrated accelerometer, or of a triad, into accelerations.

    Parameters
    ----------
    calibration : Calibration or TriadCalibration
        The calibration. That of a triad has no cross axes and runs, so these are refused with it.
    output : array_like
        Outputs Y; of a triad those of the channels x, y, z along the last axis
        [output unit of the calibration].
    temperature : array_like, optional
        Temperatures, or one for all samples; needed with temperature laws, and refused with a
        triad whose own is not known [degC].
    a_p, a_o : array_like, optional
        Acceleration along the pendulous and the output axis, 0 by default [g].
    run : str or int, optional
        Use the table of this run only.
    by : {"laws", "levels"}, default "laws"
        How the coefficients depend on temperature: by the laws of the calibration, or on straight
        lines between its levels.
    extrapolate : bool, default False
        Accept temperatures outside the calibrated range, with a warning.
    same_launch : bool, default False
        Leave the shift from launch to launch out of the uncertainty: the outputs are of a launch of
        the calibration itself.
    output_uncertainty : float, default 0
        Standard uncertainty of an output, its noise included [output unit].
    temperature_uncertainty : float, default 0
        Standard uncertainty of a temperature [degC].

    Returns
    -------
    MeasuredAcceleration
        Accelerations along the input axis, in the shape of the arguments broadcast; of a triad
        along the axes of its frame.

    Raises
    ------
    InputError
        If a temperature is needed, outside the calibrated range or none of a test, a cross axis was
        not calibrated or is gravity in m/s^2, the calibration is not usable, Series of pandas have
        different indices, or an argument is none of a triad.

    Warns
    -----
    AccelcalWarning
        About every coefficient that was not determined, and what is assumed in its place; about
        accelerations across that were hardly meant in g.

    Notes
    -----
    Equation (1) in its product form is solved by Newton's method:
    Y = K1(T) [k0(T) + a_i + k2 a_i^2 + k3 a_i^3 + delta(T) a_p + delta_ip a_i a_p].
    Effects of the calibration that depend on acceleration and temperature alone (`Effect.static`)
    are in the brackets too, and the uncertainty of their sizes in that of the acceleration. Of a
    triad see `accelcal.compensate.triad.apply_triad`.

    Examples
    --------
    >>> import accelcal
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> measured = accelcal.apply(calibration, [1.3547, -1.3455], temperature=20.0)
    >>> measured.value.round(4).tolist()
    [1.0, -1.0]
    >>> bool(measured.inside.all())
    True
    """
    check_flag(extrapolate=extrapolate, same_launch=same_launch)
    if isinstance(calibration, TriadCalibration):
        heat = temperature_uncertainty or None
        check_choice(BY, by=by)
        levels = None if by == BY[0] else by
        refuse_for_triad(a_p=a_p, a_o=a_o, run=run, by=levels, temperature_uncertainty=heat)
        if calibration.temperature_degC is None:
            refuse_for_triad(extrapolate=extrapolate or None)
        refuse_other_order({"output": output, "temperature": temperature})
        warn_of(assumptions_of_triad(calibration, same_launch=same_launch))
        calibrated = calibration.temperatures
        measured = apply_triad(
            calibration, output, temperature, output_uncertainty=output_uncertainty
        )
    else:
        check_side_by_side(output=output, temperature=temperature, a_p=a_p, a_o=a_o)
        found = compensation(calibration, run, by=by, same_launch=same_launch)
        warn_of(found.assumptions)
        calibrated = found.temperatures
        measured = compensate(
            found,
            output,
            temperature,
            a_p,
            a_o,
            output_uncertainty=output_uncertainty,
            temperature_uncertainty=temperature_uncertainty,
        )
        warn_of(_wide(a_p=a_p, a_o=a_o))
    outside = measured.outside_temperatures
    if outside.any():
        example = np.broadcast_to(np.asarray(temperature, dtype=np.float64), outside.shape)
        problem = outside_temperatures(calibrated, float(example[outside].flat[0]))
        if not extrapolate:
            raise InputError(f"{problem}; {CALIBRATE_THERE}")
        warn_of([f"{problem}, in {counted(int(outside.sum()), 'sample')}"])
    return measured.by_index_of(output, temperature, a_p, a_o)


def compensate(
    found: Compensation,
    output: ArrayLike,
    temperature: ArrayLike | None = None,
    a_p: ArrayLike | None = None,
    a_o: ArrayLike | None = None,
    *,
    output_uncertainty: float = 0.0,
    temperature_uncertainty: float = 0.0,
) -> MeasuredAcceleration:
    """Turn outputs into accelerations, and flag what is outside the calibrated ranges.

    Parameters
    ----------
    found : Compensation
        The coefficients.
    output, temperature, a_p, a_o, output_uncertainty, temperature_uncertainty
        As for `apply`.

    Returns
    -------
    MeasuredAcceleration
        Accelerations along the input axis.

    Raises
    ------
    InputError
        If a temperature is needed, a cross axis was not calibrated, or an argument is no number.

    Notes
    -----
    With J the derivatives of a_i by the coefficients at T0 and by the slopes of the side of the
    sample, and C their covariance, the standard uncertainty is sqrt(J C J'). The part of a second
    cross axis, which comes from other tables, is added linearly, as its correlation is not known.
    The shift to the next launch, the hysteresis, and the errors of output and temperature are
    independent of it and added in squares. The expanded uncertainty has Student's factor for the
    degrees of freedom of all parts together, as `accelcal.estimate.uncertainty` combines them.
    """
    check_number(0.0, output_uncertainty=output_uncertainty)
    check_number(0.0, temperature_uncertainty=temperature_uncertainty)
    rise, across = _rise(found, temperature), _cross(found, {"a_p": a_p, "a_o": a_o})
    Y, rise, *cross = _together(number_array(output, "output"), rise, *across)
    in_rows = [np.reshape(values, -1) for values in (Y, rise, *cross)]
    errors = output_uncertainty, temperature_uncertainty
    with np.errstate(over="ignore", invalid="ignore"):  # of outputs that have no solution
        return in_blocks(
            lambda own: _solved(found, *(values[own] for values in in_rows), errors=errors), Y.shape
        )


def _solved(
    found: Compensation, Y: Array, rise: Array, *cross: Array, errors: tuple[float, float]
) -> MeasuredAcceleration:
    """Accelerations of a block; the errors are those of the output and of the temperature."""
    output_uncertainty, temperature_uncertainty = errors
    samples = found.samples(rise, cross)
    bracket = Y / samples.scale  # the bracket of the product model, k0 + a_i + ... [g]
    target = bracket - samples.bias - samples.tilt
    a_i = _solution(found, samples, target)
    of_coefficients = found.error(samples, a_i, bracket)
    of_output = output_uncertainty / samples.scale
    of_heat = temperature_uncertainty * found.heat_sensitivity(samples, a_i, bracket)
    known = found.hysteresis**2 + of_output**2 + of_heat**2
    launch = found.launch
    parts = [
        of_coefficients,
        Part(np.full_like(a_i, launch.bias**2), launch.bias_dof),
        Part((launch.scale_factor * bracket) ** 2, launch.scale_factor_dof),
        Part(known, math.inf),
    ]
    value, standard, expanded = _through(found, samples, target, a_i, parts)
    return MeasuredAcceleration(
        value=value,
        standard_uncertainty=standard,
        expanded_uncertainty=np.asarray(expanded),
        within_temperatures=within_temperatures(found.temperatures, rise + (found.T0_degC or 0.0)),
        within_accelerations=within_accelerations(found.accelerations, value),
    )


def _solution(found: Compensation, samples: Samples, target: Array) -> Array:
    """Acceleration whose bracket, without bias and tilt, is the target [g]."""
    effects, linear = found.effects, samples.linear
    if effects is None:
        return invert(target, linear, samples.second, samples.third)
    return invert_with(
        lambda a: effects.total(samples, a), target, linear, samples.second, samples.third
    )


def _through(
    found: Compensation, samples: Samples, target: Array, a_i: Array, parts: list[Part]
) -> tuple[Array, Array, Array]:
    """Acceleration, its standard and its expanded uncertainty from those of the bracket.

    Where effects may have steps, the interval of the bracket goes through the solution: what it
    holds in 95 % the accelerations between the solutions of its ends hold too.
    """
    if found.effects is None:
        told = interval_of_parts(parts)
        steepness = slope(a_i, samples.linear, samples.second, samples.third)
        u = np.where(np.isfinite(a_i), told.standard / steepness, np.nan)
        return a_i, u, told.factor * u
    of_effects = (Part(*part) for part in found.effects.parts(samples, a_i))
    told = interval_of_parts([*parts, *of_effects])
    low, high = (_solution(found, samples, target + s * told.expanded) for s in (-1.0, 1.0))
    value = np.where(np.isfinite(high - low), 0.5 * (low + high), a_i)
    return value, 0.5 * (high - low) / told.factor, 0.5 * (high - low)


def _rise(found: Compensation, temperature: ArrayLike | None) -> Array:
    if temperature is not None and found.T0_degC is not None:
        return temperature_array(temperature) - found.T0_degC
    if found.several_levels:
        raise InputError(
            "the calibration depends on temperature; give the temperature of the samples"
        )
    return np.zeros(())


def _cross(found: Compensation, given: dict[str, ArrayLike | None]) -> list[Array]:
    """Accelerations along the calibrated cross axes, in their order."""
    names = [axis.name for axis in found.axes]
    for name, values in given.items():
        if values is not None and name not in names:
            raise InputError(
                f"{name} is given, but the calibration tells only what {listed(names)} does;"
                " leave it out, or calibrate in the other mounting"
            )
    chosen = {name: given[name] for name in names}
    return [np.zeros(()) if a is None else number_array(a, name) for name, a in chosen.items()]


def _wide(**across: ArrayLike | None) -> list[str]:
    """Refuse or name accelerations across the input axis that were hardly meant in g."""
    told = {name: number_array(a, name) for name, a in across.items() if a is not None}
    refuse_metres(**told)
    counts = {name: int(np.sum(np.abs(a) > WIDEST)) for name, a in told.items()}
    return [
        f"{name} is beyond {WIDEST:g} g in {counted(n, 'sample')}, {MORE_THAN_TESTS}; give it in g"
        for name, n in counts.items()
        if n
    ]


def _together(*arrays: Array) -> tuple[Array, ...]:
    """Output, rise of temperature and cross accelerations, one value each a sample."""
    try:
        return np.broadcast_arrays(*arrays)
    except ValueError:
        shapes = ", ".join(str(array.shape) for array in arrays)
        raise InputError(
            f"output, temperature and acceleration across have the shapes {shapes}; give one value"
            " for all samples, or one for each"
        ) from None
