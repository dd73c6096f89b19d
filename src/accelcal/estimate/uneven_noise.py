"""Reading noise that differs by position, as that of temperatures which nobody recorded.

One noise for all readings then makes some intervals too short and others too wide. The scatter at
each position tells its own, if there are strokes enough.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arrays import Array, Mask
from accelcal.estimate.noise import FEW, ReadingNoise
from accelcal.estimate.tables import PreparedTable
from accelcal.numerics.grouping import sums_of_groups
from accelcal.numerics.probability import f_exceeds

_SIGNIFICANT = 0.01

_OF_STEP = 0.5
"""Noise in steps below which the scatter at a position follows its place between two steps."""

_ROUNDED = 1e-10
"""Noise, as a share of the readings, below which it may be that of the arithmetic."""


class UnevenNoise(NamedTuple):
    """Scatter of the readings of a table at each of its J positions, in R records.

    Attributes
    ----------
    differs : ndarray of bool, shape (R,)
        Whether the positions differ by more than chance.
    variance : ndarray, shape (R, J)
        Variance of a reading.
    dof : ndarray, shape (J,)
        Its degrees of freedom.
    """

    differs: Mask
    variance: Array
    dof: Array

    def noise(self, influence: Array) -> tuple[Array, Array]:
        """What the noise of the records that differ does to p coefficients, with its dof.

        Parameters
        ----------
        influence : ndarray, shape (J, p, p)
            Covariance that noise of variance 1 at one position gives.

        Returns
        -------
        covariance : ndarray, shape (D, p, p)
            Covariance.
        dof : ndarray, shape (D, p)
            Degrees of freedom after Welch and Satterthwaite.
        """
        own = self.variance[self.differs]
        parts = own[:, :, None] * np.diagonal(influence, axis1=1, axis2=2)
        squares = (parts**2 / self.dof[:, None]).sum(axis=1)
        return np.tensordot(own, influence, axes=1), parts.sum(axis=1) ** 2 / squares


def uneven_noise(
    table: PreparedTable, output: Array, noise: ReadingNoise, step: Array
) -> UnevenNoise:
    """Tell whether the readings scatter alike at all positions.

    Parameters
    ----------
    table : PreparedTable
        The table of any of R records of one plan.
    output : ndarray, shape (R, n)
        Its readings [output unit].
    noise : ReadingNoise
        Their common noise.
    step : ndarray, shape (R,)
        Step of the readings [output unit].

    Returns
    -------
    UnevenNoise
        It never differs with declared scatter, or with fewer than four readings at any position.
    """
    _, cell, members = table.at_head
    dof = (members - 1).astype(np.float64)
    nowhere = np.zeros(len(output), dtype=np.bool_)
    if table.scatter_dof is not None or members.size < 2 or dof.min() < FEW:
        return UnevenNoise(nowhere, np.zeros((len(output), members.size)), dof)
    means = sums_of_groups(output.T, cell, members) / members[:, None]
    squares = sums_of_groups((output.T - means[cell]) ** 2, cell, members)
    variance = squares.T / dof
    least = np.maximum(_OF_STEP * step, _ROUNDED * np.abs(output).max(axis=1))
    return UnevenNoise(
        (noise.factor > least) & differ(variance.T, dof, _SIGNIFICANT), variance, dof
    )


def differ(variance: Array, dof: ArrayLike, level: float) -> Mask:
    """Tell where variances differ by more than chance.

    Parameters
    ----------
    variance : ndarray, shape (k, R)
        Variances.
    dof : array_like, shape (k,) or (k, R)
        Their degrees of freedom.
    level : float
        Probability that equal ones pass for different.

    Returns
    -------
    ndarray of bool, shape (R,)
        Whether they differ, by Bartlett's test [1]_.

    References
    ----------
    .. [1] M. S. Bartlett, "Properties of sufficiency and statistical tests", Proc. R. Soc. A 160
       (1937) 268-282.

    Examples
    --------
    >>> differ(np.array([[1.0, 1.0], [1.1, 9.0]]), [10.0, 10.0], 0.01).tolist()
    [False, True]
    """
    freedom = np.reshape(dof, (len(variance), -1))
    whole, others = freedom.sum(axis=0), len(variance) - 1.0
    pooled = (freedom * variance).sum(axis=0) / whole
    share = np.divide(variance, pooled, out=np.ones_like(variance), where=pooled > 0.0)
    squares = -(freedom * np.log(np.maximum(share, np.finfo(float).tiny))).sum(axis=0)
    squares /= 1.0 + ((1.0 / freedom).sum(axis=0) - 1.0 / whole) / (3.0 * others)
    return f_exceeds(level, squares / others, others, np.inf)
