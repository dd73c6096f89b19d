"""What both ways to calibrate a triad arrive at: bias and sensitivity with their covariance.

A block is clamped anew for each of its axes that is to lie along the shaft. It then sits a little
turned, in all attitudes of this shaft alike. Such turns leave less in the residuals than they do to
the misalignments, as errors that all attitudes of a shaft share do not average out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.errors import DesignError
from accelcal.estimate.uncertainty import share_taken_off
from accelcal.numerics.probability import f_survival

_WORST = 1e-3
"""Smallest over largest singular value below which attitudes tell nothing of some combination."""

_PART = 0.3
"""Share of the largest entry from which a name belongs to a combination."""


_ALONE = 1e-6
"""Share of its own error below which an attitude leaves nothing that tells how large it is."""


class Design(NamedTuple):
    """How n attitudes tell k parameters."""

    basis: Array  # orthonormal columns that span the design, shape (n, k)
    inverse: Array  # what 1 g in an attitude does to each parameter [g], shape (k, n)
    weakness: tuple[str, ...]  # names of the combination that the attitudes tell worst
    condition: float  # largest over smallest singular value


class Scatter(NamedTuple):
    """What is left of the attitudes, alike or not, and how their errors reach the parameters.

    Where one channel is noisier than the others, the attitudes in which it points up leave more. A
    single variance for all of them would promise too much of that channel.

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


class Solution(NamedTuple):
    """Parameters of a triad.

    Attributes
    ----------
    bias : ndarray, shape (3,)
        Outputs at zero acceleration [output unit].
    sensitivity : ndarray, shape (3, 3)
        S of y = b + S a [output unit per g].
    free : tuple of int
        Which of `NAMES` were estimated.
    covariance : ndarray, shape (k, k), or None
        Of those; None where nothing is left to tell the noise.
    residual : ndarray, shape (n,) or (n, 3)
        What is left: of the length of the acceleration, or of each channel over its scale [g].
    design : Design
        How the attitudes tell the parameters.
    scatter : Scatter or None
        What the attitudes leave, where the variance of each is its own.
    freedom : ndarray, shape (k,), or None
        Degrees of freedom of the variance of each parameter, where they are not those of all.
    noise_untold : bool
        Whether errors of attitudes that some parameters do not feel may be most of what is left.
    seats : Seats or None
        How the block sits on its shafts, where attitudes are known.
    """

    bias: Array
    sensitivity: Array
    free: tuple[int, ...]
    covariance: Array | None
    residual: Array
    design: Design
    scatter: Scatter | None = None
    freedom: Array | None = None
    noise_untold: bool = False
    seats: Seats | None = None

    @property
    def dof(self) -> int:
        """Degrees of freedom of the residuals."""
        return len(self.design.basis) - len(self.design.inverse)

    @property
    def leverage(self) -> Array:
        """Part of its own residual that each attitude has fitted away, shape (n,)."""
        return np.asarray(np.sum(self.design.basis**2, axis=1))

    @property
    def rms(self) -> float:
        """Root mean square of the residuals [g]."""
        return float(np.sqrt(np.mean(self.residual**2)))

    def degrees(self, gradient: Array) -> float:
        """Degrees of freedom of a function of the parameters with this gradient, shape (k,).

        Where each parameter has its own, their harmonic mean by the shares of the variance.
        """
        if self.scatter is not None:
            return self.scatter.degrees(gradient)
        if self.freedom is None or self.covariance is None:
            return float(self.dof)
        share = gradient**2 * np.diagonal(self.covariance)
        return float(share.sum() / (share @ (1.0 / self.freedom)))


def design_of(matrix: Array, names: tuple[str, ...], remedy: str) -> Design:
    """Refuse attitudes that leave a combination of parameters open; else tell the worst one.

    The matrix, shape (n, k), has the derivatives of the outputs [g] by the named parameters, in g;
    the remedy is what would tell them.

    Raises
    ------
    DesignError
        If the design has not full rank.
    """
    basis, values, directions = np.linalg.svd(matrix, full_matrices=False)
    open_ = values < _WORST * values[0]
    worst = np.linalg.norm(directions[-max(1, int(open_.sum())) :], axis=0)
    told = tuple(n for n, part in zip(names, worst, strict=True) if part > _PART * worst.max())
    if open_.any():
        raise DesignError(
            f"{len(matrix)} attitudes do not tell {', '.join(told)}"
            f"{' apart' if len(told) > 1 else ''}; {remedy}"
        )
    inverse = directions.T / values @ basis.T
    return Design(basis, inverse, told, float(values[0] / values[-1]))


