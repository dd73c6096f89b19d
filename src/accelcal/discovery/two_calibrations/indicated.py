"""What two calibrations say is indicated at an acceleration along the input axis."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.compensate.choice import compensation
from accelcal.discovery.two_calibrations.coefficients import Coefficient, Name
from accelcal.discovery.two_calibrations.errors import Side
from accelcal.errors import InputError

_POINTS = 41
_UNTOLD = Coefficient(0.0, np.zeros(1), "")


class Indication(NamedTuple):
    """Output at n accelerations along the input axis, none across it."""

    output: Array  # the output, (n,)
    by_error: Array  # its derivatives by the errors of the calibration, (n, 18)
    by_effect: Array
    """Its changes by independent errors of one standard uncertainty in its effects, (n, k)."""
    effect_dof: Array  # degrees of freedom of these, (k,)


def common_range(old: Side, new: Side) -> Array:
    """Accelerations within 1 g that both calibrations tested, shape (n,) [g].

    Raises
    ------
    InputError
        If there is none.
    """
    (low, high), (lowest, highest) = old.found.accelerations, new.found.accelerations
    first, last = max(low, lowest, -1.0), min(high, highest, 1.0)
    if first > last:
        raise InputError(
            f"no acceleration that both calibrations tested: the old one is for {low:.3g} to"
            f" {high:.3g} g, the new one for {lowest:.3g} to {highest:.3g} g; calibrate at common"
            " angles"
        )
    return np.linspace(first, last, _POINTS)


def indication(
    own: Side,
    told: Mapping[Name, Coefficient],
    a_i: Array,
    temperature: float | None,
    gravity: float,
) -> Indication:
    """Output by a calibration, with its static effects.

    What it does not determine at the temperature [degC], by default its own, counts as 0.
    Accelerations, shape (n,), are in the local g of the coefficients; `gravity` is that of the
    calibration over it.
    """
    k0, K1, k2, k3 = (told.get((name, None), _UNTOLD) for name in ("k0", "K1", "k2", "k3"))
    added, by_effect, dof = _by_effects(own, a_i / gravity, temperature)
    bracket = k0.value + a_i + k2.value * a_i**2 + k3.value * a_i**3 + gravity * added
    by_bracket = k0.by_error + np.multiply.outer(a_i**2, k2.by_error)
    by_bracket = by_bracket + np.multiply.outer(a_i**3, k3.by_error)
    scale = K1.value * gravity
    return Indication(
        K1.value * bracket,
        np.multiply.outer(bracket, K1.by_error) + K1.value * by_bracket,
        scale * by_effect,
        dof,
    )


def _by_effects(own: Side, a_i: Array, temperature: float | None) -> tuple[Array, Array, Array]:
    """What static effects add to the indication [g], its changes by their errors, and the dof."""
    found = compensation(own.calibration) if own.effects else own.found
    if found.effects is None:
        return np.zeros_like(a_i), np.zeros((a_i.size, 0)), np.zeros(0)
    reference = found.T0_degC
    unknown = temperature is None or reference is None
    rise = np.full_like(a_i, 0.0 if unknown else float(temperature or 0) - float(reference or 0))
    samples = found.samples(rise, [np.zeros_like(a_i) for _ in found.axes])
    changes, dof = zip(*found.effects.changes(samples, a_i), strict=True)
    return found.effects.total(samples, a_i), np.column_stack(changes), np.array(dof)
