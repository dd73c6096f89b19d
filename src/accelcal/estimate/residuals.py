"""Residuals of a linear model, known far beyond the working precision of its product.

References
----------
K. Ozaki, T. Ogita, S. Oishi, S. M. Rump, "Error-free transformations of matrix multiplication by
using fast routines of matrix multiplication", Numerical Algorithms 59 (2012) 95-118.

T. Ogita, S. M. Rump, S. Oishi, "Accurate sum and dot product", SIAM J. Sci. Comput. 26 (2005)
1955-1988.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.memory import Memory

__all__ = ["CutDesign", "twice_precise_residual"]

Array = NDArray[np.float64]

_MEMORY = Memory()

# A solution in multiples of its size / 2^23 and a design in multiples of 2^-24 have a product of
# up to 49 bits, so that it is exact in the 53 bits of a number, in whatever order it is summed.
_CUT_SOLUTION = 2.0**30
_CUT_DESIGN = 2.0**24


class CutDesign(NamedTuple):
    """A design matrix cut into the upper bits of its elements and the rest.

    Attributes
    ----------
    high, low : ndarray, shape (n, p)
        The matrix is their sum.
    """

    high: Array
    low: Array

    @classmethod
    def of(cls, matrix: Array) -> CutDesign:
        """Cut a matrix whose elements are of the size of one, shape (n, p)."""
        high = np.round(matrix * _CUT_DESIGN) / _CUT_DESIGN
        return cls(high, matrix - high)

    def near(self, solution: Array) -> Array:
        """Round solutions to the few bits that `subtract_fit` needs, in place, shape (p, T)."""
        anchor = _CUT_SOLUTION * np.abs(solution).max(axis=0)
        solution += anchor
        solution -= anchor
        return solution

    def subtract_fit(self, y: Array, solution: Array) -> Array:
        """Turn y, shape (n, T), into y - matrix @ solution for solutions of `near`.

        The first product is exact, and so is its difference to a y that it is close to.
        """
        for part in self:
            y -= np.matmul(part, solution, out=_MEMORY.array("fit", y.shape))
        return y


def twice_precise_residual(y: Array, r: Array, matrix: Array, x: Array) -> Array:
    """Return y - r - matrix @ x as if summed in twice the working precision.

    Parameters
    ----------
    y, r : ndarray, shape (..., n)
        Summands.
    matrix : ndarray, shape (n, p)
        Matrix.
    x : ndarray, shape (..., p)
        Factors.

    Returns
    -------
    ndarray, shape (..., n)
        The difference, rounded once.

    Examples
    --------
    >>> import numpy as np
    >>> tenth = np.array([0.1])
    >>> twice_precise_residual(np.array([1.0]), np.array([0.0]), tenth[:, None], np.array([10.0]))
    array([-5.55111512e-17])
    """
    total, rest = _sum(y, -r)
    for column, factor in zip(matrix.T, np.moveaxis(x, -1, 0), strict=True):
        product, error = _product(column, factor[..., None])
        total, lost = _sum(total, -product)
        rest = rest + (lost - error)
    return np.asarray(total + rest)


def _sum(a: Array, b: Array) -> tuple[Array, Array]:
    """Sum and its rounding error, exactly (Knuth)."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def _product(a: Array, b: Array) -> tuple[Array, Array]:
    """Product and its rounding error, exactly (Dekker's product with Veltkamp's splitting)."""
    product = a * b
    a_high, a_low = _split(a)
    b_high, b_low = _split(b)
    rest = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
    return product, rest


def _split(a: Array) -> tuple[Array, Array]:
    c = 134217729.0 * a  # 2^27 + 1
    high = c - (c - a)
    return high, a - high
