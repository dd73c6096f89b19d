"""Temperatures among the arguments: in degC, such as a test has."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arguments.numbers import check_number, number_array
from accelcal.arrays import Array, Mask
from accelcal.errors import InputError

LOWEST, HIGHEST = -200.0, 250.0
"""Temperatures of a test; below or above are those of another unit, and markers [degC]."""

_RANGE = f"from {LOWEST:g} to {HIGHEST:g} degC"

NO_TEMPERATURE = f"is no temperature of a test, {_RANGE}"
"""What messages say of a cell or option that is outside."""


def outside_tests(temperature: ArrayLike) -> Mask:
    """Tell what is hardly a temperature of a test in degC; one that is not known may be.

    Examples
    --------
    >>> outside_tests([20.0, 293.15, float("nan")]).tolist()
    [False, True, False]
    """
    values = np.asarray(temperature)
    return (values < LOWEST) | (values > HIGHEST)


def check_temperature(**values: float) -> None:
    """Refuse what is no temperature of a test.

    Parameters
    ----------
    **values : float
        The temperatures [degC], by the name that the message gives.

    Raises
    ------
    InputError
        If one is no finite number, or outside the temperatures of a test.

    Examples
    --------
    >>> check_temperature(reference_temperature=293.15)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    accelcal.errors.InputError: reference_temperature is 293.15; a temperature of a test is from ...
    """
    check_number(**values)
    for name, value in values.items():
        if outside_tests(value):
            raise InputError(f"{name} is {value}; a temperature of a test is {_RANGE}")


def refuse_other_temperatures(temperature: ArrayLike, owner: str = "") -> None:
    """Refuse temperatures of which one is none of a test; those that are not known may be.

    Examples
    --------
    >>> refuse_other_temperatures([20.0, 293.15], "launch 2: ")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    accelcal.errors.InputError: launch 2: temperature 293.15 is no temperature of a test, from ...
    """
    odd = np.asarray(temperature)[outside_tests(temperature)]
    if odd.size:
        raise InputError(f"{owner}temperature {odd[0]:g} {NO_TEMPERATURE}; give it in degC")


def temperature_array(temperature: ArrayLike) -> Array:
    """Take one temperature or an array of them; those that are not known may be NaN [degC].

    Raises
    ------
    InputError
        If one is no number, or none of a test.

    Examples
    --------
    >>> temperature_array([20, None]).tolist()
    [20.0, nan]
    """
    values = number_array(temperature, "temperature")
    refuse_other_temperatures(values)
    return values
