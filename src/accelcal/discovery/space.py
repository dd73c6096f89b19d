"""Where effects are looked for: whitened readings after the base model has taken its part.

They are whitened by the covariance of their errors. The noise of a run is an AR(1) process, in
which a reading hangs on the one before it alone, and errors that readings share have few columns.
So nothing here takes a matrix of readings by readings.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Ints, Mask
from accelcal.discovery.columns import lengths, orthonormal, without
from accelcal.errors import InputError


class Covariance(NamedTuple):
    """Covariance of the errors of n readings."""

    noise: Array  # standard deviation of the noise of each reading, (n,) [g]
    rho: float  # correlation of the noise of one reading with that of the next in its run
    run: Ints  # run of each reading, (n,)
    number: Ints  # its number in the order of measuring, (n,)
    shared: Array
    """What each of u errors of readings together does, of one standard deviation, (n, u) [g]."""

    def among(self, own: Mask) -> Covariance:
        """That of some of the readings."""
        return Covariance(
            self.noise[own], self.rho, self.run[own], self.number[own], self.shared[own]
        )

    def with_shared(self, columns: Array) -> Covariance:
        """That of readings that share other errors too, shape (n, k) [g]."""
        return self._replace(shared=np.hstack([self.shared, columns]))


class Whitener(NamedTuple):
    """Map of readings to such whose errors are independent, with variance 1, and back."""

    order: Ints  # readings of one run after the other, in the order of measuring, (n,)
    passed: Array  # part of the noise of the reading before, in this order, that each has too, (n,)
    new: Array  # standard deviation of the rest of its noise, (n,) [g]
    basis: Array  # orthonormal basis of the shared errors, where the noise is independent, (n, u)
    stretch: Array  # standard deviation of all errors along it, (u,)

    def whitened(self, columns: Array) -> Array:
        """Readings or columns [g] with independent errors, shape (n,) or (n, k)."""
        return self._stretched(self._alone(columns), 1.0 / self.stretch)

    def unwhitened(self, columns: Array) -> Array:
        """Readings or columns [g] of whitened ones, shape (n,) or (n, k)."""
        from scipy.linalg.lapack import dtbtrs  # type: ignore[import-untyped]

        stretched = self._stretched(columns, self.stretch)
        own = stretched.reshape(self.order.size, -1)[self.order] * self.new[:, None]
        if self.passed.any():
            band = np.stack([np.ones_like(self.passed), -np.roll(self.passed, -1)])
            own, _ = dtbtrs(band, own, uplo="L", diag="U")
        found = np.empty_like(own)
        found[self.order] = own
        return found.reshape(columns.shape)

    def transposed(self, columns: Array) -> Array:
        """Columns, shape (n, k), by the transpose of the map that whitens [1/g]."""
        own = self._stretched(columns, 1.0 / self.stretch)[self.order] / self.new[:, None]
        own[:-1] -= self.passed[1:, None] * own[1:]
        found = np.empty_like(own)
        found[self.order] = own
        return found

    def _alone(self, columns: Array) -> Array:
        """Columns whose noise is independent; the shared errors stay in them."""
        own = columns.reshape(self.order.size, -1)[self.order]
        if self.passed.any():
            own[1:] -= self.passed[1:, None] * own[:-1]
        found = np.empty_like(own)
        found[self.order] = own / self.new[:, None]
        return found.reshape(columns.shape)

    def _stretched(self, columns: Array, by: Array) -> Array:
        along = self.basis.T @ columns
        return np.asarray(columns + self.basis @ ((by - 1.0) * along.T).T)


def whitener_of(covariance: Covariance) -> Whitener:
    """Find what makes errors of a covariance independent, with variance 1.

    Raises
    ------
    InputError
        If the shared errors are so large that double precision loses the noise beside them.

    Notes
    -----
    With the noise made independent, the shared errors V leave the covariance I + V V'. By the
    singular values s of V it is 1 + s^2 along its left singular vectors, and 1 beside them.
    """
    noise, number = covariance.noise, covariance.number
    order = np.lexsort((number, covariance.run))
    in_one_run = np.diff(covariance.run[order]) == 0
    apart = np.append(np.inf, np.where(in_one_run, np.diff(number[order]), np.inf))
    alike = covariance.rho**apart
    sizes = noise[order]
    own = Whitener(
        order=order,
        passed=alike * sizes / np.roll(sizes, 1),
        new=sizes * np.sqrt(1.0 - alike**2),
        basis=np.empty((noise.size, 0)),
        stretch=np.empty(0),
    )
    if not covariance.shared.size:
        return own
    basis, sizes, _ = np.linalg.svd(own.whitened(covariance.shared), full_matrices=False)
    if not sizes.max() ** 2 * np.finfo(float).eps < 1.0:
        raise InputError(
            "the declared errors are too large beside a noise of the readings of"
            f" {np.sqrt(np.mean(noise**2)):.3g} g; declare them smaller, or read more digits"
        )
    return own._replace(basis=basis, stretch=np.sqrt(1.0 + sizes**2))


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
