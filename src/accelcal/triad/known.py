"""Attitudes known: bias and all nine sensitivities by linear least squares."""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array
from accelcal.errors import DesignError, InputError
from accelcal.results.triad import AXES
from accelcal.triad.solution import Design, Solution, design_of

_FEWEST = 4
_ONE = 1e-6  # rad
_OWN_COLUMN = "give each channel the column of its own outputs"
_LEAST = 1e-6
"""Mean variance in the residuals, in place of none where errors of attitudes leave nothing."""


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
    InputError
        If an output never changes, or two outputs are one.
    DesignError
        If there are fewer than four attitudes, or their directions lie in a plane.

    Notes
    -----
    y = b + S a is a regression of three channels on the same design A, a row (1, a) each. An
    error of the attitude moves all channels at once, so the covariance of the channels is taken
    from the residuals whole: cov = (A^T A)^-1 (x) R^T R / (n - 4). Such an error does not act
    where the channel points up; what that adds to some parameters is counted.
    """
    n = len(output)
    if n < _FEWEST:
        raise DesignError(f"{n} attitudes; at least {_FEWEST} known ones tell bias and sensitivity")
    matrix = np.column_stack([np.ones(n), up])
    names = ("the bias", *(f"the sensitivity along {axis}" for axis in "xyz"))
    design = design_of(matrix, names, "turn the block about a second axis")
    estimate = design.inverse @ output
    _refuse_one_column(output, estimate[1:].T)
    residual = output - matrix @ estimate
    bias, sensitivity = estimate[0], np.asarray(estimate[1:].T, dtype=np.float64)
    scale = np.linalg.norm(sensitivity, axis=1)
    return Solution(
        bias=bias,
        sensitivity=sensitivity,
        free=tuple(range(12)),
        covariance=_covariance(design, residual, sensitivity / scale[:, None] @ up.T),
        residual=residual / scale,
        design=design,
    )


def _refuse_one_column(output: Array, sensitivity: Array) -> None:
    for i, axis in enumerate(AXES):
        if not np.ptp(output[:, i]):
            raise InputError(f"output {axis} is the same in all attitudes; {_OWN_COLUMN}")
        for j in range(i):
            across = np.linalg.norm(np.cross(sensitivity[i], sensitivity[j]))
            if across <= _ONE * np.linalg.norm(sensitivity[i]) * np.linalg.norm(sensitivity[j]):
                told = f"outputs {AXES[j]} and {axis} tell one and the same axis"
                raise InputError(f"{told}; {_OWN_COLUMN}")


def _covariance(design: Design, residual: Array, felt: Array) -> Array | None:
    """Covariance in the order b_x, b_y, b_z, S_xx, S_xy ..., S_zz."""
    dof = len(residual) - _FEWEST
    if not dof:
        return None
    whole = np.kron(residual.T @ residual / dof, design.inverse @ design.inverse.T)
    factor = np.concatenate([_factor(design, 1.0 - along**2, dof) for along in felt])
    whole *= np.outer(factor, factor)  # in the order b_x, S_xx, S_xy, S_xz, b_y ...
    order = [4 * i for i in range(3)] + [4 * i + 1 + j for i in range(3) for j in range(3)]
    return np.asarray(whole[np.ix_(order, order)])


def _factor(design: Design, shape: Array, dof: int) -> Array:
    """Growth of the uncertainties where the variance has this shape over the attitudes.

    Less than 1 is not taken: noise of the channel itself is alike in all of them.
    """
    mean = np.maximum(shape @ (1.0 - np.sum(design.basis**2, axis=1)) / dof, _LEAST)
    squares = design.inverse**2
    growth = squares @ shape / (mean * squares.sum(axis=1))
    return np.asarray(np.sqrt(np.maximum(growth, 1.0)))
