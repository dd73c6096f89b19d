"""Quantities that the errors of a stand have, and their units."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from accelcal.errors import InputError
from accelcal.specification import UNITS

_ANGLES = UNITS["angle"]


class ErrorQuantity(NamedTuple):
    """What the size of an error is.

    Attributes
    ----------
    name : str
        What it is called, with its article.
    unit : str
        Unit in which it is calculated.
    largest : float
        Standard uncertainty in this unit that no instrument reaches.
    sizes : mapping of str to float
        Units in which it may be written, with their sizes in `unit`.
    """

    name: str
    unit: str
    largest: float
    sizes: Mapping[str, float]


ERROR_QUANTITIES: Mapping[str, ErrorQuantity] = MappingProxyType(
    {
        # an angle error acts on a horizontal input axis as so many g: 1 rad is 1 g
        "angle": ErrorQuantity("an angle", "rad", 0.1, {**_ANGLES, **UNITS["acceleration"]}),
        "angle/day": ErrorQuantity(
            "an angle in time",
            "rad/day",
            0.1,
            {f"{unit}/day": size for unit, size in _ANGLES.items()}
            | {f"{unit}/h": 24.0 * size for unit, size in _ANGLES.items()},
        ),
        "acceleration": ErrorQuantity("an acceleration", "g", 1.0, UNITS["acceleration"]),
        "ratio": ErrorQuantity("a ratio", "1", 0.5, UNITS["ratio"]),
        "temperature": ErrorQuantity("a temperature", "degC", 100.0, UNITS["temperature"]),
        "voltage": ErrorQuantity(
            "a voltage", "V", 1000.0, {"V": 1.0, "mV": 1e-3, "uV": 1e-6, "nV": 1e-9}
        ),
    }
)
"""Quantity of a `accelcal.stand_uncertainty.kinds.Kind` -> what there is to know of it."""


def size_of_unit(unit: str, quantity: str) -> float:
    """Size of a unit.

    Parameters
    ----------
    unit : str
        The unit as written.
    quantity : str
        What it is a unit of, of `ERROR_QUANTITIES`.

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
    name, _, _, sizes = ERROR_QUANTITIES[quantity]
    if unit not in sizes:
        raise InputError(f"unit {unit!r} is none of {name}; use {', '.join(sizes)}")
    return sizes[unit]
