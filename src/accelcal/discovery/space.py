"""Where effects are looked for: whitened readings after the base model has taken its part."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.discovery.columns import lengths, orthonormal, without
from accelcal.discovery.noise.covariance import Whitener

VISIBLE = 0.01
"""Part of an effect that the base model must leave for the effect to be looked for."""


class Space(NamedTuple):
    """What the base model leaves of n readings.

    The coordinates of readings are the n whitened ones without the part that the base model takes.
    They fill n - p dimensions.
    """

    whitener: Whitener
    """Map of readings [g] to readings whose errors are independent, with variance 1."""
    taken: Array  # orthonormal basis of what the base model takes of whitened readings, (n, p)
    systematic: Array
    """Orthonormal basis of all that repeats in replicates; what is left is pure error, (n, b)."""

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
        return self.whitener.whitened(columns)

    def left_of(self, whitened: Array) -> Array:
        """Coordinates of whitened readings or columns, shape (n,) or (n, k)."""
        return without(whitened, self.taken)

    def see(self, columns: Array) -> Array:
        """Coordinates of readings or columns [g], shape (n,) or (n, k)."""
        return self.left_of(self.whiten(columns))

    def shown(self, columns: Array, beside: Array | None = None) -> tuple[Array, Mask]:
        """Coordinates of columns [g], shape (n, k), and of which of them enough is left to be seen.

        They are without the part that an orthonormal basis beside the base model takes, (n, h).
        """
        whitened = self.whiten(columns)
        left = self.left_of(whitened)
        left = left if beside is None else without(left, beside)
        return left, lengths(left) > VISIBLE * lengths(whitened)

    def unwhitened(self, whitened: Array) -> Array:
        """Readings or columns [g] of whitened ones, shape (n,) or (n, k)."""
        return self.whitener.unwhitened(whitened)

    def variance(self, seen: Array) -> float:
        """Variance of the noise by the pure error of coordinates, shape (n,)."""
        return float(self.pure_error(seen)) / self.dof

    def pure_error(self, seen: Array) -> Array:
        """Sum of squares of the pure error of coordinates, shape (n,) or (n, k)."""
        # not as a difference of squares: a disagreement may be a million times the noise
        return np.asarray((without(seen, self.systematic) ** 2).sum(axis=0))


def space_of(whitener: Whitener, base: Array, repeating: Array) -> Space:
    """Find what the base model leaves of n readings.

    Its derivatives, shape (n, p) [g per unit], and columns that take up all that repeats, shape
    (n, k), are of whatever rank.
    """
    taken, _ = np.linalg.qr(orthonormal(whitener.whitened(base)))  # to the last digit
    found = Space(whitener, taken, np.empty((len(base), 0)))
    return found._replace(systematic=orthonormal(found.see(repeating)))
