"""All gates of one table."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.noise import ReadingNoise
from accelcal.estimate.tables import PreparedTable
from accelcal.gates.drift import drift
from accelcal.gates.order import order_of_positions
from accelcal.gates.replicates import closure, forward_against_back, outlier
from accelcal.gates.resolution import resolution
from accelcal.gates.sizes import proportions, units
from accelcal.gates.verdict import SIGNIFICANT
from accelcal.model import COEFFICIENTS
from accelcal.results.quantity import Gate

__all__ = ["table_gates"]


def table_gates(
    table: PreparedTable,
    coefficients: NDArray[np.float64],
    noise: ReadingNoise,
    delta0: float = 0.0,
    tables: int = 1,
) -> tuple[Gate, ...]:
    """Check one table.

    Parameters
    ----------
    table : PreparedTable
        The table.
    coefficients : ndarray, shape (6,)
        Its least-squares coefficients, zero where not estimated [output unit / g^n].
    noise : ReadingNoise
        Its reading noise.
    delta0 : float, default 0
        Fixture angle of the fit [rad].
    tables : int, default 1
        Tables of the record, which share the false alarms of each gate.

    Returns
    -------
    tuple of Gate
        Closure, drift, forward against back, order of positions, outlier, proportions,
        resolution, units.
    """
    # a scale factor that a fault has ruined must not blow up the sizes told
    quarter = float(np.ptp(table.record.output)) / 4.0
    scale = max(abs(float(coefficients[COEFFICIENTS.index("K1")])), quarter)
    level = SIGNIFICANT / tables
    return (
        closure(table, noise, scale, level),
        drift(table, scale, level),
        forward_against_back(table, scale, level),
        order_of_positions(table, delta0),
        outlier(table, scale, level),
        proportions(table, coefficients),
        resolution(table, noise, scale),
        units(table),
    )
