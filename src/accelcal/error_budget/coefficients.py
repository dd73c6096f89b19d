"""Coefficients of (4) from a calibration, and the points at which an error is asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arguments.numbers import check_side_by_side, number_array
from accelcal.arguments.temperatures import refuse_other_temperatures
from accelcal.arrays import Array, Mask
from accelcal.compensate.at_temperature import (
    CoefficientsAt,
    MeanOfRuns,
    means_of_runs,
)
from accelcal.compensate.choice import runs_in_use
from accelcal.compensate.ranges import refuse_metres
from accelcal.errors import InputError
from accelcal.estimate.launch import SAME_LEVEL
from accelcal.geometry import Acceleration
from accelcal.model import CROSS_AXES
from accelcal.results.calibration import Calibration
from accelcal.results.quantity import Quantity
from accelcal.results.table import TableCalibration, known_temperatures
from accelcal.results.tables_in_use import tables_in_use
from accelcal.results.temperature import TemperatureLaw, TemperatureModel


@dataclass(frozen=True, slots=True, eq=False)
class Coefficients:
    """Coefficients of (4).

    Attributes
    ----------
    at_T0 : mapping of str to Quantity
        k0 [g], K1 [output unit / g], k2, k3, and of the axes that were tested delta_O, delta_P
        [rad], delta_ip, delta_io [g/g^2].
    slopes : mapping of str to TemperatureLaw
        Slopes of k0 [g/degC], K1 [1/degC] and of delta_O, delta_P [rad/degC], the axis of the laws
        first.
    mounting : str
        The main mounting, which the laws or `alone` are of.
    alone : TableCalibration or CoefficientsAt
        What tells them at T0 without laws: the table nearest to it, or the mean of several runs.
    reference : float or None
        T0, or the temperature of the only level [degC].
    range : tuple of float, or None
        Lowest and highest temperature of the calibration [degC]; None where unknown.
    model, second : TemperatureModel or None
        The laws of `slopes` with their covariance, and those of the other axis.
    """

    at_T0: Mapping[str, Quantity]
    slopes: Mapping[str, TemperatureLaw]
    mounting: str
    alone: TableCalibration | CoefficientsAt
    reference: float | None
    range: tuple[float, float] | None
    model: TemperatureModel | None
    second: TemperatureModel | None = None

    @property
    def of_other_axis(self) -> tuple[str, ...]:
        """Symbols of the misalignment and the cross-coupling that the main table does not tell."""
        (own,) = (a for letter, a in CROSS_AXES.items() if letter != self.mounting[0])
        return own.misalignment, own.coupling

    def slope(self, name: str, rise: Array, part: str) -> Array:
        """Slope of a coefficient at each T - T0, or an uncertainty of it; 0 where there is none.

        Parameters
        ----------
        name : str
            Name in `slopes`.
        rise : ndarray
            T - T0 [degC].
        part : str
            ``"value"``, ``"standard_uncertainty"`` or ``"dof"``.

        Returns
        -------
        ndarray
            The slope above T0 for a positive rise, that below for a negative one.
        """
        law = self.slopes.get(name)
        above, below = (None, None) if law is None else (law.above, law.below)
        return np.where(rise > 0.0, _part(above, part), _part(below, part))


def _part(quantity: Quantity | None, part: str) -> float:
    value = getattr(quantity, part) if quantity is not None else None
    return (np.inf if part == "dof" else 0.0) if value is None else float(value)


def coefficients_of(calibration: Calibration) -> Coefficients:
    """Gather the coefficients of (4).

    Returns
    -------
    Coefficients
        k0, K1 and the misalignments from the temperature laws, where there are any; everything else
        from the tables of `accelcal.results.tables_in_use`, or without laws from the mean of the
        runs of each mounting at one level. Misalignments are free of the fixture angle, where both
        sides of the axis were measured.

    Raises
    ------
    InputError
        If the bias is not determined, or runs without laws have no mean.

    Examples
    --------
    >>> import accelcal
    >>> found = coefficients_of(accelcal.fit(accelcal.simulate(seed=1)))
    >>> sorted(found.at_T0), found.range
    (['K1', 'delta_O', 'delta_ip', 'k0', 'k2', 'k3'], (-40.0, 80.0))
    """
    used = tables_in_use(calibration)
    main, law_axis = used.main, used.main.mounting[0]
    found = {"k0": main.error_model["k0"], "K1": main.coefficients["K1"]}
    found |= {name: used.telling(name).error_model[name] for name in ("k2", "k3")}
    for table in used.nearest:
        axis, teller = (
            CROSS_AXES[table.mounting[0]],
            used.telling("delta_ip", second=table is not main),
        )
        found[axis.misalignment] = calibration.misalignment(table)
        found[axis.coupling] = teller.error_model["delta_ip"]
    means = {own.first.mounting: own for own in means_of_runs(calibration)}
    for mounting, own in means.items():
        found |= _of_mean(own, is_main=mounting == main.mounting)
    mean = means.get(main.mounting)
    model, delta = calibration.temperature_model, CROSS_AXES[law_axis].misalignment
    laws = {} if model is None else {"k0": model.k0, "K1": model.K1, delta: model.delta}
    second = calibration.second_axis_model
    if second is not None and model is not None and second.delta.at_T0 is not None:
        laws[CROSS_AXES["p" if law_axis == "o" else "o"].misalignment] = second.delta
    found |= {name: law.at_T0 for name, law in laws.items() if law.at_T0 is not None}
    if found["k0"].value is None:
        raise InputError("the calibration has no bias k0; fit a record that determines K0")
    if model is None:
        runs_in_use(calibration, calibration.tables)
    levels = known_temperatures(calibration.tables)
    return Coefficients(
        at_T0={name: q for name, q in found.items() if q.value is not None},
        slopes=laws,
        mounting=main.mounting,
        alone=main if mean is None else mean.coefficients,
        reference=_reference(calibration, main, mean),
        range=(min(levels), max(levels)) if levels else None,
        model=model,
        second=second,
    )


def _of_mean(mean: MeanOfRuns, *, is_main: bool) -> dict[str, Quantity]:
    """Coefficients of a mean of runs, in the second mounting those of its axis alone."""
    axis = CROSS_AXES[mean.first.mounting[0]]
    of_axis = {"delta": axis.misalignment, "delta_ip": axis.coupling}
    told = mean.coefficients.items()
    return {of_axis.get(name, name): q for name, q in told if is_main or name in of_axis}


def _reference(
    calibration: Calibration, main: TableCalibration, mean: MeanOfRuns | None
) -> float | None:
    """T0, or where there are no laws the temperature of what tells the coefficients [degC]."""
    if calibration.temperature_model is not None:
        return calibration.T0_degC
    return main.temperature_degC if mean is None else mean.temperature


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
