"""Weighted regression that knows a scatter beyond the stated uncertainties.

A value y_i of one calibration is a straight line in time, plus steps, plus two errors: one of the
stated standard uncertainty u_i, and one of a standard deviation tau that all share and nobody has
stated: from launch to launch, from stand to stand. tau is estimated by restricted maximum
likelihood. The covariance of the coefficients is that of Knapp and Hartung (2003), scaled by the
scatter about the fit, with Student's quantile of n - p degrees of freedom.

References
----------
Knapp, G., Hartung, J. (2003), Statistics in Medicine 22, 2693-2710.
Viechtbauer, W. (2005), J. Educational and Behavioral Statistics 30, 261-293.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from accelcal.arrays import Array
from accelcal.numerics.probability import LEVEL, student_quantile

_ROUNDS = 4
_GRID = 41
_TOLD_APART = 1e-7  # of a likelihood, whose rounding is smaller


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A fitted regression of n values on p columns.

    Attributes
    ----------
    coefficients : ndarray, shape (p,)
        The coefficients.
    covariance : ndarray, shape (p, p)
        Their covariance, after Knapp and Hartung.
    scatter : float
        tau, the standard deviation beyond the stated uncertainties [unit of the values].
    dof : int
        n - p, of Student's quantile.
    """

    coefficients: Array
    covariance: Array
    scatter: float
    dof: int


def fit_line(columns: Array, values: Array, uncertainty: Array) -> Fit:
    """Fit values with stated uncertainties and a common scatter beyond them.

    Parameters
    ----------
    columns : ndarray, shape (n, p)
        What the values depend on; n > p.
    values, uncertainty : ndarray, shape (n,)
        Values and their standard uncertainties.

    Returns
    -------
    Fit
        The fit.

    Notes
    -----
    The factor of Knapp and Hartung, sum w r^2 / (n - p), may be below 1: stated uncertainties have
    parts that all calibrations share, which do not scatter. It is not below 1/t^2, with Student's
    t for 95 %, so that no interval is narrower than the standard uncertainty by what is stated:
    values on a line by chance do not make it certain.

    Examples
    --------
    >>> columns = np.stack([np.ones(4), np.arange(4.0)], axis=1)
    >>> fit = fit_line(columns, np.array([1.0, 3.1, 4.9, 7.0]), np.full(4, 0.1))
    >>> fit.coefficients.round(2), fit.dof
    (array([1.03, 1.98]), 2)
    """
    scatter = scatter_beyond(columns, values, uncertainty)
    weights = 1.0 / (uncertainty**2 + scatter**2)
    inverse = np.linalg.inv(columns.T @ (weights[:, None] * columns))
    coefficients = inverse @ (columns.T @ (weights * values))
    residual = values - columns @ coefficients
    dof = values.size - columns.shape[1]
    factor = max(float(weights @ residual**2) / dof, student_quantile(LEVEL, dof) ** -2.0)
    return Fit(coefficients, factor * inverse, scatter, dof)


def scatter_beyond(columns: Array, values: Array, uncertainty: Array) -> float:
    """Estimate the scatter beyond the stated uncertainties by restricted maximum likelihood.

    Parameters
    ----------
    columns : ndarray, shape (n, p)
        What the values depend on.
    values, uncertainty : ndarray, shape (n,)
        Values and their standard uncertainties.

    Returns
    -------
    float
        tau, 0 where the stated uncertainties explain the scatter [unit of the values].
    """
    largest = float(np.ptp(values)) or float(uncertainty.max())
    tried = np.linspace(0.0, largest, _GRID)
    for _ in range(_ROUNDS):
        likelihood = _restricted_likelihood(columns, values, uncertainty, tried)
        best = int(np.argmax(likelihood))
        low, high = tried[max(best - 1, 0)], tried[min(best + 1, _GRID - 1)]
        tried = np.linspace(low, high, _GRID)
    ends = np.array([0.0, tried[_GRID // 2]])
    none, best_found = _restricted_likelihood(columns, values, uncertainty, ends)
    return float(ends[1]) if best_found > none + _TOLD_APART else 0.0


def _restricted_likelihood(
    columns: Array, values: Array, uncertainty: Array, scatter: Array
) -> Array:
    """Logarithm of the restricted likelihood at some tau, shape as of `scatter`."""
    variance = uncertainty**2 + scatter[:, None] ** 2
    weighted = columns / variance[:, :, None]
    normal = np.einsum("kij,il->kjl", weighted, columns)
    right = np.einsum("kij,i->kj", weighted, values)
    coefficients = np.linalg.solve(normal, right[:, :, None])[:, :, 0]
    residual = values - coefficients @ columns.T
    squares = (residual**2 / variance).sum(axis=1)
    of_design = np.linalg.slogdet(normal)[1]
    return np.asarray(-0.5 * (np.log(variance).sum(axis=1) + of_design + squares))
