"""Coefficients of a calibration at a temperature, by its errors, sizes of effects in both, outputs.

What is indicated is the output at an acceleration along the input axis, none across it.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.compensate.choice import compensation
from accelcal.compensate.coefficients import (
    OF_ONE_AXIS,
    PARAMETERS,
    SLOPES,
    Compensation,
    symbol_of,
)
from accelcal.compensate.propagation import Part, interval_of_parts
from accelcal.discovery.new_record.simulated import ERRORS
from accelcal.discovery.two_calibrations.errors import Side
from accelcal.errors import InputError
from accelcal.estimate.uncertainty import quantities
from accelcal.model import ERROR_TERMS, ERROR_UNITS
from accelcal.model import SLOPES as SLOPE_SYMBOLS
from accelcal.results.calibration_comparison import CoefficientChange
from accelcal.results.findings import FoundEffect
from accelcal.results.quantity import Quantity

Name = tuple[str, str | None]
"""Symbol of a coefficient, and the cross axis where it is of one."""

_MAIN = (*PARAMETERS, *SLOPES)
_OTHER = [ERRORS.index(f"other {name}") for name in OF_ONE_AXIS]


class Coefficient(NamedTuple):
    """A coefficient and its derivatives by `ERRORS`."""

    value: float  # its value
    by_error: Array  # the derivatives, (18,)
    unit: str  # unit of the value

    def times(self, factor: float) -> Coefficient:
        """The coefficient in another unit."""
        return self._replace(value=factor * self.value, by_error=factor * self.by_error)


def name_of(name: str, axis: str) -> Name:
    """Name of a coefficient, with the cross axis where it is of one."""
    return name, axis if parameter_of(name).startswith("delta") else None


def parameter_of(name: str) -> str:
    """The parameter that a slope belongs to; other coefficients belong to themselves."""
    return SLOPE_SYMBOLS.get(name, (name,))[0]


def told_coefficients(found: Compensation, temperature: float | None) -> dict[Name, Coefficient]:
    """List what a calibration determines of the error model, K1 and the slopes of the laws.

    K1 is that at a temperature [degC], None for T0.
    """
    return dict(_parameters(found, temperature)) | dict(_slopes(found))


def _parameters(
    found: Compensation, temperature: float | None
) -> Iterator[tuple[Name, Coefficient]]:
    unknown = temperature is None or found.T0_degC is None
    rise = 0.0 if unknown else float(temperature or 0.0) - float(found.T0_degC or 0.0)
    main = np.pad(found.derivatives(rise), [(0, 0), (0, len(ERRORS) - len(_MAIN))])
    of_axis = found.parameters(np.asarray(rise))
    units = {**ERROR_UNITS, "K1": f"{found.output_unit or 'output unit'}/g"}
    for place, (axis, values) in enumerate(zip(found.axes, of_axis, strict=True)):
        rows = main if place == 0 else _moved(main)
        for name, value, row in zip(PARAMETERS, values, rows, strict=True):
            named = name_of(name, axis.name)
            is_new = place == 0 or named[1] is not None
            if is_new and symbol_of(name, axis.name) not in found.undetermined:
                yield named, Coefficient(float(value), row, units[name])


def _moved(main: Array) -> Array:
    """Derivatives by the errors of the other cross axis, from those by the errors of the main."""
    own = np.zeros_like(main)
    own[:, _OTHER] = main[:, [_MAIN.index(name) for name in OF_ONE_AXIS]]
    return own


def _slopes(found: Compensation) -> Iterator[tuple[Name, Coefficient]]:
    identity = np.eye(len(ERRORS))
    for place, axis in enumerate(found.axes):
        laws = {"k0": found.k0, "K1": found.K1, "delta": axis.delta}
        for symbol, (law, side) in SLOPE_SYMBOLS.items():
            slope, name = getattr(laws[law], side), name_of(symbol, axis.name)
            if slope.determined and (place == 0 or name[1] is not None):
                error = f"{'other ' if place else ''}{law}_slope_{side}"
                unit = f"{ERROR_UNITS.get(law, '1')}/degC"
                yield name, Coefficient(slope.value, identity[ERRORS.index(error)], unit)


def power_of_g(unit: str) -> int:
    """Power of local g in a unit, and so of the ratio of two of them by which a value changes.

    Examples
    --------
    >>> [power_of_g(unit) for unit in ("g", "g/g^3", "g/g^2/degC", "rad", "mA/g")]
    [1, -2, -1, 0, -1]
    """
    numerator, *below = unit.split("/")
    powers = (int(part[2:] or 1) for part in below if part.partition("^")[0] == "g")
    return int(numerator == "g") - sum(powers)


def in_units_of(
    own: Mapping[Name, Coefficient], factor: float, gravity: float
) -> dict[Name, Coefficient]:
    """Give coefficients in another output unit and another local g.

    The factor is the other unit in one of the own ones, `gravity` the own local g over the other
    one.
    """
    told = {name: c.times(gravity ** power_of_g(c.unit)) for name, c in own.items()}
    if ("K1", None) in own:  # whose output may be one in g
        told["K1", None] = own["K1", None].times(factor / gravity)
    return told


def of_output(own: Mapping[Name, Coefficient], unit: str) -> dict[Name, Coefficient]:
    """Coefficients of (1) in the output unit: those of the error model (2) times K1.

    They are K0, K2, K3, M and M_ip, as far as they are determined.
    """
    scale = own["K1", None]
    return {
        (name, axis): Coefficient(
            scale.value * c.value,
            scale.value * c.by_error + c.value * scale.by_error,
            unit + ERROR_UNITS[error].removeprefix("g").replace("rad", "/g"),
        )
        for name, error in ERROR_TERMS.items()
        for (known, axis), c in own.items()
        if known == error
    }


def size_changes(old: Side, new: Side, gravity: float) -> Iterator[CoefficientChange]:
    """Compare the sizes of effects that both calibrations state with an uncertainty.

    The local g of the new one over that of the old one is `gravity`. There is one for each size
    that the readings of both tell. Two effects are one where they have one id, and agree in all
    that is stated without an uncertainty, such as the place of a position error. The errors of both
    sizes are independent.
    """
    known = {effect_key(item): item.parameters for item in new.measured_effects}
    for item in old.measured_effects:
        later = known.get(effect_key(item), {})
        for name in _sizes(item) if later else ():
            own, there = item.parameters[name], later[name]
            there = _times(there, gravity ** power_of_g(there.unit))
            yield CoefficientChange(name, None, own, there, _difference(own, there), item.id)


def effect_key(item: FoundEffect) -> Hashable:
    """What an effect is, whatever its size."""
    sizes = _sizes(item)
    fixed = ((name, own.value) for name, own in item.parameters.items() if name not in sizes)
    return (item.id, *sizes, *fixed)


def _sizes(item: FoundEffect) -> list[str]:
    """Parameters with an uncertainty."""
    return [name for name, own in item.parameters.items() if own.expanded_uncertainty]


def _times(own: Quantity, factor: float) -> Quantity:
    sizes = (own.value, own.standard_uncertainty, own.expanded_uncertainty)
    value, standard, expanded = (None if size is None else factor * size for size in sizes)
    return Quantity(value, standard, own.unit, expanded, own.dof)


def _difference(old: Quantity, new: Quantity) -> Quantity:
    """New less old, with the errors of both."""
    each = [
        Part(np.array([(own.standard_uncertainty or 0.0) ** 2]), own.dof or math.inf)
        for own in (old, new)
    ]
    told = interval_of_parts(each)
    value = np.array([(new.value or 0.0) - (old.value or 0.0)])
    return quantities([old.unit], value, told.standard, told.expanded, told.dof)[0]


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
