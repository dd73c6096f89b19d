"""What is declared of the stand and the place of a test."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from numbers import Real
from types import MappingProxyType

import numpy as np

from accelcal.arguments.numbers import check_number
from accelcal.errors import InputError

__all__ = ["Apparatus"]

SOURCE_UNITS: Mapping[str, str] = MappingProxyType(
    {"head": "rad", "launch": "g", "launch_sf": "1", "temperature": "degC"}
)
"""Source of error whose uncertainty may be declared -> unit of it."""

UNITS: Mapping[str, str] = MappingProxyType(
    {
        "local_gravity": "m/s^2",
        "head_uncertainty": "rad",
        "launch_uncertainty": "g",
        "launch_sf_uncertainty": "of K1",
        "temperature_uncertainty": "degC",
    }
)
"""What is declared -> unit of it; the resolution is in that of the output."""

GRAVITY_OF_EARTH = 9.76, 9.84
"""Lowest and highest gravity of places on Earth [m/s^2]."""

_LARGEST = {
    "head_uncertainty": (0.1, "rad; a unit may follow, as 2 arcsec"),
    "launch_uncertainty": (1.0, "g; a unit may follow, as 20 ug"),
    "launch_sf_uncertainty": (0.1, "as a part of one; a unit may follow, as 15 ppm"),
    "temperature_uncertainty": (100.0, "degC"),
    "resolution": (1e20, "in the output unit"),
}


@dataclass(frozen=True, slots=True)
class Apparatus:
    """What is declared of the stand and the place; None means not declared.

    Attributes
    ----------
    local_gravity : float or None
        Local gravity [m/s^2].
    head_uncertainty : float or None
        Standard uncertainty of one head position, as an angle [rad], which is the acceleration in
        g at the position where it acts most.
    launch_uncertainty : float or None
        Standard uncertainty of the bias from run to run [g].
    launch_sf_uncertainty : float or None
        Relative standard uncertainty of the scale factor from run to run [1].
    temperature_uncertainty : float or None
        Standard uncertainty of a temperature [degC].
    resolution : float or None
        Step of the output [output unit].

    Raises
    ------
    InputError
        If a value is negative or not finite, or the gravity is not that of a place on Earth.

    Examples
    --------
    >>> import accelcal
    >>> accelcal.Apparatus(local_gravity=9.8106, head_uncertainty=6.7e-6).head_uncertainty
    6.7e-06
    """

    local_gravity: float | None = None
    head_uncertainty: float | None = None
    launch_uncertainty: float | None = None
    launch_sf_uncertainty: float | None = None
    temperature_uncertainty: float | None = None
    resolution: float | None = None

    def __post_init__(self) -> None:
        for item in fields(self):
            given = getattr(self, item.name)
            if given is not None and (not isinstance(given, Real) or isinstance(given, bool)):
                check_number(**{item.name: given})
            value = None if item.name == "local_gravity" else given
            if value is not None and not 0 <= value < np.inf:
                raise InputError(f"{item.name} is {value}; it is a finite number, zero or more")
            largest, unit = _LARGEST.get(item.name, (np.inf, ""))
            if value is not None and value >= largest:
                raise InputError(f"{item.name} is {value}; it is below {largest:g} {unit}")
        require_gravity_of_earth(self.local_gravity)


def require_gravity_of_earth(value: float | None) -> None:
    """Demand a local gravity that a place on Earth may have, if one is given [m/s^2]."""
    low, high = GRAVITY_OF_EARTH
    if value is not None and not low <= value <= high:
        raise InputError(
            f"local gravity {value} m/s^2 is found nowhere on Earth; it lies between {low} and"
            f" {high}, in m/s^2"
        )
