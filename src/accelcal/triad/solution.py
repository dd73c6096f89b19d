"""What both ways to calibrate a triad arrive at: bias and sensitivity with their covariance."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.errors import DesignError
from accelcal.triad.record import AXES

NAMES = (*(f"b_{i}" for i in AXES), *(f"S_{i}{j}" for i in AXES for j in AXES))
"""Bias of each channel, and its sensitivity to the acceleration along each axis of the block."""

_WORST = 1e-3
"""Smallest over largest singular value below which attitudes tell nothing of some combination."""

_PART = 0.3
"""Share of the largest entry from which a name belongs to a combination."""


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
    dof : int
        Degrees of freedom of the covariance.
    residual : ndarray, shape (n,) or (n, 3)
        What is left: of the length of the acceleration, or of each channel over its scale [g].
    leverage : ndarray, shape (n,)
        Part of its own residual that each attitude has fitted away.
    weakness : tuple of str
        Names of the combination that the attitudes tell worst.
    condition : float
        Largest over smallest singular value of the design in units of g.
    """

    bias: Array
    sensitivity: Array
    free: tuple[int, ...]
    covariance: Array | None
    dof: int
    residual: Array
    leverage: Array
    weakness: tuple[str, ...]
    condition: float

    @property
    def rms(self) -> float:
        """Root mean square of the residuals [g]."""
        return float(np.sqrt(np.mean(self.residual**2)))


def refuse_rank(
    design: Array, names: tuple[str, ...], remedy: str
) -> tuple[tuple[str, ...], float]:
    """Refuse attitudes that leave a combination of parameters open; else tell the worst one.

    Parameters
    ----------
    design : ndarray, shape (n, k)
        Derivatives of the residuals [g] by the parameters, in g.
    names : tuple of str
        Names of the parameters.
    remedy : str
        What would tell them.

    Returns
    -------
    weakness : tuple of str
        Names of the worst combination.
    condition : float
        Largest over smallest singular value.

    Raises
    ------
    DesignError
        If the design has not full rank.
    """
    _, found, directions = np.linalg.svd(design, full_matrices=True)
    values = np.pad(found, (0, len(names) - found.size))
    open_ = values < _WORST * values[0]
    worst = np.linalg.norm(directions[-max(1, int(open_.sum())) :], axis=0)
    told = tuple(n for n, part in zip(names, worst, strict=True) if part > _PART * worst.max())
    if open_.any():
        raise DesignError(
            f"{len(design)} attitudes do not tell {', '.join(told)}"
            f"{' apart' if len(told) > 1 else ''}; {remedy}"
        )
    return told, float(values[0] / values[-1])
