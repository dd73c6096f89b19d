"""Propagation of uncertainty, JCGM 100: every component through readings and estimator."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from accelcal.arrays import Array
from accelcal.stand_uncertainty.estimator import Estimator
from accelcal.stand_uncertainty.readings import Readings
from accelcal.stand_uncertainty.stand import Acting

_STEP = 1e-4
"""Step of the central difference of a channel; its rounding error is 1e-12 of the slope."""


def channel_slopes(readings: Readings, channel: str) -> Array:
    """Change of each reading, and behind them of the gravity, per unit of a channel.

    Returns
    -------
    ndarray, shape (n + 1,)
        Central differences. At T0, where bilinear laws break, the mean of both slopes.
    """
    n = readings.angle.size
    if channel == "gravity":
        return np.append(np.zeros(n), 1.0)
    step = np.full(n, _STEP)
    forward, back = (readings.output({channel: sign * step}) for sign in (1.0, -1.0))
    return np.append((forward - back) / (2.0 * _STEP), 0.0)


def jacobian(estimator: Estimator, coefficients: Array) -> Array:
    """Derivative of all that is budgeted by coefficients and gravity, by a complex step.

    Parameters
    ----------
    estimator : Estimator
        The estimator.
    coefficients : ndarray, shape (p,)
        Coefficients without errors.

    Returns
    -------
    ndarray, shape (q, p + 1)
        Derivatives.
    """
    h = 1e-30
    known = np.append(coefficients, 1.0)
    return np.asarray(estimator.estimates(known + 1j * h * np.eye(known.size)).imag.T / h)


def propagated(
    part: Acting, readings: Readings, estimator: Estimator, by_coefficient: Array
) -> tuple[Array, float]:
    """Bring one component through readings and estimator.

    Returns
    -------
    through : ndarray, shape (q, m)
        Change of each coefficient by one standard uncertainty of each of its m errors.
    residual : float
        Part of the effect on the readings that the residuals show; NaN where there is no effect.
    """
    slopes = channel_slopes(readings, part.channel)
    standard = part.component.distribution.standard
    effects = [slopes[:-1] * phase for phase in (standard * part.pattern).T]
    on_coefficients = [_by_error(estimator.map * effect, part) for effect in effects]
    along_fit = [_by_error(estimator.fitted.T * effect, part) for effect in effects]
    gravity = np.zeros((1, part.errors * len(effects)))
    gravity[0, 0] = slopes[-1] * standard
    known = np.vstack([np.hstack(on_coefficients), gravity])
    left = _part_left(estimator, effects, np.hstack(along_fit), known[:-1])
    return by_coefficient @ known, left


def _by_error(values: Array, part: Acting) -> Array:
    """Sums of the columns that share an error, shape (p, errors)."""
    return np.stack([np.bincount(part.error, row, minlength=part.errors) for row in values])


def _part_left(
    estimator: Estimator, effects: Sequence[Array], along_fit: Array, on_coefficients: Array
) -> float:
    """Size of the residuals e - F c of all errors, over that of their effects e."""
    squares = float(sum(effect @ effect for effect in effects))
    if squares == 0.0:
        return float("nan")
    across = float((along_fit * on_coefficients).sum())  # e F c
    gram = estimator.fitted.T @ estimator.fitted
    fitted = float((on_coefficients * (gram @ on_coefficients)).sum())
    return float(np.sqrt(max(squares - 2.0 * across + fitted, 0.0) / squares))
