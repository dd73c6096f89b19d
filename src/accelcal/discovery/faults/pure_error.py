"""Pure error of the readings: what their replicates contradict, whatever the model.

What physics does to replicates is taken out first: the cycles of a run may differ in bias, in scale
factor and in misalignment, as drifts and a tilt of the foundation make them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array, Mask
from accelcal.discovery.columns import cycle, dummies, saturated
from accelcal.discovery.spans import orthonormal
from accelcal.effects.conditions import Conditions
from accelcal.geometry import head_positions

TELLING = 0.05
"""Share of its own error that a reading must leave for its replicates to judge it."""


class PureError(NamedTuple):
    """What some columns leave of n readings.

    Attributes
    ----------
    projector : ndarray, shape (n, n)
        Projector on what is left.
    residual : ndarray, shape (n,)
        What is left of the readings [g].
    """

    projector: Array
    residual: Array

    @property
    def free(self) -> Array:
        """Share of each reading's own error that is left, shape (n,)."""
        return np.maximum(np.diagonal(self.projector), 0.0)

    @property
    def dof(self) -> float:
        """Degrees of freedom."""
        return float(np.round(np.trace(self.projector)))

    @property
    def squares(self) -> float:
        """Sum of the squared residuals [g^2]."""
        return float(self.residual @ self.residual)

    @property
    def telling(self) -> Mask:
        """Readings that their replicates judge, shape (n,)."""
        return self.free > TELLING

    @property
    def scaled(self) -> Array:
        """Residuals with the variance of a reading; zero where nothing tells [g]."""
        return np.where(self.telling, self.residual / np.sqrt(np.maximum(self.free, TELLING)), 0.0)

    def gains(self, columns: Array) -> Array:
        """Squares that each of some columns would take, shape (k,) for (n, k) [g^2]."""
        part = self.projector @ columns
        length = (columns * part).sum(axis=0)
        seen = length > TELLING**2 * (columns**2).sum(axis=0)
        return np.where(seen, (columns.T @ self.residual) ** 2 / np.where(seen, length, 1.0), 0.0)

    def without(self, column: Array) -> PureError:
        """Take a column out, too."""
        part = self.projector @ column
        length = float(column @ part)
        if not length > 1e-9 * float(column @ column):
            return self
        projector = self.projector - np.outer(part, part / length)
        return PureError(projector, self.residual - part * float(column @ self.residual) / length)

    def changed(self, change: Array) -> PureError:
        """The same with readings changed [g]."""
        return self._replace(residual=self.residual + self.projector @ change)


def pure_error(readings: Array, columns: Array) -> PureError:
    """Find what columns of whatever rank, shape (n, k), leave of n readings [g]."""
    basis = orthonormal(columns)
    projector = np.eye(readings.size) - basis @ basis.T
    return PureError(projector, projector @ (projector @ readings))  # twice, against rounding


def moving(c: Conditions, mounting: NDArray[np.str_]) -> Array:
    """Columns of all that repeats, and of cycles that differ as by a drift, shape (n, k)."""
    cycles = dummies(c.run, cycle(c))
    return np.hstack([saturated(c, mounting), cycles * c.input[:, None], cycles * c.cross[:, None]])


def smooth(c: Conditions, mounting: NDArray[np.str_]) -> Array:
    """Columns of a looser view, in which back strokes are replicates, too, shape (n, k).

    Run x head position, a straight drift in each run, and a difference of the two senses in bias,
    scale factor and misalignment. A step within a run is left.
    """
    runs = dummies(c.run)
    senses = runs * c.rotation[:, None]
    return np.hstack(
        [
            dummies(c.run, mounting, head_positions(c.angle)),
            runs * c.run_time[:, None],
            senses,
            senses * c.input[:, None],
            senses * c.cross[:, None],
        ]
    )


def pooled(c: Conditions, mounting: NDArray[np.str_]) -> Array:
    """Columns of a view in which runs are replicates but for six coefficients, shape (n, k).

    Position x sense of rotation of all runs together, the cycles of each run, and for each run the
    six coefficients of a table. It leaves more of each reading's own error than one run.
    """
    runs = dummies(c.run)
    x, cross = c.input, c.cross
    columns = [runs * part[:, None] for part in (x, x**2, x**3, cross, cross * x)]
    cells = dummies(mounting, np.round(c.angle, 6), c.rotation)
    return np.hstack([cells, dummies(c.run, cycle(c)), *columns])
