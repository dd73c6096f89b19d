"""The components of (4), each with value, bound and standard uncertainty, and how they correlate.

Effects that a calibration was freed of are components beside them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.compensate.at_temperature import CoefficientsAt
from accelcal.effects.static import Samples, StaticEffects, static_effects
from accelcal.error_budget.coefficients import Coefficients, Conditions
from accelcal.error_budget.random_part import RandomBound, RandomPart
from accelcal.estimate.uncertainty import combined, counted
from accelcal.model import CROSS_AXES, ERROR_TERMS, LAWS, acceleration_error, bias_bound
from accelcal.results.calibration import Calibration
from accelcal.results.covariance import CorrelatedBySource
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


class Correlations(NamedTuple):
    """What the errors of q coefficients have in common.

    Attributes
    ----------
    symbols : tuple of str
        Symbols of their components.
    shared : ndarray, shape (2, q, q)
        Their covariance over both standard uncertainties, and with each source of error over its
        degrees of freedom. On the diagonal stands what one alone has over degrees of freedom fewer
        than the 1 that its component tells.
    """

    symbols: tuple[str, ...]
    shared: Array


def covariance(
    correlations: Sequence[Correlations], points: Conditions, parts: Sequence[ErrorComponent]
) -> Array:
    """Sum of 2 r u u' over all pairs of correlated coefficients, GUM (16), at n points.

    Returns
    -------
    ndarray, shape (2, n)
        What correlation adds to the variance [g^2], and to the sum of the variances, each over its
        degrees of freedom.

    Notes
    -----
    The covariance is that of the fit. Laws from all readings do not tell how they are correlated
    with k2, k3 and delta_ip, which count as uncorrelated with them: mostly on the safe side.
    """
    known = correlated_symbols(correlations)
    signed = {part.symbol: _signed(part, points) for part in parts if part.symbol in known}
    unknown, total = np.zeros(points.rise.size), np.zeros((2, points.rise.size))
    above = points.rise > 0.0
    for (symbols, shared), there in zip(correlations, (above, ~above), strict=True):
        own = np.array([signed.get(symbol, unknown) for symbol in symbols]).reshape(-1, above.size)
        total += np.where(there, (shared @ own * own).sum(axis=1), 0.0)
    return total


def correlated_symbols(correlations: Sequence[Correlations]) -> frozenset[str]:
    """Symbols of the components that are correlated with others."""
    return frozenset(symbol for found in correlations for symbol in found.symbols)


def _signed(part: ErrorComponent, points: Conditions) -> Array:
    """Standard uncertainty with the sign by which the coefficient acts."""
    at_T0 = {slope: name for name, (_, slope) in SLOPES.items()}
    name = at_T0.get(part.symbol, part.symbol)
    acting = sensitivity(name, points)
    acting = acting * points.rise if part.symbol in at_T0 else acting
    return np.asarray(part.standard_uncertainty * np.sign(acting))


def correlations_of(coefficients: Coefficients) -> list[Correlations]:
    """What the coefficients share where the slopes above T0 act, and where those below do."""
    return [_correlations(coefficients, side) for side in ("above", "below")]


def correlations_of_other_axis(coefficients: Coefficients) -> list[Correlations]:
    """Take those of its misalignment at T0 and the slopes on either side."""
    model, (name, _) = coefficients.second, coefficients.of_other_axis
    if model is None or name not in coefficients.slopes:
        return [_by_pairs(coefficients.alone, [])] * 2
    symbols = ({"delta at_T0": name, f"delta {s}": SLOPES[name][1]} for s in ("above", "below"))
    return [_by_pairs(model, [own.get(n) for n in model.covariance_names]) for own in symbols]


def _correlations(coefficients: Coefficients, side: str) -> Correlations:
    model = coefficients.model
    if model is None:
        return _alone(coefficients)
    symbols = {name: name for name in ("k2", "k3")}
    for name, law in zip(coefficients.slopes, LAWS, strict=False):
        symbols |= {f"{law} at_T0": name, f"{law} {side}": SLOPES[name][1]}
    main = list(coefficients.slopes)[2]
    symbols["delta_ip"] = next(a.coupling for a in CROSS_AXES.values() if a.misalignment == main)
    names = model.covariance_names
    signs = _signs(coefficients, names, "K1 at_T0")
    return _by_pairs(model, [symbols.get(name) for name in names], signs)


def _signs(coefficients: Coefficients, names: Sequence[str], scale_factor: str) -> Array:
    """Signs from K1 beside quotients by it, which laws and means have, to the dK1/K1 of (4)."""
    turned = (coefficients.at_T0["K1"].value or 0.0) < 0.0
    return np.array([-1.0 if turned and name == scale_factor else 1.0 for name in names])


def _alone(coefficients: Coefficients) -> Correlations:
    """Correlations of (1) stand for those of (2): the quotient by K1 changes next to nothing.

    A mean of runs has those of (2) with K1.
    """
    axis = CROSS_AXES[coefficients.mounting[0]]
    of_axis = {"delta": axis.misalignment, "delta_ip": axis.coupling}
    terms = [ERROR_TERMS.get(name, name) for name in coefficients.alone.covariance_names]
    symbols = [of_axis.get(term, term) for term in terms]
    kept = [symbol if symbol in coefficients.at_T0 else None for symbol in symbols]
    of_mean = isinstance(coefficients.alone, CoefficientsAt)
    return _by_pairs(coefficients.alone, kept, _signs(coefficients, terms, "K1" if of_mean else ""))


def _by_pairs(
    known: CorrelatedBySource | CoefficientsAt,
    symbols: Sequence[str | None],
    sign: Array | float = 1.0,
) -> Correlations:
    """What the errors of each pair of quantities have in common, with the signs they are to have.

    The symbol None leaves one out, as an exact one is.
    """
    errors = np.stack([known.covariance, known.over_dof])
    sigma = sign * np.sqrt(np.diagonal(errors[0]))
    kept = [i for i, symbol in enumerate(symbols[: sigma.size]) if symbol and sigma[i]]
    kept = kept if len(kept) > 1 else []
    shared = errors[:, kept][:, :, kept] / np.outer(sigma[kept], sigma[kept])
    np.fill_diagonal(shared[0], 0.0)
    np.fill_diagonal(shared[1], np.maximum(np.diagonal(shared[1]) - 1.0, 0.0))
    return Correlations(tuple(str(symbols[i]) for i in kept), shared)
