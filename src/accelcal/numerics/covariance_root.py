"""Root of a covariance that rounding, or a difference, may have left without one."""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array


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
