"""Noise of the readings as the columns std and n tell it: its ratios, not its size."""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array
from accelcal.estimate.declared_scatter import declared_scatter
from accelcal.record import TumbleRecord

_ALIKE = 1e-9


def relative_noise(record: TumbleRecord) -> Array | None:
    """Standard deviation of each reading by its std and n, over the root mean square of all.

    It is None where not all readings have a std, or all are alike. Those of few samples are drawn
    together where they differ by chance, see `accelcal.estimate.declared_scatter`.
    """
    if record.std is None:
        return None
    size = np.empty(len(record))
    for mask in record.table_masks():
        found = declared_scatter(record.select(mask))
        if found.dof is None:
            return None
        size[mask] = found.size
    relative = size / np.sqrt(np.mean(size**2))
    return relative if np.ptp(relative) > _ALIKE else None


def in_units_of(relative: Array | None, values: Array) -> Array:
    """Values of readings, shape (n,) or (n, k), over the noise of each; as they are without it."""
    if relative is None:
        return values
    return np.asarray(values / (relative if values.ndim == 1 else relative[:, None]))
