"""Uncertainty of a triad from the distances that its attitudes leave, alike or not.

Where one channel is noisier than the others, the attitudes in which it points up leave more. A
single variance for all of them would promise too much of that channel.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask

_ALONE = 1e-6
"""Share of its own error below which an attitude leaves nothing that tells how large it is."""


class Scatter(NamedTuple):
    """What is left of the attitudes, and how their errors reach the parameters.

    Attributes
    ----------
    left : ndarray, shape (n,)
        Residuals [g].
    reach : ndarray, shape (k, n)
        What an error of 1 g in an attitude does to each parameter.
    basis : ndarray, shape (n, k)
        Orthonormal columns that span the design.
    shapes : ndarray, shape (s, n)
        Variances over the attitudes, up to a factor, for any of which the intervals are to hold.
    """

    left: Array
    reach: Array
    basis: Array
    shapes: Array

    @property
    def dof(self) -> int:
        """Attitudes less parameters."""
        return int(self.basis.shape[0] - self.basis.shape[1])

    def covariance(self) -> Array | None:
        """Covariance of the parameters, shape (k, k); None where nothing is left.

        Notes
        -----
        The estimate HC2 of J. G. MacKinnon and H. White, J. Econometrics 29 (1985) 305: the square
        of each residual, over the share of its own error that it kept. An attitude that kept
        nothing has the mean of all.
        """
        if not self.dof:
            return None
        squares = self.left**2
        mean = np.sum(squares) / self.dof
        variance = np.where(self._told, squares / self._kept, mean)
        return np.asarray(self.reach * variance @ self.reach.T)

    def degrees(self, gradient: Array) -> float:
        """Degrees of freedom of the variance of a function with this gradient, shape (k,).

        Notes
        -----
        Satterthwaite's, as in R. M. Bell and D. F. McCaffrey, Survey Methodology 28 (2002) 169;
        the fewest over the shapes.
        """
        pull = (gradient @ self.reach) ** 2
        alone = np.sum(pull[~self._told]) / self.dof
        weight = np.where(self._told, pull / self._kept, 0.0) + alone
        fewest = min(self._degrees(weight / weight.max(), shape) for shape in self.shapes)
        return float(np.clip(fewest, 1.0, self.dof))

    def _degrees(self, weight: Array, shape: Array) -> float:
        """2 mean^2 / variance of sum(weight left^2), where left = M error, M = 1 - basis basis^T.

        M diag(weight) M = diag(weight) - a b^T needs no matrix of n by n.
        """
        lean = weight[:, None] * self.basis
        lean -= self.basis @ (self.basis.T @ lean) / 2.0
        a, b = np.hstack([self.basis, lean]), np.hstack([lean, self.basis])
        own = weight - np.sum(a * b, axis=1)
        core = b.T @ (shape[:, None] * a)
        squares = np.sum(weight * shape**2 * (2.0 * own - weight)) + np.sum(core * core.T)
        return float((shape @ own) ** 2 / np.maximum(squares, 1e-300))

    @property
    def _told(self) -> Mask:
        return np.asarray(self._kept > _ALONE)

    @property
    def _kept(self) -> Array:
        return np.asarray(np.maximum(1.0 - np.sum(self.basis**2, axis=1), _ALONE))
