"""Attitudes known: bias and all nine sensitivities by linear least squares."""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array
from accelcal.errors import DesignError
from accelcal.triad.solution import Solution, refuse_rank

_FEWEST = 4


def from_known_attitudes(output: Array, up: Array) -> Solution:
    """Calibrate a triad whose attitudes are known.

    Parameters
    ----------
    output : ndarray, shape (n, 3)
        Outputs [output unit].
    up : ndarray, shape (n, 3)
        Acceleration along the axes of the block [g].

    Returns
    -------
    Solution
        All twelve parameters.

    Raises
    ------
    DesignError
        If there are fewer than four attitudes, or their directions lie in a plane.

    Notes
    -----
    y = b + S a is a regression of three channels on the same design A, a row (1, a) each. An
    error of the attitude moves all channels at once, so the covariance of the channels is taken
    from the residuals whole: cov = (A^T A)^-1 (x) R^T R / (n - 4).
    """
    n = len(output)
    if n < _FEWEST:
        raise DesignError(f"{n} attitudes; at least {_FEWEST} known ones tell bias and sensitivity")
    design = np.column_stack([np.ones(n), up])
    names = ("the bias", *(f"the sensitivity along {axis}" for axis in "xyz"))
    weakness, condition = refuse_rank(design, names, "turn the block about a second axis")
    estimate, *_ = np.linalg.lstsq(design, output)
    residual = output - design @ estimate
    inverse = np.linalg.inv(design.T @ design)
    bias, sensitivity = estimate[0], np.asarray(estimate[1:].T, dtype=np.float64)
    dof = n - _FEWEST
    return Solution(
        bias=bias,
        sensitivity=sensitivity,
        free=tuple(range(12)),
        covariance=_covariance(inverse, residual, dof) if dof else None,
        dof=dof,
        residual=residual / np.linalg.norm(sensitivity, axis=1),
        leverage=np.einsum("ij,jk,ik->i", design, inverse, design),
        weakness=weakness,
        condition=condition,
    )


def _covariance(inverse: Array, residual: Array, dof: int) -> Array:
    """Covariance in the order b_x, b_y, b_z, S_xx, S_xy ..., S_zz."""
    of_channels = residual.T @ residual / dof
    whole = np.kron(of_channels, inverse)  # in the order b_x, S_xx, S_xy, S_xz, b_y ...
    order = [4 * i for i in range(3)] + [4 * i + 1 + j for i in range(3) for j in range(3)]
    return np.asarray(whole[np.ix_(order, order)])
