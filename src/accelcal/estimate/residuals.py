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

from accelcal.arrays import Array
from accelcal.estimate.replicates import MEMORY

# A solution in multiples of its size / 2^23 and a design in multiples of 2^-24 have a product of
# up to 49 bits, so that it is exact in the 53 bits of a number, in whatever order it is summed.
_CUT_SOLUTION = 2.0**30
_CUT_DESIGN = 2.0**24

_HALF_OF_THE_BITS = 2.0**27 + 1.0


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
        """Round solutions to the few bits that `subtract_fit` needs, shape (p, T)."""
        rounded = np.abs(solution, out=MEMORY.array("near", solution.shape))
        anchor = np.maximum.reduce(rounded, axis=0)
        anchor *= _CUT_SOLUTION
        np.add(solution, anchor, out=rounded)
        rounded -= anchor
        return rounded

    def subtract_fit(self, y: Array, solution: Array) -> Array:
        """Turn y, shape (n, T), into y - matrix @ solution for solutions of `near`.

        The first product is exact, and so is its difference to a y that it is close to.
        """
        for part in self:
            y -= np.matmul(part, solution, out=MEMORY.array("fit", y.shape))
        return y


def twice_precise_residual(y: Array, r: Array, matrix: Array, x: Array) -> Array:
    """Return y - r - matrix @ x, shape (..., n), as if summed in twice the working precision.

    The matrix is of shape (n, p).

    Examples
    --------
    >>> import numpy as np
    >>> tenth = np.array([0.1])
    >>> twice_precise_residual(np.array([1.0]), np.array([0.0]), tenth[:, None], np.array([10.0]))
    array([-5.55111512e-17])
    """
    total, rest = two_sum(y, -r)
    for column, factor in zip(matrix.T, np.moveaxis(x, -1, 0), strict=True):
        product, error = two_product(column, factor[..., None])
        total, lost = two_sum(total, -product)
        rest = rest + (lost - error)
    return np.asarray(total + rest)


# -- sums and products together with their rounding errors ---------------------------------------


def two_sum(a: Array, b: Array) -> tuple[Array, Array]:
    """Sum and its rounding error, exactly (Knuth); the shapes broadcast.

    Examples
    --------
    >>> [part.tolist() for part in two_sum(np.array([1.0]), np.array([2.0**-60]))]
    [[1.0], [8.673617379884035e-19]]
    """
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def two_product(a: Array, b: Array) -> tuple[Array, Array]:
    """Product and its rounding error, exactly (Dekker's product with Veltkamp's splitting).

    The factors are of less than 1e299 in size, in shapes that broadcast.

    Examples
    --------
    >>> [part.tolist() for part in two_product(np.array([0.1]), np.array([10.0]))]
    [[1.0], [5.551115123125783e-17]]
    """
    product = a * b
    (a_high, a_low), (b_high, b_low) = _split(a), _split(b)
    error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
    return product, error


def _split(a: Array) -> tuple[Array, Array]:
    """Sum of two numbers of half the bits."""
    scaled = _HALF_OF_THE_BITS * a
    high = scaled - (scaled - a)
    return high, a - high
