"""Whether a record suits a calibration: unit, size and temperatures of its readings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from accelcal.arguments.kinds import expect
from accelcal.compensate.coefficients import Compensation
from accelcal.compensate.ranges import outside_temperatures, within_temperatures
from accelcal.discovery.as_searched import refuse_several_clampings
from accelcal.errors import InputError
from accelcal.estimate.at_positions import at_positions
from accelcal.numerics.grouping import grouped
from accelcal.record import TumbleRecord
from accelcal.units import conversion_factor

_LARGEST = 1e6
"""Reading of a tumble test above which it is none [g]."""


def suited(found: Compensation, record: TumbleRecord) -> TumbleRecord:
    """Give a record at its positions, in the unit of the calibration that it is compared with.

    Where one of both names no unit, the readings are taken as they are.

    Raises
    ------
    InputError
        If it is no record, in a unit of another quantity, of several clampings, far off any reading
        in g, or outside the calibrated temperatures, or without temperatures where the calibration
        depends on them.
    """
    expect(record, TumbleRecord)
    refuse_several_clampings(record)
    converted = record if found.output_unit is None else _in_unit(record, found.output_unit)
    _refuse_far_off(found, converted)
    _refuse_other_temperatures(found, converted)
    return at_positions(converted)


def _in_unit(record: TumbleRecord, unit: str) -> TumbleRecord:
    """Readings, their deviations and their resolution in another unit of the same quantity."""
    factor = 1.0 if record.unit is None else conversion_factor(record.unit, unit)
    if factor is None:
        raise InputError(
            f"{record.source}: readings in {record.unit}, but the calibration is in {unit}; give"
            " readings in its unit"
        )
    step = record.apparatus.resolution
    return replace(
        record.with_apparatus(resolution=None if step is None else step * factor),
        output=record.output * factor,
        std=None if record.std is None else record.std * factor,
        unit=unit,
    )


def _refuse_far_off(found: Compensation, record: TumbleRecord) -> None:
    largest = float(np.abs(record.output).max() / abs(found.K1.at_T0))
    if largest > _LARGEST:
        raise InputError(
            f"{record.source}: readings of up to {largest:.3g} g by this calibration; give readings"
            " of its accelerometer, in the unit of the calibration"
        )


def _refuse_other_temperatures(found: Compensation, record: TumbleRecord) -> None:
    if found.temperatures is None:
        return
    is_known = np.isfinite(record.temperature)
    known, run = record.temperature[is_known], record.run[is_known]
    if found.several_levels and known.size < len(record):
        raise InputError(
            f"{record.source}: {len(record) - known.size} readings without temperature, on which"
            " the calibration depends; give their temperature"
        )
    of_runs = grouped(run)  # the temperatures of the calibration are means of runs, too
    levels = np.bincount(of_runs[1], weights=known) / of_runs[2]
    outside = levels[~within_temperatures(found.temperatures, levels)]
    if outside.size:
        problem = outside_temperatures(found.temperatures, float(outside[0]))
        raise InputError(
            f"{record.source}: {problem}; compare there, or calibrate at this temperature"
        )
