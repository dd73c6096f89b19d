"""A run in another unit, over another resistor, or of another accelerometer.

Temperature laws, or free shifts of the scale factor, take it up, so that no residual shows it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from accelcal.discovery.faults.fault import order_fault
from accelcal.geometry import accelerations
from accelcal.record import TumbleRecord
from accelcal.results.findings import Fault

_OF_ANOTHER_SIZE = 0.2
"""Part by which a run's scale factor must differ to be that of another unit or accelerometer."""


def run_of_another_size(
    record: TumbleRecord, delta0: float
) -> tuple[tuple[Fault, ...], TumbleRecord]:
    """Find the run whose scale factor is least that of the others, and bring it to their size.

    There is a fault where it is further off than any temperature brings it, with a fixture angle
    [rad]. The outputs of that run are taken over a power of ten, where that is what the others
    differ by, else over the ratio of the scale factors.
    """
    size = _scale_factors(record, delta0)
    usual = sorted(size.values())[(len(size) - 1) // 2] if len(size) > 1 else np.nan
    ratio = {run: abs(own / usual) for run, own in size.items()} if usual else {}
    odd = max(ratio, key=lambda run: abs(np.log(ratio[run])), default=-1)
    if odd < 0 or not abs(ratio[odd] - 1.0) > _OF_ANOTHER_SIZE:
        return (), record
    factor = 10.0 ** round(np.log10(ratio[odd]))
    factor = factor if abs(ratio[odd] / factor - 1.0) < _OF_ANOTHER_SIZE else ratio[odd]
    readings = record.run == odd
    finding = (
        f"K1 of run {record.run_labels[odd]} is {ratio[odd]:.3g} times that of the others: another"
        f" unit, resistor or accelerometer; taken over {factor:.3g}, mend that first"
    )
    mended = replace(record, output=np.where(readings, record.output / factor, record.output))
    where = np.flatnonzero(readings).tolist()
    return (order_fault("run of another size", finding, {}, 0.0, where),), mended


def _scale_factors(record: TumbleRecord, delta0: float) -> dict[int, float]:
    """Scale factor of each run that tells it [output unit / g]."""
    sensed = accelerations(record.angle, delta0, record.mounting)
    cross = sensed.cross
    design = np.stack([np.ones(len(record)), sensed.input, cross], axis=1)
    found = {}
    for run in np.unique(record.run).tolist():
        own = record.run == run
        fitted, _, rank, _ = np.linalg.lstsq(design[own], record.output[own], rcond=1e-9)
        if rank == design.shape[1]:
            found[run] = float(fitted[1])
    return found
