"""Generalised least squares of the temperature laws: the maps from tables to parameters."""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array

_ALMOST_NOTHING = 1e-12  # added to a diagonal of ones, so that the matrix stays definite


def law_maps(law: Array, pairs: Array, covariance: Array) -> Array:
    """Find the maps from n tables to the laws of k0, K1 and delta, and to the half widths of k0.

    Parameters
    ----------
    law : ndarray, shape (R, n, p)
        Columns of one law, see `accelcal.temperature.bilinear.bilinear_design`; one for all
        records where it is alike.
    pairs : ndarray, shape (n, L)
        Columns of the half widths, see `accelcal.temperature.hysteresis.Branches`.
    covariance : ndarray, shape (R, 3, n, n)
        Covariance of the tables in each quantity; NaN where unknown.

    Returns
    -------
    ndarray, shape (R, 3, p + L, n)
        The maps; zero for half widths of K1 and delta. Axes of R and of 3 have the length 1 where
        the maps are alike.

    Notes
    -----
    Each law is solved by itself: the correlations between them are weak, and their uncertainties
    may differ by many powers of ten.
    """
    design = law[:, None]
    if not pairs.shape[1]:
        return _generalised(design, covariance)
    wide = np.broadcast_to(pairs, (*design.shape[:-1], pairs.shape[1]))
    of_bias = _generalised(np.concatenate([design, wide], axis=-1), covariance[:, :1])
    others = _generalised(design, covariance[:, 1:])
    maps = np.zeros((len(covariance), 3, *of_bias.shape[2:]))
    maps[:, :1] = of_bias
    maps[:, 1:, : law.shape[2]] = others
    return maps


def _generalised(design: Array, covariance: Array) -> Array:
    """Generalised least-squares maps, (..., parameters, n); plain where the weights are unknown.

    As many tables as parameters leave nothing to weigh.
    """
    size, count = design.shape[-2:]
    if size == count:
        return np.asarray(np.linalg.inv(design))
    variance = np.linalg.diagonal(covariance)
    known = np.asarray(np.isfinite(covariance).all(axis=(-2, -1)) & (variance > 0.0).all(axis=-1))
    sigma = np.sqrt(np.where(known[..., None], variance, 1.0))
    among = covariance / (sigma[..., None] * sigma[..., None, :])
    least = np.where(known, _ALMOST_NOTHING, 1.0)[..., None, None] * np.eye(size)
    root = np.linalg.cholesky(np.where(known[..., None, None], among, 0.0) + least)
    inverse = np.linalg.inv(root)
    whitened = inverse @ (design / sigma[..., None])
    norms = np.sqrt((whitened**2).sum(axis=-2, keepdims=True))  # as slopes are tiny
    basis, triangle = np.linalg.qr(whitened / norms)
    solved = np.linalg.solve(triangle, basis.mT) / norms.mT
    return np.asarray(solved @ inverse / sigma[..., None, :])
