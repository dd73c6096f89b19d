"""The points at which an error is asked for, and whether the calibration can answer there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arguments.numbers import check_side_by_side, number_array
from accelcal.arguments.temperatures import refuse_other_temperatures
from accelcal.arrays import Array, Mask
from accelcal.compensate.ranges import refuse_metres
from accelcal.error_budget.coefficients import Coefficients
from accelcal.errors import InputError
from accelcal.estimate.launch import SAME_LEVEL
from accelcal.geometry import Acceleration
from accelcal.model import CROSS_AXES


@dataclass(frozen=True, slots=True, eq=False)
class Conditions:
    """Acceleration, temperature and time of n points.

    Attributes
    ----------
    acceleration : Acceleration
        Along the three axes, shape (n,) each [local g].
    temperature : ndarray, shape (n,)
        Temperature; NaN where unknown [degC].
    rise : ndarray, shape (n,)
        T - T0; 0 where no temperature is known [degC].
    time : ndarray, shape (n,)
        Time since the start of the launch [s].
    extrapolated : ndarray of bool, shape (n,)
        Whether the temperature lies outside the calibrated ones.
    """

    acceleration: Acceleration
    temperature: Array
    rise: Array
    time: Array
    extrapolated: Mask


def conditions(
    coefficients: Coefficients,
    acceleration: tuple[ArrayLike, ArrayLike, ArrayLike],
    temperature: ArrayLike | None,
    time: ArrayLike,
    *,
    extrapolate: bool,
) -> Conditions:
    """Broadcast the points, and refuse those where (4) is not determined.

    Parameters
    ----------
    coefficients : Coefficients
        What was calibrated.
    acceleration : tuple of array_like
        a_i, a_p, a_o [local g].
    temperature : array_like or None
        Temperature; None is that of the coefficients [degC].
    time : array_like
        Time since the start of the launch [s].
    extrapolate : bool
        Allow temperatures outside the calibrated ones.

    Raises
    ------
    InputError
        As `accelcal.error_budget.budget.budget` tells.
    """
    reference = np.nan if coefficients.reference is None else coefficients.reference
    a_i, a_p, a_o, at, clock = _together(
        **dict(zip(("a_i", "a_p", "a_o"), acceleration, strict=True)),
        temperature=reference if temperature is None else temperature,
        time=time,
    )
    rise = np.zeros(at.size) if temperature is None else at - reference
    _check_finite(a_i=a_i, a_p=a_p, a_o=a_o, time=clock)
    refuse_metres(a_i=a_i, a_p=a_p, a_o=a_o)
    if (clock < 0.0).any():
        raise InputError(f"time {clock.min():g} s; it counts from the start of the launch, from 0")
    _check_axis("a_p", a_p, "o", coefficients)
    _check_axis("a_o", a_o, "p", coefficients)
    if temperature is not None:
        _check_temperature(coefficients, at, rise)
    outside = _outside(coefficients, at, extrapolate)
    return Conditions(Acceleration(a_i, a_p, a_o), at, rise, clock, outside)


def _together(**asked: ArrayLike) -> list[Array]:
    """Numbers of all kinds for each point."""
    check_side_by_side(**asked)
    given = {name: number_array(value, name) for name, value in asked.items()}
    try:
        points = np.broadcast_arrays(*given.values())
    except ValueError:
        sizes = ", ".join(f"{name} {array.shape}" for name, array in given.items() if array.ndim)
        raise InputError(f"shapes of {sizes} do not fit; give arrays that broadcast") from None
    if not points[0].size:
        raise InputError("no point is asked for; give one acceleration or more")
    return [array.flatten() for array in points]  # copies: the points stay what they are


def _check_finite(**arrays: Array) -> None:
    for name, array in arrays.items():
        if not np.isfinite(array).all():
            raise InputError(f"{name} has a value that is not finite; give finite numbers")


def _check_axis(name: str, values: Array, mounting: str, coefficients: Coefficients) -> None:
    misalignment = CROSS_AXES[mounting].misalignment
    if values.any() and misalignment not in coefficients.at_T0:
        raise InputError(
            f"{name} is {values[values != 0.0][0]:g} g, but no table in mounting {mounting} tells"
            f" {misalignment}; leave {name} at 0, or calibrate in mounting {mounting} as well"
        )


def _check_temperature(coefficients: Coefficients, at: Array, rise: Array) -> None:
    _check_finite(temperature=at)
    refuse_other_temperatures(at)
    if coefficients.reference is None:
        raise InputError(
            "the temperature of the calibration is unknown; leave the temperature out, or calibrate"
            " a table with temperatures"
        )
    law = coefficients.slopes.get("k0")
    for side, there in (("above", rise > SAME_LEVEL), ("below", rise < -SAME_LEVEL)):
        if there.any() and (law is None or getattr(law, side) is None):
            raise InputError(
                f"temperature {at[there][0]:g} degC: the calibration has no slopes {side} T0 ="
                f" {coefficients.reference:g} degC; calibrate at a level there as well"
            )


def _outside(coefficients: Coefficients, at: Array, extrapolate: bool) -> Mask:
    if coefficients.range is None:
        return np.zeros(at.size, dtype=np.bool_)
    low, high = coefficients.range
    outside = (at < low - SAME_LEVEL) | (at > high + SAME_LEVEL)
    if outside.any() and not extrapolate:
        raise InputError(
            f"temperature {at[outside][0]:g} degC lies outside the calibrated {low:g} to {high:g}"
            " degC; stay within, or accept it by extrapolate=True"
        )
    return np.asarray(outside)
