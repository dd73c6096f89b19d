"""The components of (4), each with its value, its bound and its standard uncertainty.

Effects that a calibration was freed of are components beside them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from accelcal.arrays import Array
from accelcal.effects.static import Samples, StaticEffects, static_effects
from accelcal.error_budget.coefficients import Coefficients, Conditions
from accelcal.error_budget.random_part import RandomBound, RandomPart
from accelcal.estimate.uncertainty import combined, counted
from accelcal.model import CROSS_AXES, acceleration_error, bias_bound
from accelcal.results.calibration import Calibration
from accelcal.results.error_budget import ErrorComponent
from accelcal.results.quantity import Quantity

AT_T0 = {
    "k0": "bias at T0",
    "K1": "scale factor at T0",
    "k2": "second order",
    "k3": "third order",
    "delta_O": "misalignment at T0",
    "delta_P": "misalignment at T0",
    "delta_ip": "cross-coupling",
    "delta_io": "cross-coupling",
}
"""Coefficients at T0 -> what they are."""

SLOPES = {
    "k0": ("bias, temperature", "lam"),
    "K1": ("scale factor, temperature", "beta"),
    "delta_O": ("misalignment, temperature", "gam_O"),
    "delta_P": ("misalignment, temperature", "gam_P"),
}
"""Coefficients with slopes -> what their slope is, and its symbol."""


def sensitivity(name: str, points: Conditions) -> Array:
    """Error per unit of a coefficient of (2); that of the scale factor is relative.

    Returns
    -------
    ndarray, shape (n,)
        Such as a_i^2 for k2 [local g per unit of the coefficient].
    """
    term = {"k1" if name == "K1" else name: 1.0}
    return acceleration_error(term, points.acceleration) + np.zeros(points.rise.size)


def systematic_components(
    coefficients: Coefficients, points: Conditions, *, temperature_uncertainty: float, exact: bool
) -> Iterator[ErrorComponent]:
    """Make the components that a calibration tells.

    Parameters
    ----------
    coefficients : Coefficients
        What was calibrated.
    points : Conditions
        The points.
    temperature_uncertainty : float
        Standard uncertainty of the temperature [degC].
    exact : bool
        Take beta dT / (1 + beta dT) in place of beta dT.

    Yields
    ------
    ErrorComponent
        Values at T0, slopes times T - T0, and the uncertainty of the temperature.
    """
    for name, quantity in coefficients.at_T0.items():
        yield _at_reference(name, quantity, points)
    for name in coefficients.slopes:
        yield _with_temperature(name, coefficients, points, exact)
    slope = _slope_of_error(coefficients, points)
    heat = without_bound("T", "uncertainty of the temperature", slope * temperature_uncertainty)
    yield replace(heat, origin="given" if temperature_uncertainty else "")


def without_bound(
    symbol: str,
    name: str,
    standard: Array,
    value: Array | float = 0.0,
    dof: Array | float = np.inf,
) -> ErrorComponent:
    """Component that a calibration tells, with nothing behind +- in (4)."""
    return ErrorComponent(
        name=name,
        symbol=symbol,
        value=np.full(standard.size, value),
        bound=np.zeros(standard.size),
        standard_uncertainty=np.abs(standard),
        dof=np.full(standard.size, dof),
        origin="calibration",
    )


def _slope_of_error(coefficients: Coefficients, points: Conditions) -> Array:
    """Size of the slope of the whole error [g/degC]; at T0 itself the larger of the two."""

    def total(side: float) -> Array:
        slopes = np.zeros(points.rise.size)
        for name in coefficients.slopes:
            one_side = coefficients.slope(name, np.full(slopes.size, side), "value")
            slopes += one_side * sensitivity(name, points)
        return np.abs(slopes)

    above, below = total(1.0), total(-1.0)
    at_reference = np.maximum(above, below)
    return np.where(points.rise > 0, above, np.where(points.rise < 0, below, at_reference))


def _at_reference(name: str, quantity: Quantity, points: Conditions) -> ErrorComponent:
    x = sensitivity(name, points)
    value, standard = quantity.value or 0.0, quantity.standard_uncertainty or 0.0
    if name == "K1":  # (4) takes the reading over this K1: only its uncertainty is an error
        value, standard = 0.0, standard / abs(value)
    dof = np.inf if quantity.dof is None else quantity.dof
    return without_bound(name, AT_T0[name], standard * x, value * x, dof)


def _with_temperature(
    name: str, coefficients: Coefficients, points: Conditions, exact: bool
) -> ErrorComponent:
    title, symbol = SLOPES[name]
    change = coefficients.slope(name, points.rise, "value") * points.rise
    if exact and name == "K1":
        change = change / (1.0 + change)  # (K1 - K1N)/K1 of (2), where (4) has beta dT
    standard = coefficients.slope(name, points.rise, "standard_uncertainty") * points.rise
    x = sensitivity(name, points)
    dof = coefficients.slope(name, points.rise, "dof")
    return without_bound(symbol, title, standard * x, change * x, dof)


def effect_components(
    calibration: Calibration, coefficients: Coefficients, points: Conditions
) -> Iterator[ErrorComponent]:
    """Make the components of static effects.

    Yields
    ------
    ErrorComponent
        One for each: what it adds to the indication, and the uncertainty of its size.
    """
    scale = coefficients.at_T0.get("K1")
    found = static_effects(calibration, (scale and scale.value) or 1.0, coefficients.reference)
    if found is None:
        return
    samples = _samples(coefficients, points)
    for one in found.each():
        yield _of_effect(one, samples, points.acceleration.input)


def _of_effect(one: StaticEffects, samples: Samples, a_i: Array) -> ErrorComponent:
    (item,) = one.disturbances
    variances, freedom = zip(*one.parts(samples, a_i), strict=True)
    told = combined(variances, [np.asarray(dof) for dof in freedom])
    value = one.total(samples, a_i)
    return without_bound(item.effect.id, item.effect.name, told.standard, value, told.dof)


def _samples(coefficients: Coefficients, points: Conditions) -> Samples:
    """What effects depend on beside a_i, by the coefficients of (4)."""
    value = {name: quantity.value or 0.0 for name, quantity in coefficients.at_T0.items()}
    change = {
        name: coefficients.slope(name, points.rise, "value") * points.rise
        for name in coefficients.slopes
    }
    still, cross = np.zeros(points.rise.size), []
    tilt, linear = still, np.ones(still.size)
    for axis in CROSS_AXES.values():
        delta = axis.misalignment
        if delta in value:
            along = getattr(points.acceleration, axis.name)
            tilt = tilt + (value[delta] + change.get(delta, still)) * along
            linear = linear + value.get(axis.coupling, 0.0) * along
            cross.append(along)
    return Samples(
        rise=points.rise,
        cross=cross,
        bias=value["k0"] + change.get("k0", still),
        tilt=tilt,
        linear=linear,
        second=value.get("k2", 0.0),
        third=value.get("k3", 0.0),
        scale=value.get("K1", 1.0) * (1.0 + change.get("K1", still)),
    )


def random_components(random: RandomPart, points: Conditions) -> Iterator[ErrorComponent]:
    """Make the components behind +- in (4).

    Yields
    ------
    ErrorComponent
        Launch, drift and fluctuation with their shares of (3), then the terms of (4).
    """
    ones = np.ones(points.time.size)
    of_bias = {
        "k0L": ("bias, launch to launch", random.launch, ones),
        "k0D": ("bias drift", random.drift, points.time),
        "k0F": ("bias fluctuation", random.fluctuation, ones),
    }
    squares = {symbol: (b.bound * x) ** 2 for symbol, (_, b, x) in of_bias.items()}
    total = np.sum(list(squares.values()), axis=0)
    sizes = random.launch.bound, random.drift.bound, random.fluctuation.bound
    bound = bias_bound(points.time, *sizes)  # eq. (3)
    for symbol, (name, part, x) in of_bias.items():
        share = np.divide(squares[symbol], total, out=np.zeros(total.size), where=total > 0.0)
        yield _random(name, symbol, part, x, bound * share)
    for symbol, name, part, x in (
        ("h_T", "hysteresis of the bias", random.hysteresis, ones),
        ("p", "threshold", random.threshold, ones),
        ("k1", "scale factor instability", random.scale_factor, points.acceleration.input),
    ):
        yield _random(name, symbol, part, x, np.abs(part.bound * x))


def _random(name: str, symbol: str, part: RandomBound, x: Array, bound: Array) -> ErrorComponent:
    return ErrorComponent(
        name=name,
        symbol=symbol,
        value=np.zeros(x.size),
        bound=bound,
        standard_uncertainty=np.abs(part.standard_uncertainty * x),
        dof=np.full(x.size, counted(part.dof)),
        origin=part.origin,
    )
