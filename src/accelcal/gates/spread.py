"""How unlike the noise of the readings of a table is, by what they declare."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.estimate.tables import PreparedTable
from accelcal.numerics.sorting import median


class Spread(NamedTuple):
    """Standard deviations of the readings of a table against each other.

    Attributes
    ----------
    size : ndarray, shape (n,)
        Standard deviation of each over the median of all.
    doubt : ndarray, shape (n,)
        Variance of the logarithm of its square.
    """

    size: Array
    doubt: Array


def spread_of(table: PreparedTable) -> Spread | None:
    """Tell how unlike the noise of the readings is by the declared scatter.

    Parameters
    ----------
    table : PreparedTable
        The table.

    Returns
    -------
    Spread or None
        None where the noise of all readings is alike.
    """
    if np.ptp(table.scatter) == 0.0:
        return None
    return Spread(table.scatter / median(table.scatter), table.scatter_doubt)
