"""The gap of readings with their faults, where they have some."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from accelcal.discovery.comparison import compared
from accelcal.discovery.gaps import gaps_with
from accelcal.discovery.noise import ReadingNoise
from accelcal.record import TumbleRecord
from accelcal.results.findings import Fault, Gap


def gap_as_given(
    record: TumbleRecord, reference: float, delta0: float, seed: int, noise: ReadingNoise
) -> Gap:
    """Gap of the readings with their faults, in the measure of the noise without them."""
    given = compared(record, reference, delta0, noise=noise)
    return gaps_with(given, [()], seed)[0]


def of_all_readings(noise: ReadingNoise, found: Sequence[Fault]) -> ReadingNoise:
    """Noise of readings and of the outliers that were set aside, which are as noisy as most."""
    if noise.relative is None:
        return noise
    outliers = np.sort([fault.readings[0] for fault in found if fault.id == "outlier"])
    places = outliers.astype(np.intp) - np.arange(outliers.size)  # among those that are kept
    return noise._replace(relative=np.insert(noise.relative, places, 1.0))
