"""The estimators of stacks, asked for one record."""

import numpy as np

from accelcal.estimate.joint import estimate_stack
from accelcal.estimate.noise import noise_of_stack


def estimate_of_record(tables, apparatus, **options):
    """Estimate the coefficients of all prepared tables of one record."""
    outputs = [table.record.output[None] for table in tables]
    levels = np.array([[table.record.mean_temperature for table in tables]])
    return estimate_stack(tables, outputs, levels, apparatus, **options).of_records(0)


def noises_of_record(tables):
    """Reading noise of each prepared table of one record."""
    outputs = [table.record.output[None] for table in tables]
    return [noise.of_records(0) for noise in noise_of_stack(tables, outputs)]
