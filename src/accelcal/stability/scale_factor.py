"""The scale factor that a calibration gives for a stability record."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.compensate.at_temperature import mean_of_runs
from accelcal.compensate.coefficients import Law
from accelcal.compensate.ranges import outside_temperatures, within_temperatures
from accelcal.errors import InputError
from accelcal.results.calibration import Calibration
from accelcal.results.table import known_temperatures
from accelcal.results.tables_in_use import tables_in_use
from accelcal.stability.record import StabilityRecord
from accelcal.units import conversion_factor

_NEAR = 5.0
"""Farther from the record than so, the temperature of a table is told [degC]."""

_REMEDY = "calibrate at its temperature, or give scale_factor=..."


class ScaleFactor(NamedTuple):
    """A scale factor for a record."""

    value: float  # K1 [output unit of the record / g]
    notes: tuple[str, ...] = ()  # that it is of another temperature than the record, where it is so


def scale_factor_from(calibration: Calibration, record: StabilityRecord) -> ScaleFactor:
    """Scale factor that a calibration of the same accelerometer gives for a record.

    It is K1 by its temperature law at the mean of the known temperatures of the record, at T0 where
    none is known; without a law the mean of the runs of the main mounting at one level, or else
    that of its nearest table.

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
    found = _by_law(calibration, wanted) or _of_table(calibration, wanted)
    if not found.value:
        raise InputError("the calibration has no scale factor; fit it with K1")
    return found._replace(value=found.value * factor)


def _by_law(calibration: Calibration, wanted: float | None) -> ScaleFactor | None:
    """Scale factor by its law; None where there is none."""
    model, used, T0 = calibration.temperature_model, tables_in_use(calibration), calibration.T0_degC
    if model is None or T0 is None or not used.by_laws:
        return None
    law = Law.of(model.K1, "K1")
    if wanted is None:
        return ScaleFactor(law.at_T0, _without_temperature(T0))
    value = law.at_T0 * (1.0 + float(law.change(np.asarray(wanted - T0))))
    levels = known_temperatures(used.of_main) or [T0]
    calibrated = min(levels), max(levels)
    if within_temperatures(calibrated, wanted):
        return ScaleFactor(value)
    beyond = outside_temperatures(calibrated, wanted)
    return ScaleFactor(value, (f"the scale factor is extrapolated: {beyond}; {_REMEDY}",))


def _of_table(calibration: Calibration, wanted: float | None) -> ScaleFactor:
    if mean := mean_of_runs(calibration):
        return ScaleFactor(mean.coefficients["K1"].value or 0.0, _notes(mean.temperature, wanted))
    table = tables_in_use(calibration, wanted).main
    value = table.coefficients["K1"].value or 0.0
    return ScaleFactor(value, _notes(table.temperature_degC, wanted))


def _temperature(record: StabilityRecord) -> float | None:
    """Mean over the launches of their known temperatures; None where there are none [degC]."""
    degrees = (own.temperature for own in record.launches if own.temperature is not None)
    known = [own[np.isfinite(own)] for own in degrees]
    means = [own.mean() for own in known if own.size]
    return float(np.mean(means)) if means else None


def _notes(calibrated: float | None, wanted: float | None) -> tuple[str, ...]:
    if calibrated is None:
        return ()
    if wanted is None:
        return _without_temperature(calibrated)
    away = abs(calibrated - wanted)
    if away <= _NEAR:
        return ()
    return (
        f"the scale factor is that at {calibrated:.4g} degC, the nearest that was calibrated, but"
        f" {away:.3g} degC away from the {wanted:.4g} degC of the record; {_REMEDY}",
    )


def _without_temperature(level: float) -> tuple[str, ...]:
    return (f"the scale factor is that at {level:.4g} degC; the record has no temperature",)


def _of_another(what: str, ours: str, theirs: str) -> InputError:
    problem = f"{what} {ours} in the record, but {theirs} in the calibration"
    return InputError(f"{problem}; give the calibration of this accelerometer")
