"""Where effects are looked for: whitened readings after the base model has taken its part."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.spans import orthonormal, without
from accelcal.errors import InputError


class Space(NamedTuple):
    """The m dimensions of n readings that the base model leaves.

    Attributes
    ----------
    whitener : ndarray, shape (n, n)
        Map of readings [g] to readings whose errors are independent, with variance 1.
    rotation : ndarray, shape (n, m)
        Orthonormal basis of what the base model leaves of whitened readings.
    systematic : ndarray, shape (m, b)
        Orthonormal basis of all that repeats in replicates; what is left is pure error.
    """

    whitener: Array
    rotation: Array
    systematic: Array

    @property
    def size(self) -> int:
        """Dimensions m."""
        return int(self.systematic.shape[0])

    @property
    def dof(self) -> int:
        """Degrees of freedom of the pure error."""
        return self.size - int(self.systematic.shape[1])

    def see(self, columns: Array) -> Array:
        """Coordinates of readings or columns [g], shape (m,) or (m, k)."""
        return np.asarray(self.rotation.T @ (self.whitener @ columns))

    def variance(self, seen: Array) -> float:
        """Variance of the noise by the pure error of coordinates, shape (m,)."""
        return float(self.pure_error(seen)) / self.dof

    def pure_error(self, seen: Array) -> Array:
        """Sum of squares of the pure error of coordinates, shape (m,) or (m, k)."""
        # not as a difference of squares: a disagreement may be a million times the noise
        return np.asarray((without(seen, self.systematic) ** 2).sum(axis=0))


def whitener_of(covariance: Array, sigma: float) -> Array:
    """Matrix that makes errors of a covariance independent, with variance 1, shape (n, n) [1/g].

    It is the inverse of the Cholesky factor of the covariance, which is in units of ``sigma ** 2``,
    over sigma [g].

    Raises
    ------
    InputError
        If the covariance is not positive definite in double precision.
    """
    from scipy.linalg import solve_triangular  # type: ignore[import-untyped]

    try:
        lower = np.linalg.cholesky(covariance)
    except np.linalg.LinAlgError:
        raise InputError(
            f"the declared errors are too large beside a noise of the readings of {sigma:.3g} g;"
            " declare them smaller, or read more digits"
        ) from None
    return np.asarray(solve_triangular(lower, np.eye(lower.shape[0]), lower=True)) / sigma


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
    taken = orthonormal(whitener @ base)
    full, _ = np.linalg.qr(taken, mode="complete")
    rotation = full[:, taken.shape[1] :]
    return Space(whitener, rotation, orthonormal(rotation.T @ (whitener @ repeating)))
