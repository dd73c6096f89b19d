"""Coverage factor of a band that holds everywhere along a curve, and not at each point alone.

A curve of estimates moves, over its standard uncertainty, along a path on the unit sphere of its
errors. With kappa the length of that path,

    P(max |t| > c) <= P(|t| > c) + kappa / pi (1 + c^2 / dof)^(-dof / 2)

(Naiman 1986; the tube formula of Sun and Loader 1994). Scheffe's factor holds for all combinations
of the errors, of which the curve is a few, and is wider.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from accelcal.arrays import Array
from accelcal.numerics.probability import student_density, student_quantile, student_survival


def path_length(covariance: Array) -> float:
    """Length [rad] of the path of n neighbouring points on the unit sphere of their errors.

    It is the sum of the angles between neighbours, from their covariance; a point without any error
    has no place on the path.

    Examples
    --------
    >>> import numpy as np
    >>> path_length(np.ones((3, 3))), round(path_length(np.eye(3)) / np.pi, 12)
    (0.0, 1.0)
    """
    u = np.sqrt(np.diagonal(covariance))
    kept = u > 0.0
    covered = covariance[np.ix_(kept, kept)] / np.outer(u[kept], u[kept])
    return float(np.arccos(np.clip(np.diagonal(covered, 1), -1.0, 1.0)).sum())


@lru_cache(maxsize=1024)
def simultaneous_quantile(level: float, dof: float, length: float) -> float:
    """Two-sided coverage factor of Student's t at all points of a path, of `path_length`, at once.

    c with P(max |T| <= c) >= `level`; Student's factor where the path has no length. Infinite
    degrees of freedom give the normal distribution.

    Raises
    ------
    InputError
        As of `accelcal.numerics.probability.student_quantile`.

    Examples
    --------
    >>> [round(simultaneous_quantile(0.95, float("inf"), length), 3) for length in (0.0, 3.0)]
    [1.96, 2.532]
    """
    c = student_quantile(level, dof)
    for _ in range(200):
        beyond, slope = _of_path(c, dof, length)
        excess = 2.0 * student_survival(c, dof) + beyond - (1.0 - level)
        step = excess / (2.0 * student_density(c, dof) - slope)
        c += step  # from the left of the root of a convex function
        if abs(step) <= 1e-9 * c:
            break
    return c


def _of_path(c: float, dof: float, length: float) -> tuple[float, float]:
    """What the path adds to the probability of a single point, and its slope."""
    bent = 1.0 if math.isinf(dof) else 1.0 + c * c / dof
    tail = math.exp(-0.5 * c * c) if math.isinf(dof) else bent ** (-0.5 * dof)
    return length / math.pi * tail, -length / math.pi * tail * c / bent
