"""What both ways to calibrate a triad arrive at: bias and sensitivity with their covariance."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.errors import DesignError
from accelcal.triad.scatter import Scatter

if TYPE_CHECKING:
    from accelcal.triad.clampings import Seats

_WORST = 1e-3
"""Smallest over largest singular value below which attitudes tell nothing of some combination."""

_PART = 0.3
"""Share of the largest entry from which a name belongs to a combination."""


class Design(NamedTuple):
    """How n attitudes tell k parameters."""

    basis: Array  # orthonormal columns that span the design, shape (n, k)
    inverse: Array  # what 1 g in an attitude does to each parameter [g], shape (k, n)
    weakness: tuple[str, ...]  # names of the combination that the attitudes tell worst
    condition: float  # largest over smallest singular value


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
