"""How unlike the noise of the readings of a table is, by what they declare."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.tables import PreparedTable
from accelcal.numerics.sorting import median

__all__ = ["Spread", "spread_of"]

Array = NDArray[np.float64]


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

    Notes
    -----
    A standard deviation of n samples scatters itself: of log s^2 by 2 / (n - 1), about. As far as
    those of a table scatter by no more, they are alike; the rest of their scatter is a share of the
    whole, by which each is taken to be off the mean (Bayes, with the scatter from the table).
    """
    scatter, std, count = table.scatter, table.record.std, table.record.count
    if np.ptp(scatter) == 0.0:
        return None
    if std is None or count is None or not np.isfinite(table.scatter_dof or np.inf):
        return Spread(scatter / median(scatter), np.zeros(scatter.size))
    own = np.log(std**2)
    chance = 2.0 / np.maximum(count - 1.0, 0.5)
    told = max(float(own.var(ddof=1) - chance.mean()), 0.0)
    size = np.exp(0.5 * told / (told + chance) * (own - own.mean())) / np.sqrt(count)
    return Spread(size / median(size), told * chance / (told + chance)) if np.ptp(size) else None
