"""Covariances, the root of one and what information leaves; residuals judged by the others.

References
----------
Cook, R. D., Weisberg, S. (1982), Residuals and Influence in Regression, section 2.2.2.
"""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array

_LEAST = 1e-12
"""Information below it, over that of each position alone, is rounding."""


def covariance_root(covariance: Array, sizes: Array | None = None) -> Array:
    """Find a matrix R with R R' = covariance, symmetric, shape (n, n).

    Eigenvalues below zero are taken as zero, in units of the sizes of the quantities, above 0,
    where these are given: where units differ, nothing small is lost beside the others.

    Examples
    --------
    >>> import numpy as np
    >>> root = covariance_root(np.array([[4.0, 0.0], [0.0, -1e-20]]))
    >>> (root @ root.T).tolist()
    [[4.0, 0.0], [0.0, 0.0]]
    """
    size = np.ones(len(covariance)) if sizes is None else sizes
    values, vectors = np.linalg.eigh(covariance / np.outer(size, size))
    return np.asarray(size[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))


def posterior(information: Array, pull: Array, least: float = _LEAST) -> tuple[Array, Array]:
    """Estimate k errors from information that was added up, with their covariance, shape (k, k).

    The information is the sum of S^T S over all that tells of them, the declaration included, the
    pull that of S^T z. Information below `least`, over that of each error alone, is taken for
    rounding.
    """
    scale = np.sqrt(np.diagonal(information))
    scale = np.where(scale > 0.0, scale, 1.0)
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    root = vectors / np.sqrt(np.maximum(values, least))
    covariance = np.asarray(root @ root.T / np.outer(scale, scale))
    return covariance @ pull, covariance


def ratios_by_the_others(residual: Array, freedom: Array, dof: float, least: float) -> Array:
    """Size of n residuals, or of their lengths, over their standard uncertainty by the others.

    It is Student's t with one degree of freedom less than all have. Each residual has degrees of
    freedom, one less its leverage, above zero; the sum of squares of the others counts as the least
    where it is below that.

    Examples
    --------
    >>> residual = np.array([0.0, 0.0, 1.0, 3.0]) - 1.0
    >>> ratios_by_the_others(residual, np.full(4, 0.75), 3.0, 1e-12).round(3).tolist()
    [0.756, 0.756, 0.0, 4.0]
    """
    alone = residual**2 / freedom
    others = np.maximum((residual**2).sum() - alone, least)
    return np.asarray(np.sqrt((dof - 1.0) * alone / others))
