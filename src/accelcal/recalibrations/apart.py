"""One calibration that stands apart from all others: a bad one, or one alone beside a jump.

References
----------
Cook, R. D., Weisberg, S. (1982), Residuals and Influence in Regression, section 2.2.2: the test of
the farthest of all, with Student's t and the correction of Bonferroni.
"""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array
from accelcal.numerics.left_out import ratios_by_the_others
from accelcal.numerics.probability import student_survival
from accelcal.recalibrations.regression import ROUNDING, proportions

_FEWEST = 2
"""Degrees of freedom that the others need, to see how they scatter."""


def farthest(columns: Array, values: Array, uncertainty: Array) -> tuple[int, float]:
    """Find the value that is farthest from what the others say.

    Parameters
    ----------
    columns : ndarray, shape (n, p)
        Columns of the line.
    values, uncertainty : ndarray, shape (n,)
        Values and their standard uncertainties.

    Returns
    -------
    place : int
        Which it is.
    chance : float
        That the farthest of all is so far by noise; 1 where the others are too few to tell. The
        scatter is that of the others. Whether it is in proportion to the stated uncertainties is
        not known: the chance is the largest for proportions from as stated to all alike.

    Examples
    --------
    >>> columns = np.stack([np.ones(8), np.arange(8.0)], axis=1)
    >>> place, chance = farthest(columns, np.array([1, 2, 4, 4, 5, 7, 7, 20.0]), np.ones(8))
    >>> place, round(chance, 4)
    (7, 0.0001)
    """
    dof = values.size - columns.shape[1] - 1
    if dof < _FEWEST:
        return 0, 1.0
    sigma = np.sqrt(proportions(uncertainty**2))
    ratios = [_ratios(columns / own[:, None], values / own, dof) for own in sigma]
    least = np.min(ratios, axis=0)
    place = int(least.argmax())
    both_sides = 2.0 * student_survival(float(least[place]), dof)
    return place, min(1.0, values.size * both_sides)


def _ratios(columns: Array, values: Array, dof: int) -> Array:
    """Distance of each value from the line of the others, over its standard uncertainty by them."""
    base = np.linalg.qr(columns).Q
    left = values - base @ (base.T @ values)
    freedom = np.maximum(1.0 - (base**2).sum(axis=1), ROUNDING)
    return ratios_by_the_others(left, freedom, dof + 1.0, ROUNDING)
