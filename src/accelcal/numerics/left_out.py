"""Residuals of a fit, each judged by the scatter of the others.

References
----------
Cook, R. D., Weisberg, S. (1982), Residuals and Influence in Regression, section 2.2.2.
"""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array


def ratios_by_the_others(residual: Array, freedom: Array, dof: float, least: float) -> Array:
    """Size of n residuals, or of their lengths, over their standard uncertainty by the others.

    It is Student's t with one degree of freedom less than all have. Each residual has degrees of
    freedom, one less its leverage, above zero; the sum of squares of the others counts as the least
    where it is below that.

    Examples
    --------
    >>> residual = np.array([0.0, 0.0, 1.0, 3.0]) - 1.0
    >>> ratios_by_the_others(residual, np.full(4, 0.75), 3.0, 1e-12).round(3).tolist()
    [0.756, 0.756, 0.0, 4.0]
    """
    alone = residual**2 / freedom
    others = np.maximum((residual**2).sum() - alone, least)
    return np.asarray(np.sqrt((dof - 1.0) * alone / others))
