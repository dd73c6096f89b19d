"""Units of the errors of a stand."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from accelcal.errors import InputError
from accelcal.specification import UNITS

_ANGLES = UNITS["angle"]

SIZES: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {  # an angle error acts on a horizontal input axis as so many g: 1 rad is 1 g
        **UNITS,
        "angle": {**_ANGLES, **UNITS["acceleration"]},
        "angle/day": {f"{unit}/day": size for unit, size in _ANGLES.items()}
        | {f"{unit}/h": 24.0 * size for unit, size in _ANGLES.items()},
        "voltage": {"V": 1.0, "mV": 1e-3, "uV": 1e-6, "nV": 1e-9},
    }
)
"""Quantity -> unit -> its size in that of `BASE_UNITS`."""

LARGEST: Mapping[str, float] = MappingProxyType(
    {
        "angle": 0.1,
        "angle/day": 0.1,
        "acceleration": 1.0,
        "ratio": 0.5,
        "temperature": 100.0,
        "voltage": 1000.0,
    }
)
"""Quantity -> standard uncertainty that no instrument reaches, in the units of `BASE_UNITS`."""

BASE_UNITS: Mapping[str, str] = MappingProxyType(
    {
        "angle": "rad",
        "angle/day": "rad/day",
        "acceleration": "g",
        "ratio": "1",
        "temperature": "degC",
        "voltage": "V",
    }
)
"""Quantity -> unit in which it is calculated."""

_NAMES = {
    "angle": "an angle",
    "angle/day": "an angle in time",
    "acceleration": "an acceleration",
    "ratio": "a ratio",
    "temperature": "a temperature",
    "voltage": "a voltage",
}


def size_of_unit(unit: str, quantity: str) -> float:
    """Size of a unit.

    Parameters
    ----------
    unit : str
        The unit as written.
    quantity : str
        What it is a unit of, of `SIZES`.

    Returns
    -------
    float
        Its size.

    Raises
    ------
    InputError
        If it is none of the quantity.

    Examples
    --------
    >>> size_of_unit("ppm", "ratio")
    1e-06
    """
    units = SIZES[quantity]
    if unit not in units:
        raise InputError(f"unit {unit!r} is none of {_NAMES[quantity]}; use {', '.join(units)}")
    return units[unit]
