"""Coefficients at a temperature between the levels of a calibration."""

from __future__ import annotations

import math
import warnings

import numpy as np

from accelcal.arguments.numbers import check_number
from accelcal.arguments.options import check_flag
from accelcal.compensate.choice import compensation
from accelcal.compensate.coefficients import CALIBRATE_THERE, PARAMETERS, SLOPES, Compensation
from accelcal.compensate.propagation import interval_of_parts, propagated
from accelcal.errors import AccelcalWarning, InputError
from accelcal.results.calibration import Calibration
from accelcal.results.quantity import Quantity

__all__ = ["coefficients_at"]


def coefficients_at(
    calibration: Calibration,
    temperature: float,
    *,
    run: str | int | None = None,
    extrapolate: bool = False,
) -> dict[str, Quantity]:
    """Bias, scale factor and misalignment at a temperature, by the laws of a calibration.

    Parameters
    ----------
    calibration : Calibration
        The calibration.
    temperature : float
        Temperature [degC].
    run : str or int, optional
        Use the table of this run only.
    extrapolate : bool, default False
        Accept a temperature outside the calibrated range, with a warning.

    Returns
    -------
    dict of str to Quantity
        ``"k0"`` [g], ``"K1"`` [output unit / g] and ``"delta"`` [rad], of the mounting of the laws;
        without a value where the calibration does not determine it, and without an uncertainty
        outside the only level of a run, or of a calibration without laws.

    Raises
    ------
    InputError
        If the temperature is more than 1 degC outside the calibrated range, or the calibration is
        not usable, as where it has several runs of one level: choose one by `run`.

    Warns
    -----
    AccelcalWarning
        About every coefficient that was not determined, and what is assumed in its place.

    Notes
    -----
    With J the derivatives by the values at T0 and by the slopes of the side of the temperature, and
    C their covariance, the standard uncertainty is sqrt(J C J'). It is that of the laws: the shift
    to the next launch and the hysteresis, which `accelcal.apply` counts, are not in it.

    Examples
    --------
    >>> import accelcal
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> found = accelcal.coefficients_at(calibration, 35.0)
    >>> round(found["K1"].value, 3), found["K1"].unit
    (1.361, 'mA/g')
    """
    check_flag(extrapolate=extrapolate)
    check_number(temperature=temperature)
    found = compensation(calibration, run, same_launch=True, effects=False)
    for assumption in found.assumptions:
        warnings.warn(assumption, AccelcalWarning, stacklevel=2)
    if not found.within_temperatures(temperature):
        problem = found.outside_temperatures(temperature)
        if not extrapolate:
            raise InputError(f"{problem}; {CALIBRATE_THERE}")
        warnings.warn(problem, AccelcalWarning, stacklevel=2)
    rise = 0.0 if found.T0 is None else temperature - found.T0
    units = {"k0": "g", "K1": calibration.tables[0].coefficients["K1"].unit, "delta": "rad"}
    values = {name: _at(found, name, rise, unit) for name, unit in units.items()}
    by_laws = calibration.temperature_model is not None and run is None
    if not by_laws and not found.within_temperatures(temperature):
        return {name: Quantity(known.value, None, known.unit) for name, known in values.items()}
    return values


def _at(found: Compensation, name: str, rise: float, unit: str) -> Quantity:
    """One of them, from its law and the covariance of what the law is made of."""
    if {"delta": found.cross.delta_symbol}.get(name, name) in found.undetermined:
        return Quantity(None, None, unit)
    law = {"k0": found.k0, "K1": found.K1, "delta": found.cross.delta}[name]
    change = float(law.change(np.asarray(rise)))
    value = law.at_T0 * (1.0 + change) if name == "K1" else law.at_T0 + change
    scale = law.at_T0 if name == "K1" else 1.0  # the errors of K1 and its slopes are relative
    at_T0 = value if name == "K1" else 1.0
    names = (*PARAMETERS, *SLOPES)
    jacobian = np.zeros(len(names))
    jacobian[names.index(name)] = at_T0
    jacobian[names.index(f"{name}_slope_above")] = scale * max(rise, 0.0)
    jacobian[names.index(f"{name}_slope_below")] = scale * min(rise, 0.0)
    told = interval_of_parts([propagated(found.covariance, found.freedom, list(jacobian))])
    standard, expanded, dof = (float(each) for each in (told.standard, told.expanded, told.dof))
    if math.isnan(standard):
        return Quantity(value, None, unit)
    return Quantity(value, standard, unit, expanded, None if math.isinf(dof) else dof)
