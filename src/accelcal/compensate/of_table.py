"""What one table of a calibration gives to a compensation, or laws do, with its covariance."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from accelcal.arrays import Array
from accelcal.compensate.coefficients import (
    OF_ONE_AXIS,
    PARAMETERS,
    SLOPES,
    Compensation,
    CrossAxis,
    Law,
    OtherAxis,
    symbol_of,
)
from accelcal.errors import InputError
from accelcal.estimate.tables import METHODS, LinearEstimator, linear_estimator, prepare
from accelcal.geometry import accelerations
from accelcal.model import COEFFICIENTS, CROSS_AXES, ERROR_TERMS, LAWS
from accelcal.record import TumbleRecord
from accelcal.results.calibration import Calibration
from accelcal.results.covariance import rows_of
from accelcal.results.quantity import Quantity
from accelcal.results.table import TableCalibration, quotients_by_coefficients
from accelcal.results.temperature import TemperatureModel
from accelcal.results.usable import undetermined

_IN_MODEL = {name: f"{name} at_T0" for name in LAWS} | {
    name: name.replace("_slope_", " ") for name in SLOPES
}
"""Error of the compensation -> its name in the covariance of the temperature laws."""


def errors_of_table(calibration: Calibration, table: TableCalibration) -> Array:
    """Errors of `PARAMETERS` from those of K0 .. M_ip, by the quotients of (6), shape (2, 12, 12).

    They are the covariance, NaN where unknown, and with each source over its degrees of freedom,
    0 where unknown. A misalignment that is free of the fixture angle has its own uncertainty and
    the correlations of the table. `SLOPES`, which are not in it, have no errors.
    """
    found = np.zeros((2, *2 * (len(PARAMETERS) + len(SLOPES),)))
    of_parameters = found[:, : len(PARAMETERS), : len(PARAMETERS)]
    of_parameters[0] = np.nan
    if table.covariance_names:
        jacobian = by_quotients(calibration, table)
        of_parameters[:] = jacobian @ np.stack([table.covariance, table.over_dof]) @ jacobian.T
    return found


def by_quotients(calibration: Calibration, table: TableCalibration) -> Array:
    """Derivatives of `PARAMETERS` by the p coefficients in the covariance of a table, shape (6, p).

    That of K1 is relative.
    """
    by_K1 = np.equal(table.covariance_names, "K1") / (table.coefficients["K1"].value or np.nan)
    rows = {**quotients_by_coefficients(table), "K1": by_K1}
    jacobian = np.stack([rows[name] for name in PARAMETERS])
    own, free = table.error_model["delta"], calibration.misalignment(table)
    if own.standard_uncertainty and free is not own:
        jacobian[PARAMETERS.index("delta")] *= standard_uncertainty(free) / own.standard_uncertainty
    return jacobian


def errors_of_laws(
    model: TemperatureModel, laws: Mapping[str, Law], common: Mapping[str, Quantity]
) -> Array:
    """Errors of `PARAMETERS` and `SLOPES` from those of the laws of k0, K1 and delta, (2, 12, 12).

    k2, k3 and delta_ip, `common` to all temperatures, have no law. What is not in the covariance of
    the model is uncorrelated.
    """
    names, scale_factor = (*PARAMETERS, *SLOPES), laws["K1"].at_T0
    variance, dof = _each_alone(model, laws, common)
    errors = np.stack([np.diag(variance), np.diag(np.nan_to_num(variance / dof))])
    places = {_IN_MODEL.get(name, name): place for place, name in enumerate(names)}
    known = [i for i, name in enumerate(model.covariance_names) if name in places]
    own = [places[model.covariance_names[i]] for i in known]
    relative = np.array([1.0 / scale_factor if names[i] == "K1" else 1.0 for i in own])
    for whole, told in zip(errors, (model.covariance, model.over_dof), strict=True):
        whole[np.ix_(own, own)] = told[np.ix_(known, known)] * np.outer(relative, relative)
    return errors


def _each_alone(
    model: TemperatureModel, laws: Mapping[str, Law], common: Mapping[str, Quantity]
) -> tuple[Array, Array]:
    """Variance of each of `PARAMETERS` and `SLOPES`, and its degrees of freedom."""
    quantities: dict[str, Quantity | None] = dict(common)
    sigma = {n: standard_uncertainty(q) if q.value is not None else 0.0 for n, q in common.items()}
    for name, law in laws.items():
        of_model, unit = getattr(model, name), abs(law.at_T0) if name == "K1" else 1.0
        quantities[name] = of_model.at_T0
        sigma[name] = standard_uncertainty(of_model.at_T0) / unit
        for side in ("above", "below"):
            quantities[f"{name}_slope_{side}"] = getattr(of_model, side)
            sigma[f"{name}_slope_{side}"] = getattr(law, side).standard_uncertainty
    names = (*PARAMETERS, *SLOPES)
    dof = [(q and q.dof) or math.inf for q in map(quantities.get, names)]
    return np.array([sigma[name] for name in names]) ** 2, np.array(dof)


def standard_uncertainty(quantity: Quantity) -> float:
    """Standard uncertainty of a quantity, NaN where unknown."""
    known = quantity.standard_uncertainty
    return np.nan if known is None else known


def by_table(calibration: Calibration, table: TableCalibration) -> Compensation:
    """What one table tells, at its own temperature: coefficients without slopes."""
    values, level = values_of(calibration, table), table.temperature_degC
    return Compensation(
        k0=Law(values["k0"]),
        K1=Law(values["K1"]),
        k2=values["k2"],
        k3=values["k3"],
        cross=CrossAxis(cross_name(table.mounting), Law(values["delta"]), values["delta_ip"]),
        errors=tuple(map(rows_of, errors_of_table(calibration, table))),
        T0_degC=level,
        temperatures=None if level is None else (level, level),
        **of_test(calibration, table),
    )


def of_test(calibration: Calibration, table: TableCalibration) -> dict[str, Any]:
    """What a compensation has of the test, whatever tells its coefficients."""
    return {
        "accelerations": _tested(table, calibration.delta0_rad),
        "output_unit": calibration.output_unit,
        "local_gravity": calibration.g_local_m_s2,
        "serial": calibration.serial,
    }


def with_other(found: Compensation, other: Compensation) -> Compensation:
    """Take the other cross axis up, and of its covariance what belongs to that axis alone."""
    names = (*PARAMETERS, *SLOPES)
    own = [names.index(name) for name in OF_ONE_AXIS]
    axis = OtherAxis(
        other.cross.name,
        other.cross.delta,
        other.cross.delta_ip,
        tuple(rows_of(np.array(part)[np.ix_(own, own)]) for part in other.errors),
    )
    return replace(found, other=axis)


def cross_name(mounting: str) -> str:
    """Tell the cross axis that is turned in a mounting, ``"a_p"`` or ``"a_o"``."""
    return CROSS_AXES[mounting[:1]].acceleration


def lost_symbols(groups: Sequence[Sequence[TableCalibration]]) -> tuple[str, ...]:
    """List the symbols of (2) that no table determines, such as ``"k3"`` and ``"delta_ip"``."""
    found = (
        symbol_of(ERROR_TERMS[name], cross_name(tables[0].mounting))
        for tables, lost in zip(groups, undetermined(groups), strict=True)
        for name in lost
    )
    return tuple(dict.fromkeys(found))


def meanings_of(table: TableCalibration) -> dict[str, str]:
    """Say what each coefficient that a table determined really estimates."""
    found = table.coefficients.items()
    return {name: table.meaning(name) for name, own in found if own.value is not None}


def values_of(calibration: Calibration, table: TableCalibration) -> dict[str, float]:
    """Tell `PARAMETERS` of a table, 0 where not determined.

    The misalignment is free of the fixture angle where that is known.

    Raises
    ------
    InputError
        If there is no scale factor.
    """
    scale_factor = table.coefficients["K1"].value
    if not scale_factor:
        raise InputError(f"run {table.run} has no scale factor K1; fit it with K1 among them")
    errors = {name: quantity.value or 0.0 for name, quantity in table.error_model.items()}
    delta = calibration.misalignment(table).value or 0.0
    return {**errors, "delta": delta, "K1": scale_factor}


def _tested(table: TableCalibration, delta0: float) -> tuple[float, float]:
    """Lowest and highest a_i of the positions [g]."""
    if not table.residuals.angle_deg:
        return (-1.0, 1.0)
    a_i = accelerations(table.residuals.angle_deg, delta0).input
    return float(a_i.min()), float(a_i.max())


def estimator_of(calibration: Calibration, table: TableCalibration) -> LinearEstimator:
    """The estimator that made a table, from the angles of its readings.

    Raises
    ------
    InputError
        If no fit can have made it.
    """
    angle = np.array(table.residuals.angle_deg)
    n = angle.size
    level = np.nan if table.temperature_degC is None else table.temperature_degC
    record = TumbleRecord(
        output=np.cos(np.deg2rad(angle)),  # what the readings were does not matter here
        angle=angle,
        temperature=np.full(n, level),
        stroke=np.array(table.residuals.stroke, dtype=np.int64),
        run=np.zeros(n, dtype=np.int64),
        run_labels=(table.run,),
        mounting=np.full(n, table.mounting),
        position=np.zeros(n, dtype=np.int64),
    )
    known = {name for name, q in table.coefficients.items() if q.value is not None}
    told = [name for name in COEFFICIENTS if name in known]
    asked = told if calibration.method == METHODS[0] else COEFFICIENTS
    prepared = prepare(record, delta0=calibration.delta0_rad, asked=asked)
    return linear_estimator(prepared, calibration.method, calibration.delta0_rad)
