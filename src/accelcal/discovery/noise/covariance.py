"""Covariance of the errors of readings: noise with a memory, and errors that readings share.

The noise of a run is an AR(1) process, in which a reading hangs on the one before it alone, and
what readings share has few columns. So nothing here takes a matrix of readings by readings.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Ints, Mask
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
