"""How a block that is turned about several shafts sits on each: one error for all its attitudes.

A block is clamped anew for each of its axes that is to lie along the shaft. It then sits a little
turned, in all attitudes of this shaft alike. Such turns leave less in the residuals than they do to
the misalignments, as errors that all attitudes of a shaft share do not average out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.estimate.uncertainty import share_taken_off
from accelcal.numerics.probability import f_survival
from accelcal.triad.solution import Design

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
