"""Generalised least squares of temperature laws: maps to their parameters, chance of a misfit."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from accelcal.arrays import Array
from accelcal.estimate.uncertainty import Component, propagate
from accelcal.numerics.probability import f_survival

_ALMOST_NOTHING = 1e-12  # added to a diagonal of ones, so that the matrix stays definite


def law_maps(law: Array, pairs: Array, covariance: Array) -> Array:
    """Find the maps from n tables to the laws of k0, K1 and delta, and to the half widths of k0.

    The columns of one law, shape (R, n, p) or (1, n, p), are those of
    `accelcal.reference.bilinear_design`; those of the half widths, (n, L), are of
    `accelcal.temperature.hysteresis.Branches`. The covariance of the tables in each quantity, of
    shape (R, 3, n, n), is NaN where unknown. The maps, (R, 3, p + L, n), are zero for half widths
    of K1 and delta; axes of R and of 3 have the length 1 where they are alike.

    Notes
    -----
    Each law is solved by itself: the correlations between them are weak, and their uncertainties
    may differ by many powers of ten.
    """
    design = law[:, None]
    if not pairs.shape[1]:
        return _generalised(design, covariance)
    of_bias = _generalised(with_columns(design, pairs), covariance[:, :1])
    others = _generalised(design, covariance[:, 1:])
    maps = np.zeros((len(covariance), 3, *of_bias.shape[2:]))
    maps[:, :1] = of_bias
    maps[:, 1:, : law.shape[2]] = others
    return maps


def with_columns(law: Array, more: Array) -> Array:
    """Columns of laws, shape (..., n, p), and behind them more of all laws, shape (n, L)."""
    wide = np.broadcast_to(more, (*law.shape[:-1], more.shape[1]))
    return np.concatenate([law, wide], axis=-1)


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


def misfit(left: Array, covariance: Array) -> Array:
    """Chi-squared of what is left, shape (R, n), in its covariance, shape (R, n, n): shape (R,).

    The covariance may be singular; where it is unknown, so is chi-squared, NaN.
    """
    known = np.asarray(np.isfinite(covariance).all(axis=(1, 2)))
    inverse = np.linalg.pinv(np.where(known[:, None, None], covariance, 0.0), hermitian=True)
    squares = (left[:, None] @ inverse @ left[..., None])[:, 0, 0]
    return np.where(known, squares, np.nan)


def contrasts_of(design: Array) -> Array:
    """Orthonormal combinations of n values that a law leaves at zero, shape (..., n - p, n).

    The columns of the law, shape (..., n, p), are of full rank.
    """
    basis = np.linalg.svd(design)[0]
    return np.asarray(basis[..., design.shape[-1] :].mT)


def chance_of_misfit(values: Array, components: Mapping[str, Component], contrasts: Array) -> Array:
    """Probability that contrasts which are zero come out as large, shape (R,).

    The values are estimates of R records, shape (R, n), with the components of their errors; the
    contrasts, shape (..., m, n), are alike in all records or not. It is NaN where an error is
    unknown.

    Notes
    -----
    Fisher's F with m and as many degrees of freedom as the components have in the harmonic mean,
    weighted by their shares in the expected sum of squares. A chi-squared test would take
    variances as known that the same few replicates tell.

    Examples
    --------
    >>> import numpy as np
    >>> launch = Component(np.eye(3)[None], np.full((1, 3), 2.0))
    >>> line = contrasts_of(np.array([[1.0, 0.0], [1.0, 1.0], [1.0, 2.0]]))
    >>> float(chance_of_misfit(np.array([[0.0, 6.0, 0.0]]), {"launch": launch}, line)[0].round(4))
    0.0392
    """
    seen = propagate(components, contrasts)
    covariance = np.asarray(sum(part.covariance for part in seen.values()))
    count = contrasts.shape[-2]
    squares = misfit(np.einsum("...mn,...n->...m", contrasts, values), covariance)
    inverse = np.linalg.pinv(np.nan_to_num(covariance), hermitian=True)
    over_dof = np.zeros(squares.shape)
    for part in seen.values():
        share = np.einsum("...ij,...ji->...", inverse, part.covariance) / count
        over_dof = over_dof + share / part.dof.min(axis=-1)
    dof = np.divide(1.0, over_dof, out=np.full(squares.shape, np.inf), where=over_dof > 0.0)
    dof = np.maximum(dof, 1.0)
    return f_survival(np.asarray(squares / count), float(count), dof)
