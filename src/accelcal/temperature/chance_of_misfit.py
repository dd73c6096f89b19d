"""Chance that estimates which follow a law are as far off it, by the errors that they have."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from accelcal.arrays import Array
from accelcal.estimate.uncertainty import Component, propagate
from accelcal.numerics.probability import f_survival
from accelcal.temperature.bilinear import misfit


def contrasts_of(design: Array) -> Array:
    """Combinations of values that a law leaves at zero.

    Parameters
    ----------
    design : ndarray, shape (..., n, p)
        Columns of the law, of full rank.

    Returns
    -------
    ndarray, shape (..., n - p, n)
        The combinations, orthonormal.
    """
    basis = np.linalg.svd(design)[0]
    return np.asarray(basis[..., design.shape[-1] :].mT)


def chance_of_misfit(values: Array, components: Mapping[str, Component], contrasts: Array) -> Array:
    """Probability that contrasts which are zero come out as large.

    Parameters
    ----------
    values : ndarray, shape (R, n)
        Estimates of R records.
    components : mapping of str to Component
        Components of their errors.
    contrasts : ndarray, shape (..., m, n)
        Combinations of the estimates, alike in all records or not.

    Returns
    -------
    ndarray, shape (R,)
        The probability; NaN where an error is unknown.

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
    return f_survival(np.asarray(squares / count), float(count), dof)
