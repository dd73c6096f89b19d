"""Temperatures and accelerations for which a calibration is good."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from accelcal.apparatus import GRAVITY_OF_EARTH
from accelcal.arrays import Array, Mask
from accelcal.errors import InputError

__all__ = [
    "ACCELERATION_MARGIN",
    "CALIBRATE_THERE",
    "MORE_THAN_TESTS",
    "TEMPERATURE_MARGIN",
    "WIDEST",
    "outside_temperatures",
    "refuse_metres",
    "within_accelerations",
    "within_temperatures",
]

Range = tuple[float, float]  # the lowest and the highest that were calibrated

TEMPERATURE_MARGIN = 1.0
"""A calibration is good this far outside the temperatures of its tables [degC]."""

CALIBRATE_THERE = "calibrate there, or accept it by extrapolate=True"
"""Remedy for a temperature outside the calibrated range."""

ACCELERATION_MARGIN = 0.01
"""A calibration is good this far outside the accelerations of its positions [g]."""

WIDEST = 2.0
"""Accelerations across beyond it were hardly meant in g [g]."""

MORE_THAN_TESTS = "more than any test on Earth"
"""What is said of them."""


def within_temperatures(calibrated: Range | None, temperature: ArrayLike) -> Mask:
    """Tell which temperatures lie in the calibrated range, `TEMPERATURE_MARGIN` included.

    Parameters
    ----------
    calibrated : tuple of float or None
        The range [degC]; all temperatures lie in one that is not known.
    temperature : array_like
        Temperatures [degC].

    Returns
    -------
    ndarray of bool
        True for each of them that does.

    Examples
    --------
    >>> within_temperatures((20.0, 80.0), [18.9, 19.1, 80.9]).tolist()
    [False, True, True]
    """
    if calibrated is None:
        return np.ones(np.shape(temperature), dtype=bool)
    return _within(calibrated, TEMPERATURE_MARGIN, temperature)


def outside_temperatures(calibrated: Range | None, temperature: float) -> str:
    """Say that a temperature is outside the calibrated range, which must be known.

    The remedy is `CALIBRATE_THERE`.

    Examples
    --------
    >>> outside_temperatures((20.0, 20.0), 60.0)
    'temperature 60 degC is more than 1 degC outside the calibration, which is for 20 degC only'
    """
    assert calibrated is not None
    low, high = calibrated
    levels = f"{low:g} to {high:g} degC" if low < high else f"{low:g} degC only"
    return (
        f"temperature {temperature:g} degC is more than {TEMPERATURE_MARGIN:g} degC outside the"
        f" calibration, which is for {levels}"
    )


def within_accelerations(tested: Range, acceleration: ArrayLike) -> Mask:
    """Tell which accelerations lie in the tested range, `ACCELERATION_MARGIN` included.

    Parameters
    ----------
    tested : tuple of float
        The range [g].
    acceleration : array_like
        Accelerations [g].

    Returns
    -------
    ndarray of bool
        True for each of them that does.
    """
    return _within(tested, ACCELERATION_MARGIN, acceleration)


def refuse_metres(**accelerations: Array) -> None:
    """Refuse accelerations that all are 0 or gravity in m/s^2, as they are to be in g.

    Examples
    --------
    >>> refuse_metres(a_p=np.array([0.0, -9.81]))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    accelcal.errors.InputError: a_p is -9.81 g, which looks like gravity in m/s^2; give it in ...
    """
    for name, values in accelerations.items():
        some = values[(values != 0.0) & ~np.isnan(values)]
        low, high = GRAVITY_OF_EARTH
        if some.size and ((low <= np.abs(some)) & (np.abs(some) <= high)).all():
            looks = "looks like gravity in m/s^2; give it in g, as"
            raise InputError(f"{name} is {some[0]:g} g, which {looks} {np.sign(some[0]):g}")


def _within(limits: Range, margin: float, values: ArrayLike) -> Mask:
    (low, high), given = limits, np.asarray(values, dtype=np.float64)
    return np.asarray((low - margin <= given) & (given <= high + margin))
