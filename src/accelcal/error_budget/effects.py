"""Effects that a calibration was freed of, as components of the error beside those of (4)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from accelcal.effects.static import Samples, StaticEffects, static_effects
from accelcal.error_budget.coefficients import Coefficients
from accelcal.error_budget.components import without_bound
from accelcal.error_budget.conditions import Conditions
from accelcal.estimate.uncertainty import combined
from accelcal.model import CROSS_AXES
from accelcal.results.calibration import Calibration
from accelcal.results.error_budget import ErrorComponent


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
        yield _component(one, samples, points.acceleration.input)


def _component(one: StaticEffects, samples: Samples, a_i: np.ndarray) -> ErrorComponent:
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
