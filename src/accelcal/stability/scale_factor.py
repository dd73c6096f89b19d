"""The scale factor that a calibration gives for a stability record."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.errors import InputError
from accelcal.results.calibration import Calibration
from accelcal.results.table import nearest_table
from accelcal.stability.record import StabilityRecord
from accelcal.units import conversion_factor

_NEAR = 5.0
"""Farther from the record than so, the temperature of a table is told [degC]."""


class ScaleFactor(NamedTuple):
    """A scale factor for a record.

    Attributes
    ----------
    value : float
        K1 [output unit of the record / g].
    notes : tuple of str
        That it is of another temperature than the record, where it is so.
    """

    value: float
    notes: tuple[str, ...] = ()


def scale_factor_from(calibration: Calibration, record: StabilityRecord) -> ScaleFactor:
    """Scale factor that a calibration gives for a record.

    Parameters
    ----------
    calibration : Calibration
        Calibration of the same accelerometer.
    record : StabilityRecord
        The record; the mean of its known temperatures chooses the table that is closest, T0 where
        none is known.

    Returns
    -------
    ScaleFactor
        K1 of this table.

    Raises
    ------
    InputError
        If the calibration is of another serial number, or its output of another quantity.
    """
    ours, theirs = record.unit or "", calibration.output_unit or ""
    factor = conversion_factor(theirs, ours) if ours and theirs else 1.0
    if factor is None:
        raise _of_another("output unit", ours, theirs)
    if record.serial and calibration.serial and record.serial != calibration.serial:
        raise _of_another("serial", record.serial, calibration.serial)
    wanted = _temperature(record)
    table = nearest_table(calibration.tables, calibration.T0_degC if wanted is None else wanted)
    value = table.coefficients["K1"].value
    if not value:
        raise InputError("the calibration has no scale factor; fit it with K1")
    return ScaleFactor(float(value) * factor, _notes(table.temperature_degC, wanted))


def _temperature(record: StabilityRecord) -> float | None:
    """Mean over the launches of their known temperatures; None where there are none [degC]."""
    degrees = (own.temperature for own in record.launches if own.temperature is not None)
    known = [own[np.isfinite(own)] for own in degrees]
    means = [own.mean() for own in known if own.size]
    return float(np.mean(means)) if means else None


def _notes(calibrated: float | None, wanted: float | None) -> tuple[str, ...]:
    if calibrated is None:
        return ()
    told = f"the scale factor is that at {calibrated:.4g} degC"
    if wanted is None:
        return (f"{told}; the record has no temperature",)
    away = abs(calibrated - wanted)
    if away <= _NEAR:
        return ()
    return (
        f"{told}, the nearest that was calibrated, but {away:.3g} degC away from the {wanted:.4g}"
        " degC of the record; calibrate at its temperature, or give scale_factor=...",
    )


def _of_another(what: str, ours: str, theirs: str) -> InputError:
    problem = f"{what} {ours} in the record, but {theirs} in the calibration"
    return InputError(f"{problem}; give the calibration of this accelerometer")
