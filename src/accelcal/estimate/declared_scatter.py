"""Standard uncertainty of averaged readings from the columns `std` and `n`.

A standard deviation of few samples scatters itself. Weights by it would favour the readings whose
samples happen to agree, and promise more than they give. So the deviations of a table are compared
with each other, and each is drawn to the others by what chance alone makes of it.

References
----------
G. K. Smyth, "Linear models and empirical Bayes methods for assessing differential expression in
microarray experiments", Stat. Appl. Genet. Mol. Biol. 3 (2004) 3, sections 3 and 6.2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from accelcal.record import TumbleRecord

__all__ = ["declared_scatter"]

Array = NDArray[np.float64]

_FEWEST = 3.0
"""Degrees of freedom that a variance counts for at least: it has no mean with two or fewer."""


def declared_scatter(record: TumbleRecord) -> tuple[Array, float | None]:
    """Standard uncertainty of each averaged reading, where the table declares them all.

    Parameters
    ----------
    record : TumbleRecord
        Readings of one run in one mounting.

    Returns
    -------
    scatter : ndarray, shape (n,)
        Standard uncertainty of each reading, ones where not all are declared [output unit].
    dof : float or None
        Degrees of freedom of all together; None where not declared.

    Notes
    -----
    Without the numbers of samples, `std` is the standard uncertainty of the reading itself.
    """
    if record.std is None or not np.all(record.std > 0):
        return np.ones(len(record)), None
    if record.count is None or not np.all(record.count >= 1):
        return record.std.copy(), np.inf
    dof, squares = record.count - 1.0, record.std**2
    some = dof > 0.0  # one sample has no deviation: what is declared of it stands
    if not some.any():
        return np.sqrt(squares / record.count), np.inf
    if np.ptp(squares[some]) > 0.0:
        squares[some] = _moderated(squares[some], dof[some])
    return np.sqrt(squares / record.count), float(dof.sum())


def _moderated(squares: Array, dof: Array) -> Array:
    """Variances of samples, each with what the others tell of it (Smyth 2004).

    With true variances d0 s0^2 / chi^2(d0) the inverse of one is expected at
    (d0 + dof) / (d0 s0^2 + dof s^2), which is the best weight, and itself at d / (d - 2) times the
    inverse of that, d = d0 + dof.
    """
    logs = np.log(squares)
    told = float(logs.var(ddof=1) - _variance_of_log(dof).mean())
    if told <= 0.0:  # they scatter by no more than chance
        return np.full_like(squares, squares @ dof / dof.sum())
    prior = (1.0 + np.sqrt(1.0 + 2.0 * told)) / told  # by the first two terms of the variance
    middle = np.exp((logs + _bias_of_log(dof)).mean() - _bias_of_log(prior))
    best = (prior * middle + dof * squares) / (prior + dof)
    counted = np.maximum(prior + dof, _FEWEST)
    return np.asarray(best * counted / (counted - 2.0))


def _variance_of_log(dof: Array) -> Array:
    """Variance of log chi^2, the trigamma function of half of it (DLMF 5.15.8), to 8 %."""
    return 2.0 / dof + 2.0 / dof**2 + 4.0 / (3.0 * dof**3)


def _bias_of_log(dof: ArrayLike) -> Array:
    """By how much the mean of log(chi^2 / dof) is below 0 (DLMF 5.11.2), from 1 on to 5 %."""
    inverse = 1.0 / np.asarray(dof)
    return np.asarray(np.minimum(inverse + inverse**2 / 3.0, 2.0 * inverse))
