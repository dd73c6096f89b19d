"""Whether a unit wanders: what scatters is then not new at each calibration.

A drift has its interval from the scatter of the values about the line, taken as independent of each
other. A bias that walks off and comes back leaves neighbours alike, and a walk of a few years looks
like a drift. Few calibrations do not tell one from the other, so the drift has a second interval,
for the case that a quarter to all of what scatters is a random walk: the mean over such shares,
each weighted by its restricted likelihood (Hoeting 1999).

References
----------
Hoeting, J. A., et al. (1999), Statistical Science 14, 382-417: averages over models.
J. Durbin, G. S. Watson, "Testing for serial correlation in least squares regression", Biometrika 37
(1950) 409: the ratio, here against drawn values in place of its bounds.
"""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array
from accelcal.recalibrations.regression import ROUNDING, shares

_FEWEST = 3
"""Residual degrees of freedom below which neighbours tell nothing."""

_DRAWS = 4000

_OF_A_WALK = (0.25, 0.5, 0.75, 1.0)
"""Shares of the scatter about the line that a walk may make."""

_LEAST = 1e-6
"""Share of independent scatter that is left beside a walk: the first value has no other."""


def chance_of_neighbours(columns: Array, values: Array, sigma: Array) -> float:
    """Chance that independent errors leave neighbours as much alike as these, one-sided.

    The values, shape (n,), have errors with the standard deviations sigma, up to a factor, about a
    line of p columns by date, (n, p). The chance is by values that are drawn, the same each time;
    it is 1 where there are too few, or rounding alone is left of them.

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
    if (left[0] ** 2).sum() < ROUNDING:
        return 1.0
    ratio = (np.diff(left, axis=1) ** 2).sum(axis=1) / np.maximum((left**2).sum(axis=1), 1e-300)
    return float(np.mean(ratio[1:] <= ratio[0]))


def line_of_a_walk(
    time: Array, columns: Array, values: Array, variance: Array
) -> tuple[Array, Array]:
    """Fit values that walk: a part of what scatters stays, and adds up.

    Dates, rising [years], have values with the variances that their errors would have if these were
    independent, up to a factor, all of shape (n,); they depend on p columns, (n, p), with n > p.
    The coefficients come with their standard uncertainties by n - p degrees of freedom.

    Examples
    --------
    >>> time = np.arange(10.0)
    >>> columns = np.stack([np.ones(10), time], axis=1)
    >>> values = np.array([0.0, 1.0, 3.0, 3.0, 2.0, 4.0, 6.0, 7.0, 7.0, 9.0])
    >>> line, uncertainty = line_of_a_walk(time, columns, values, np.ones(10))
    >>> float(line[1].round(2)), float(uncertainty[1].round(2))
    (0.97, 0.29)
    """
    basis, since = np.linalg.qr(columns).Q, time - time[0]
    alone, walk = np.diag(variance), np.minimum.outer(since, since)
    walk = walk * (_about_the_line(alone, basis) / _about_the_line(walk, basis))
    alone = alone * (1.0 - np.array(_OF_A_WALK) + _LEAST)[:, None, None]
    whole = alone + np.array(_OF_A_WALK)[:, None, None] * walk
    root = np.linalg.inv(np.linalg.cholesky(whole))
    seen, told = root @ columns, root @ values
    inverse = np.linalg.inv(seen.mT @ seen)
    found = (inverse @ (seen.mT @ told[..., None]))[..., 0]
    squares = ((told - (seen @ found[..., None])[..., 0]) ** 2).sum(axis=1)
    dof = values.size - columns.shape[1]
    size = np.linalg.slogdet(root)[1] + 0.5 * np.linalg.slogdet(inverse)[1]
    chances = shares(size - 0.5 * dof * np.log(np.maximum(squares, 1e-300)))
    mean = chances @ found
    within = (squares / dof)[:, None] * np.diagonal(inverse, axis1=1, axis2=2)
    return mean, np.sqrt(chances @ (within + (found - mean) ** 2))


def _about_the_line(covariance: Array, basis: Array) -> float:
    """Expected sum of squares that errors leave about a line."""
    return float(np.trace(covariance) - np.trace(basis.T @ covariance @ basis))
