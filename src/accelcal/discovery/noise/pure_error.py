"""Pure error of the readings: what their replicates contradict, whatever the model.

What physics does to replicates is taken out first: the cycles of a run may differ in bias, in scale
factor and in misalignment, as drifts and a tilt of the foundation make them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array, Ints, Mask, Places
from accelcal.discovery.columns import cycle, dummies, following, saturated
from accelcal.discovery.spans import orthonormal, without
from accelcal.effects.conditions import Conditions
from accelcal.head_angles import head_positions

TELLING = 0.05
"""Share of its own error that a reading must leave for its replicates to judge it."""

_SETTLING = 0.05
"""Time constant that stands for those of warm-ups that the cycles leave, over the longest run."""


class PureError(NamedTuple):
    """What some columns leave of n readings."""

    taken: Array  # orthonormal basis of the columns, (n, k)
    residual: Array  # what is left of the readings, (n,) [g]

    @property
    def free(self) -> Array:
        """Share of each reading's own error that is left, shape (n,)."""
        return np.asarray(np.maximum(1.0 - (self.taken**2).sum(axis=1), 0.0))

    @property
    def dof(self) -> float:
        """Degrees of freedom."""
        return float(self.residual.size - self.taken.shape[1])

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

    def shared(self, one: Places | int, other: Places | int) -> Array:
        """Share of the errors of some readings that is left in others, element by element."""
        own = np.asarray(np.equal(one, other), dtype=np.float64)
        return np.asarray(own - (self.taken[one] * self.taken[other]).sum(axis=-1))

    def among(self, readings: Sequence[int]) -> Array:
        """Shares of the errors of k readings that are left in each other, shape (k, k)."""
        own = np.array(readings, dtype=np.intp)
        return self.shared(own[:, None], own)

    def gains(self, columns: Array) -> Array:
        """Squares that each of some columns would take, shape (k,) for (n, k) [g^2]."""
        whole = (columns**2).sum(axis=0)
        return _gains(whole, self.taken.T @ columns, columns.T @ self.residual)

    def gains_of_steps(self, own: Ints, weight: Array) -> Array:
        """The same of steps, each from one of some readings on, in their order, but the first.

        The weights, shape (n,), are what a step of size 1 does to the readings.
        """

        def behind(values: Array) -> Array:
            return np.asarray(np.cumsum(values[:0:-1], axis=0)[::-1])

        steps = weight[own]
        taken = behind(steps[:, None] * self.taken[own])
        return _gains(behind(steps**2), taken.T, behind(steps * self.residual[own]))

    def without(self, column: Array) -> PureError:
        """Take a column out, too."""
        part = without(without(column, self.taken), self.taken)  # twice, against rounding
        squares = float(part @ part)
        if not squares > 1e-9 * float(column @ column):
            return self
        taken = np.column_stack([self.taken, part / np.sqrt(squares)])
        return PureError(taken, without(self.residual, taken[:, -1:]))

    def changed(self, change: Array) -> PureError:
        """The same with readings changed [g]."""
        return self._replace(residual=self.residual + without(change, self.taken))


def _gains(whole: Array, taken: Array, products: Array) -> Array:
    """Squares that columns would take, by their own, their part in a basis and with the rest."""
    length = whole - (taken**2).sum(axis=0)
    seen = length > TELLING**2 * whole
    return np.where(seen, products**2 / np.where(seen, length, 1.0), 0.0)


def pure_error(readings: Array, columns: Array) -> PureError:
    """Find what columns of whatever rank, shape (n, k), leave of n readings [g]."""
    taken = orthonormal(columns)
    left = without(without(readings, taken), taken)  # twice, against rounding
    return PureError(taken, left)


def moving(c: Conditions, mounting: NDArray[np.str_]) -> Array:
    """Columns of all that repeats, and of cycles that differ as by a drift, shape (n, k)."""
    return np.hstack([saturated(c, mounting), *_by_angle(dummies(c.run, cycle(c)), c)])


def tilting(c: Conditions, mounting: NDArray[np.str_]) -> Array:
    """The same with what changes within a cycle, shape (n, k).

    That is a drift of scale factor and misalignment by the time: where the pace is not even, a tilt
    is another pattern in each cycle. A warm-up is, at the start of each run. And the first reading
    of a run is no replicate of others, as the head may come to it in another sense.
    """
    runs = dummies(c.run)
    drifts = runs * c.run_time[:, None]
    length = max(float(c.run_time.max()), 1e-9)
    settling = runs * np.exp(-c.run_time / (_SETTLING * length))[:, None]
    first = c.order[np.diff(c.run[c.order], prepend=-1) != 0]
    begun = np.asarray(np.arange(c.order.size)[:, None] == first, dtype=np.float64)
    return np.hstack([moving(c, mounting), begun, settling, *_by_angle(drifts, c)])


def _by_angle(columns: Array, c: Conditions) -> tuple[Array, Array]:
    """Columns that act on the scale factor, and on the misalignment."""
    return columns * c.input[:, None], columns * c.cross[:, None]


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
            following(c),
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
    return np.hstack([cells, dummies(c.run, cycle(c)), *columns, following(c)])