_ROUNDING = 1e-6

_LEAST = 2.0
"""Degrees of freedom that each channel keeps beside the turns, or nothing tells them apart."""


class Seats(NamedTuple):
    """Turns of the block on its shafts, and what is left without them.

    Attributes
    ----------
    left : ndarray, shape (n, 3)
        Residuals of the channels without the turns [g].
    freedom : ndarray, shape (3,)
        Their degrees of freedom, of each channel.
    size : float
        Standard deviation of a turn about each axis [rad]; 0 where nothing tells it.
    dof : float
        Its degrees of freedom.
    chance : float or None
        That the noise leaves as much (F test); None where nothing tells it.
    reach : ndarray, shape (3, 4, 3 m)
        What a turn of 1 rad about each axis on each of m shafts does to bias and sensitivity of the
        channels, over the scale factors.
    """

    left: Array
    freedom: Array
    size: float
    dof: float
    chance: float | None
    reach: Array

    @property
    def covariance(self) -> Array:
        """That of bias and sensitivity by the turns, over the scale factors, shape (12, 12)."""
        flat = self.reach.reshape(12, -1)
        return np.asarray(self.size**2 * flat @ flat.T)


def seats_of(
    residual: Array, axes: Array, up: Array, shaft: tuple[str, ...] | None, design: Design
) -> Seats:
    """Find how far the block is turned on its shafts, of which nothing tells what all have alike.

    Residuals of the channels, shape (n, 3) [g], sensitive axes of length 1, shape (3, 3), and the
    acceleration along the axes of the block, shape (n, 3) [g], belong to attitudes on shafts, where
    these are known, that tell bias and sensitivity by their design. The turns are of size 0 where
    there is one shaft, or too little is left to tell them.

    Notes
    -----
    A turn r moves a channel with the axis u by u (r x a) = r (a x u). With C the coefficients of
    what the residuals show of the turns, S the singular values that belong to them and N the
    squares that noise makes of each (by attitudes, whose errors move all channels), the size is the
    root of sum(C^2 - N q / (q + 6)) / sum(S^2) for q coefficients, 0 where that is negative; of
    one coefficient N is not taken off, see `accelcal.estimate.uncertainty.share_taken_off`.
    """
    n, names = len(up), sorted(set(shaft or ()))
    plain = Seats(residual, np.full(3, n - 4.0), 0.0, 1.0, None, np.zeros((3, 4, 0)))
    if len(names) < 2:
        return plain
    on = np.equal.outer(np.array(shaft), np.array(names)).astype(np.float64)
    moved = np.cross(up[None], axes[:, None])[:, :, None, :] * on[None, :, :, None]
    moved = moved.reshape(3, n, -1)
    shown = moved - design.basis @ (design.basis.T @ moved)
    basis, size, _ = np.linalg.svd(shown.reshape(3 * n, -1), full_matrices=False)
    told = size > _ROUNDING
    size, basis = size[told], basis[:, told].reshape(3, n, -1)
    freedom = plain.freedom - np.sum(basis**2, axis=(1, 2))
    if freedom.min() < _LEAST or not told.any():
        return plain
    found = np.einsum("cij,ic->j", basis, residual)
    left = residual - np.einsum("cij,j->ic", basis, found)
    ways, whole = size.size, float(freedom.sum())
    noise = np.sum(np.einsum("cij,ic->ij", basis, left) ** 2, axis=0) * 3 * n / whole
    squares = found @ found - noise.sum() * share_taken_off(ways)
    return Seats(
        left,
        freedom,
        float(np.sqrt(max(squares, 0.0) / (size @ size))),
        float((size @ size) ** 2 / np.sum(size**4)),
        f_survival(float(found @ found / max(noise.sum(), 1e-300)), ways, whole),
        design.inverse @ moved,
    )
