"""All differences of two calibrations at once, with their correlations."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.new_record.chances import sizes_left_open
from accelcal.numerics.probability import LEVEL, NORMAL_FACTOR, f_survival, student_quantile
from accelcal.results.calibration_comparison import JointTest

_RANK = 1e-9
"""Variance of a direction, over the largest of the correlations, below which it is rounding."""

Factor = Callable[[float], float]


def joint_test(differences: Array, covariance: Callable[[Factor], Array]) -> JointTest:
    """Test whether differences, shape (p,), are those that their covariance leaves.

    The covariance, shape (p, p), is a function of a factor that gives the size of an error over its
    estimate, by the degrees of freedom of the estimate. The sum of squares is with the sizes as
    estimated; the chance is the mean over all sizes that few degrees of freedom leave open, as in
    `accelcal.discovery.new_record.chances`.
    """
    whitener = _whitener(covariance(lambda _: 1.0))
    p, seen = len(whitener), whitener @ differences
    if p == 0:
        return JointTest(0.0, 0, 1.0)
    chance = 0.0
    for weight, factor in sizes_left_open():
        sized = whitener @ covariance(factor) @ whitener.T
        squares = float(seen @ np.linalg.solve(sized, seen))
        chance += weight * f_survival(squares / p, p, np.inf)
    return JointTest(float(seen @ seen), p, min(chance, 1.0))


def joint_test_if_known(differences: Array, covariance: Callable[[Factor], Array]) -> JointTest:
    """Test as `joint_test`, were errors known to have the sizes that they count with for U."""
    counted = covariance(lambda dof: student_quantile(LEVEL, dof) / NORMAL_FACTOR)
    return joint_test(differences, lambda _: counted)


def _whitener(covariance: Array) -> Array:
    """Independent combinations of quantities, each with the variance 1."""
    sizes = np.sqrt(np.diagonal(covariance))
    scale = np.where(sizes > 0.0, sizes, 1.0)
    variances, directions = np.linalg.eigh(covariance / np.outer(scale, scale))
    kept = variances > _RANK * max(variances.max(), 1.0)
    return np.asarray((directions[:, kept] / np.sqrt(variances[kept])).T / scale)
