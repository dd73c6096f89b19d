"""Estimates from information that was added up."""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array

_LEAST = 1e-12
"""Information below it, over that of each position alone, is rounding."""


def posterior(information: Array, pull: Array, least: float = _LEAST) -> tuple[Array, Array]:
    """Estimate from information that was added up, with its covariance.

    Parameters
    ----------
    information : ndarray, shape (k, k)
        Sum of S^T S over all that tells of the k errors, the declaration included.
    pull : ndarray, shape (k,)
        Sum of S^T z.
    least : float
        Information below it, over that of each error alone, is taken for rounding.

    Returns
    -------
    value : ndarray, shape (k,)
        Estimate.
    covariance : ndarray, shape (k, k)
        Its covariance.
    """
    scale = np.sqrt(np.diagonal(information))
    scale = np.where(scale > 0.0, scale, 1.0)
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    root = vectors / np.sqrt(np.maximum(values, least))
    covariance = np.asarray(root @ root.T / np.outer(scale, scale))
    return covariance @ pull, covariance
