"""Shift of bias and scale factor from one run to the next, declared or seen in repeated levels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["RunShift", "run_shift"]

Array = NDArray[np.float64]

# Runs whose mean temperatures differ by less than this are at one level [degC].
_SAME_LEVEL = 1.0

# As for the head: half of the variance that other errors explain is taken off the scatter.
_OTHERS_SHARE = 0.5


@dataclass(frozen=True, slots=True)
class RunShift:
    """Standard uncertainty of a quantity from run to run.

    Attributes
    ----------
    uncertainty : float
        Standard uncertainty [g for the bias, relative for the scale factor].
    dof : float
        Degrees of freedom; infinite where declared.
    source : str
        ``"declared"``, ``"estimated"`` or ``"none"``.
    """

    uncertainty: float
    dof: float
    source: str


def run_shift(
    declared: float | None, values: Array, variances: Array, levels: Sequence[float]
) -> RunShift:
    """Take the declared shift, or estimate it from runs at the same temperature.

    Parameters
    ----------
    declared : float or None
        Declared standard uncertainty.
    values : ndarray, shape (runs,)
        The quantity in each run.
    variances : ndarray, shape (runs,)
        Variance that errors new in each run (reading noise) give to it.
    levels : sequence of float
        Temperature of each run [degC]; NaN where unknown.

    Returns
    -------
    RunShift
        Its size and source; ``"none"`` where no level was met twice.

    Examples
    --------
    >>> import numpy as np
    >>> run_shift(None, np.array([1.0, 3.0]), np.zeros(2), [20.0, 20.1]).dof
    1.0
    """
    if declared is not None:
        return RunShift(declared, np.inf, "declared")
    squares = dof = 0.0
    for level in _levels(np.asarray(levels)):
        deviation = values[level] - values[level].mean()
        squares += float(deviation @ deviation)
        dof += level.size - 1
        squares -= _OTHERS_SHARE * float(variances[level].mean()) * (level.size - 1)
    if dof == 0 or np.isnan(squares):
        return RunShift(0.0, np.inf, "none")
    return RunShift(max(squares / dof, 0.0) ** 0.5, dof, "estimated")


def _levels(temperature: Array) -> list[NDArray[np.intp]]:
    """Group the runs by temperature: indices of the runs of each level."""
    order = np.argsort(temperature, kind="stable")
    order = order[~np.isnan(temperature[order])]
    breaks = np.flatnonzero(np.diff(temperature[order]) > _SAME_LEVEL) + 1
    return [group for group in np.split(order, breaks) if group.size]
