"""What one table of a calibration gives to a compensation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

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
from accelcal.compensate.covariance import errors_of_table
from accelcal.errors import InputError
from accelcal.estimate.linear import METHODS, LinearEstimator, linear_estimator
from accelcal.estimate.tables import prepare
from accelcal.geometry import accelerations
from accelcal.model import COEFFICIENTS, CROSS_AXES, ERROR_TERMS
from accelcal.record import TumbleRecord
from accelcal.results.calibration import Calibration
from accelcal.results.covariance import rows_of
from accelcal.results.table import TableCalibration
from accelcal.results.usable import undetermined


def by_table(calibration: Calibration, table: TableCalibration) -> Compensation:
    """What one table tells, at its own temperature: coefficients without slopes."""
    values, level = values_of(calibration, table), table.temperature_degC
    return Compensation(
        k0=Law(values["k0"]),
        K1=Law(values["K1"]),
        k2=values["k2"],
        k3=values["k3"],
        cross=CrossAxis(cross_name(table.mounting), Law(values["delta"]), values["delta_ip"]),
        **errors_of_table(calibration, table)._asdict(),
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
        covariance=rows_of(np.array(other.covariance)[np.ix_(own, own)]),
        over_dof=rows_of(np.array(other.over_dof)[np.ix_(own, own)]),
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
