"""Readings made safe against outliers by what their replicates say.

An outlier is a reading that its replicates contradict: the other strokes at the same position of
the same table. Huber's M-estimator is applied there, not to the residuals of the fit, in which
the errors of the head positions hide a bad reading.

References
----------
P. J. Huber, Robust Statistics, Wiley 1981, sections 7.6 and 7.8: with pseudo-values in place of
the readings, ordinary least squares gives the M-estimate and its standard uncertainty.

M. I. Shamos, "Geometry and statistics: problems at the interface", in Algorithms and Complexity,
Academic Press 1976: the scale from the median difference of pairs. A median deviation from the
median would be a third too small for three strokes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from accelcal.errors import DesignError
from accelcal.grouping import grouped, median

__all__ = ["pseudo_values"]

Array = NDArray[np.float64]

_BEND = 1.345  # 95 % efficiency on normal errors (Huber 1981)
_NORMAL_PAIRS = 1.0483  # standard deviation of a normal distribution over that median difference


def pseudo_values(
    output: Array, cell: Array, scatter: ArrayLike = 1.0, iterations: int = 100
) -> Array:
    """Replace readings by Huber's pseudo-values about the centre of their replicates.

    Parameters
    ----------
    output : ndarray, shape (n,)
        Readings [output unit].
    cell : ndarray, shape (n,)
        Label of the replicates that each reading belongs to.
    scatter : array_like, shape (n,), default 1
        Standard uncertainty of each reading, or anything proportional to it.
    iterations : int, default 100
        Most rounds of the M-estimate of each centre.

    Returns
    -------
    ndarray, shape (n,)
        Pseudo-values; on clean readings close to the readings [output unit].

    Raises
    ------
    DesignError
        If no position has three readings, so that nothing can contradict a reading.

    Notes
    -----
    All positions share one scale. Of two readings at a position nothing tells which one is wrong,
    so an outlier is made harmless only where there are three or more. Where more than half of all
    pairs of replicates are equal, each position takes its median.

    Examples
    --------
    >>> import numpy as np
    >>> y = np.array([1.0, 1.1, 0.9, 1.0, 50.0])
    >>> bool(abs(pseudo_values(y, np.zeros(5)).mean() - 1.0) < 0.1)
    True
    """
    _, index, members = grouped(cell)
    if members.max() < 3:
        raise DesignError(
            "the robust option compares the strokes at one position, and no position has three"
            " readings; measure more strokes or fit without it"
        )
    weight = np.broadcast_to(1.0 / np.asarray(scatter, dtype=np.float64), output.shape)
    centre = _medians(output, index, members.size)
    scale = _scale(output, index, weight)
    if scale == 0.0:
        return centre[index]
    for _ in range(iterations):
        bent = np.clip(weight * (output - centre[index]) / scale, -_BEND, _BEND)
        step = np.bincount(index, weight * bent) / np.bincount(index, weight**2)
        centre = centre + scale * step
        if np.abs(weight * step[index]).max() < 1e-9:
            break
    residual = weight * (output - centre[index]) / scale
    straight = float(np.mean(np.abs(residual) < _BEND))  # mean of the derivative of psi
    straight /= 1.0 + members.size / output.size * (1.0 - straight) / straight  # Huber (7.6.10)
    return centre[index] + scale * np.clip(residual, -_BEND, _BEND) / (straight * weight)


def _medians(output: Array, index: NDArray[np.intp], cells: int) -> Array:
    return np.array([median(output[index == k]) for k in range(cells)])


def _scale(output: Array, index: NDArray[np.intp], weight: Array) -> float:
    """Robust standard deviation of a reading of weight 1, from the differences of replicates."""
    differences = []
    for cell in range(index.max() + 1):
        y, variance = output[index == cell], weight[index == cell] ** -2.0
        i, j = np.triu_indices(y.size, 1)
        differences.append(np.abs(y[i] - y[j]) / np.sqrt(0.5 * (variance[i] + variance[j])))
    return _NORMAL_PAIRS * median(np.concatenate(differences))
