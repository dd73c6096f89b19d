"""Whether a unit wanders: what scatters is then not new at each calibration.

A drift has its interval from the scatter of the values about the line, taken as independent of each
other. A bias that walks off and comes back leaves neighbours alike, and a walk of a few years looks
like a drift.

References
----------
J. Durbin, G. S. Watson, "Testing for serial correlation in least squares regression", Biometrika 37
(1950) 409: the ratio, here against drawn values in place of its bounds.
"""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array

_FEWEST = 3
"""Residual degrees of freedom below which neighbours tell nothing."""

_DRAWS = 4000


def chance_of_neighbours(columns: Array, values: Array, sigma: Array) -> float:
    """Chance that independent errors leave neighbours as much alike as these.

    Parameters
    ----------
    columns : ndarray, shape (n, p)
        Columns of the line, by date.
    values, sigma : ndarray, shape (n,)
        Values with the standard deviations of their errors, up to a factor.

    Returns
    -------
    float
        One-sided, by values that are drawn; 1 where there are too few. The draws are the same each
        time.

    Examples
    --------
    >>> columns = np.ones((12, 1))
    >>> round(chance_of_neighbours(columns, np.sin(np.arange(12.0) / 2.0), np.ones(12)), 3)
    0.0
    >>> round(chance_of_neighbours(columns, np.cos(2.0 * np.arange(12.0)), np.ones(12)), 1)
    0.8
    """
    if values.size - columns.shape[1] < _FEWEST:
        return 1.0
    basis = np.linalg.qr(columns / sigma[:, None]).Q
    drawn = np.random.default_rng(0).standard_normal((_DRAWS, values.size))
    whole = np.concatenate([(values / sigma)[None], drawn])
    left = whole - (whole @ basis) @ basis.T
    ratio = (np.diff(left, axis=1) ** 2).sum(axis=1) / np.maximum((left**2).sum(axis=1), 1e-300)
    return float(np.mean(ratio[1:] <= ratio[0]))
