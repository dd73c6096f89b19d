"""Covariances: the root of one, and the one that information leaves."""

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
