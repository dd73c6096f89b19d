"""Noise of a new record: from its replicates, else as the calibration had it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.compensate.coefficients import Compensation
from accelcal.discovery.columns import saturated
from accelcal.discovery.new_record.repeatability import (
    KnownNoise,
    rounded,
    taken_from_calibration,
)
from accelcal.discovery.new_record.simulated import Simulated
from accelcal.discovery.noise.declared import relative_noise
from accelcal.discovery.noise.of_readings import ReadingNoise, reading_noise
from accelcal.errors import InputError
from accelcal.numerics.decimal_steps import decimal_step
from accelcal.record import TumbleRecord
from accelcal.results.calibration import Calibration

_COARSE = 2.5
"""Step of the readings over their noise above which their replicates do not tell it."""


class RecordNoise(NamedTuple):
    """Noise of the readings, its degrees of freedom, and what it is from if not from replicates."""

    reading: ReadingNoise
    dof: float
    source: str = "calibration"
    said: str = ""


def record_noise(
    calibration: Calibration,
    known: KnownNoise | None,
    record: TumbleRecord,
    simulated: Simulated,
    step: float,
) -> RecordNoise:
    """Noise of the readings from replicates, else as the calibration had it.

    Of readings that are rounded by far more, replicates are alike at most positions and a step
    apart at some. Their scatter tells of none of these, and the error of rounding is known.
    """
    c = simulated.conditions
    try:
        within = saturated(c, record.mounting)
        noise = reading_noise(c, simulated.residual, within, step, relative_noise(record))
        found = RecordNoise(noise, float(noise.dof))
    except InputError:
        if known is None:
            raise
        noise = ReadingNoise(known.sigma, 0.0, 0, np.inf)
        found = RecordNoise(noise, known.dof, said=taken_from_calibration(calibration, noise))
    if step <= _COARSE * noise.sigma:
        return found
    whole = float(np.hypot(noise.sigma, step / np.sqrt(12.0)))
    return RecordNoise(ReadingNoise(whole, 0.0, 0, np.inf), np.inf, "rounding", rounded(step))


def step_of(found: Compensation, record: TumbleRecord) -> float:
    """Step of the readings, as declared or as their digits show it [g]."""
    step = max(record.apparatus.resolution or 0.0, decimal_step(record.output))
    return step / abs(found.K1.at_T0)
