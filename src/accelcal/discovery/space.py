"""Where effects are looked for: whitened readings after the base model has taken its part."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.spans import orthonormal, without
from accelcal.errors import InputError


class Space(NamedTuple):
    """What the base model leaves of n readings.

    The coordinates of readings are the n whitened ones without the part that the base model takes.
    They fill n - p dimensions.

    Attributes
    ----------
    whitener : ndarray, shape (n, n)
        Lower triangle, map of readings [g] to readings whose errors are independent, with
        variance 1.
    taken : ndarray, shape (n, p)
        Orthonormal basis of what the base model takes of whitened readings.
    systematic : ndarray, shape (n, b)
        Orthonormal basis of all that repeats in replicates; what is left is pure error.
    """

    whitener: Array
    taken: Array
    systematic: Array

    @property
    def size(self) -> int:
        """Dimensions n - p."""
        return int(self.taken.shape[0] - self.taken.shape[1])

    @property
    def dof(self) -> int:
        """Degrees of freedom of the pure error."""
        return self.size - int(self.systematic.shape[1])

    def nothing(self) -> Array:
        """No coordinates, shape (n, 0), to which others can be joined."""
        return np.empty((self.taken.shape[0], 0))

    def whiten(self, columns: Array) -> Array:
        """Readings or columns [g] with independent errors, shape (n,) or (n, k)."""
        return whitened(self.whitener, columns)

    def left_of(self, whitened: Array) -> Array:
        """Coordinates of whitened readings or columns, shape (n,) or (n, k)."""
        return without(whitened, self.taken)

    def see(self, columns: Array) -> Array:
        """Coordinates of readings or columns [g], shape (n,) or (n, k)."""
        return self.left_of(self.whiten(columns))

    def unwhitened(self, whitened: Array) -> Array:
        """Readings or columns [g] of whitened ones, shape (n,) or (n, k)."""
        from scipy.linalg import solve_triangular  # type: ignore[import-untyped]

        return np.asarray(solve_triangular(self.whitener, whitened, lower=True))

    def variance(self, seen: Array) -> float:
        """Variance of the noise by the pure error of coordinates, shape (n,)."""
        return float(self.pure_error(seen)) / self.dof

    def pure_error(self, seen: Array) -> Array:
        """Sum of squares of the pure error of coordinates, shape (n,) or (n, k)."""
        # not as a difference of squares: a disagreement may be a million times the noise
        return np.asarray((without(seen, self.systematic) ** 2).sum(axis=0))


def whitened(whitener: Array, columns: Array) -> Array:
    """Readings or columns [g] with independent errors, shape (n,) or (n, k); quick by triangles."""
    from scipy.linalg.blas import dtrmm, dtrmv  # type: ignore[import-untyped]

    if not columns.size:
        return columns
    if columns.ndim == 1:
        return np.asarray(dtrmv(whitener, columns, lower=1))
    return np.asarray(dtrmm(1.0, whitener, columns, lower=1))


def whitener_of(covariance: Array, sigma: float) -> Array:
    """Matrix that makes errors of a covariance independent, with variance 1, shape (n, n) [1/g].

    It is the inverse of `root_of` the covariance.
    """
    from scipy.linalg.lapack import dtrtri  # type: ignore[import-untyped]

    inverse, _ = dtrtri(root_of(covariance, sigma), lower=1)  # it has no zero on its diagonal
    return np.asarray(inverse)


def root_of(covariance: Array, sigma: float) -> Array:
    """Matrix that makes errors of a covariance of independent ones, shape (n, n) [g].

    It is sigma [g] times the Cholesky factor of the covariance, which is in units of
    ``sigma ** 2``.

    Raises
    ------
    InputError
        If the covariance is not positive definite in double precision.
    """
    try:
        return np.asarray(sigma * np.linalg.cholesky(covariance))
    except np.linalg.LinAlgError:
        raise InputError(
            f"the declared errors are too large beside a noise of the readings of {sigma:.3g} g;"
            " declare them smaller, or read more digits"
        ) from None


def space_of(whitener: Array, base: Array, repeating: Array) -> Space:
    """Find what the base model leaves.

    Parameters
    ----------
    whitener : ndarray, shape (n, n)
        From `whitener_of`.
    base : ndarray, shape (n, p)
        Derivatives of the base model, of whatever rank [g per unit].
    repeating : ndarray, shape (n, k)
        Columns that take up all that repeats, of whatever rank.
    """
    taken, _ = np.linalg.qr(orthonormal(whitened(whitener, base)))  # to the last digit
    found = Space(whitener, taken, np.empty((len(whitener), 0)))
    return found._replace(systematic=orthonormal(found.see(repeating)))
