"""Readings made safe against outliers by what their replicates say.

An outlier is a reading that its replicates contradict: the other strokes at the same position of
the same table. Huber's M-estimator is applied there, not to the residuals of the fit, in which
the errors of the head positions hide a bad reading.

References
----------
P. J. Huber, Robust Statistics, Wiley 1981, section 7.8: with pseudo-values in place of the
readings, ordinary least squares gives the M-estimate and its standard uncertainty.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from accelcal.errors import DesignError

__all__ = ["pseudo_values"]

Array = NDArray[np.float64]

_BEND = 1.345  # 95 % efficiency on normal errors (Huber 1981)
_NORMAL_MAD = 1.4826  # standard deviation of a normal distribution over its median deviation


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
    iterations : int, default 50
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
    All positions share one scale, so that one with a single reading or two has a share in it; but
    of two readings nothing tells which one is wrong, and an outlier there stays what it is. Where
    more than half of all readings equal the median of their position, it takes their place.

    Examples
    --------
    >>> import numpy as np
    >>> y = np.array([1.0, 1.1, 0.9, 1.0, 50.0])
    >>> bool(abs(pseudo_values(y, np.zeros(5)).mean() - 1.0) < 0.1)
    True
    """
    _, index, members = np.unique(cell, return_inverse=True, return_counts=True)
    if members.max() < 3:
        raise DesignError(
            "the robust option compares the strokes at one position, and no position has three"
            " readings; measure more strokes or fit without it"
        )
    weight = np.broadcast_to(1.0 / np.asarray(scatter, dtype=np.float64), output.shape)
    centre = _medians(output, index, members.size)
    scale = _spread(weight * (output - centre[index]), members[index])
    if scale == 0.0:
        return centre[index]
    for _ in range(iterations):
        bent = np.clip(weight * (output - centre[index]) / scale, -_BEND, _BEND)
        step = scale * np.bincount(index, weight * bent) / np.bincount(index, weight**2)
        centre = centre + step
        if np.abs(step).max() < 1e-9 * scale:
            break
    residual = weight * (output - centre[index]) / scale
    straight = float(np.mean(np.abs(residual) < _BEND))  # mean of the derivative of psi
    return centre[index] + scale * np.clip(residual, -_BEND, _BEND) / (straight * weight)


def _medians(output: Array, index: NDArray[np.intp], cells: int) -> Array:
    return np.array([np.median(output[index == k]) for k in range(cells)])


def _spread(deviation: Array, members: NDArray[np.intp]) -> float:
    """Robust standard deviation of a reading about the centre of its replicates."""
    several = members >= 3
    shrinkage = np.sqrt(members[several] / (members[several] - 1.0))  # the centre is fitted too
    return float(_NORMAL_MAD * np.median(np.abs(deviation[several]) * shrinkage))
