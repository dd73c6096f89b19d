"""Residuals of a fit, each judged by the scatter of the others.

References
----------
Cook, R. D., Weisberg, S. (1982), Residuals and Influence in Regression, section 2.2.2.
"""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array


def ratios_by_the_others(residual: Array, freedom: Array, dof: float, least: float) -> Array:
    """Size of each residual over its standard uncertainty by the others: Student's t.

    Parameters
    ----------
    residual : ndarray, shape (n,)
        Residuals, or their lengths.
    freedom : ndarray, shape (n,)
        Degrees of freedom of each, one less its leverage, above zero.
    dof : float
        Degrees of freedom of all; those of the ratios are one less.
    least : float
        Sum of squares of the others below which it counts as this.

    Returns
    -------
    ndarray, shape (n,)
        The ratios.

    Examples
    --------
    >>> residual = np.array([0.0, 0.0, 1.0, 3.0]) - 1.0
    >>> ratios_by_the_others(residual, np.full(4, 0.75), 3.0, 1e-12).round(3).tolist()
    [0.756, 0.756, 0.0, 4.0]
    """
    alone = residual**2 / freedom
    others = np.maximum((residual**2).sum() - alone, least)
    return np.asarray(np.sqrt((dof - 1.0) * alone / others))
