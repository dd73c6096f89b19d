"""Sums and products together with their rounding errors.

References
----------
T. Ogita, S. M. Rump, S. Oishi, "Accurate sum and dot product", SIAM J. Sci. Comput. 26 (2005)
1955-1988.
"""

from __future__ import annotations

from accelcal.arrays import Array

_HALF_OF_THE_BITS = 2.0**27 + 1.0


def two_sum(a: Array, b: Array) -> tuple[Array, Array]:
    """Sum and its rounding error, exactly (Knuth); the shapes broadcast.

    Examples
    --------
    >>> import numpy as np
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
    >>> import numpy as np
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
