"""Sizes of effects that both calibrations carry, as they differ."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator

import numpy as np

from accelcal.compensate.propagation import Part, interval_of_parts
from accelcal.discovery.two_calibrations.coefficients import power_of_g
from accelcal.discovery.two_calibrations.errors import Side
from accelcal.estimate.uncertainty import quantities
from accelcal.results.calibration_comparison import CoefficientChange
from accelcal.results.findings import FoundEffect
from accelcal.results.quantity import Quantity


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
