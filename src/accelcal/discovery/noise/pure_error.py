"""Pure error of the readings: what their replicates contradict, whatever the model.

What physics does to replicates is taken out first: the cycles of a run may differ in bias, in scale
factor and in misalignment, as drifts and a tilt of the foundation make them.

The noise may differ from run to run, as where the chamber blows harder. As if it were alike, a
quiet run would look like one without noise, and a noisy one like a disturbance. Outliers are to be
set aside before: one is smeared over all readings of its run.

References
----------
G. E. P. Box, "Non-normality and tests on variances", Biometrika 40 (1953) 318: what tails do to
the test of Bartlett.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array, Ints, Mask, Places
from accelcal.discovery.columns import cycle, dummies, following, orthonormal, saturated, without
from accelcal.discovery.noise.of_readings import in_units_of
from accelcal.effects.conditions import Conditions
from accelcal.estimate.uneven_noise import differ
from accelcal.head_angles import head_positions
from accelcal.numerics.grouping import distinct
from accelcal.numerics.probability import f_survival

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


_SIGNIFICANT = 1e-3
_MUCH = 1.5
"""Ratio of the largest noise to the smallest one below which all count as alike."""

_UNEVEN = 0.2
"""Chance that strokes scatter so differently, below which the run is not noisy but disturbed."""

_SLOW = 2.5
"""Standard deviations by which neighbours must be alike for the scatter to go with the time."""

_FEWEST = 6
"""Degrees of freedom of a run that tell its noise; with fewer it has that of the others."""

TOO_LOUD = 9.0
"""Scatter of a run over that of the others from which it is no noise to be weighted by: with two
cycles, nothing tells the noise of a run from what acts in it for a time."""


class LoudRun(NamedTuple):
    """The run with the largest scatter beside all others."""

    run: int  # which one
    ratio: float  # its scatter over that of the others
    p_value: float  # chance that any of so many runs of equal noise scatters so much more
    squares: float  # sum of squares of its pure error [g^2]


def with_noise_of_runs(
    c: Conditions, residual: Array, all_that_repeats: Array, relative: Array | None, step: float
) -> Array | None:
    """Give the readings of each run the noise that its replicates tell, where the runs differ.

    The residuals, shape (n,) [g], are those of some model that is the same for replicates, all that
    repeats is that of `accelcal.discovery.columns.saturated`, and the relative noise that by their
    std; None where alike. Readings whose scatter is smaller than their step [g] scatter by that
    alone. The noise stays the same where runs are alike, and where the scatter of a noisy one is no
    noise: where it is of some strokes, or neighbours are alike, or it is nine times that of the
    others.

    Notes
    -----
    By the test of Bartlett, the degrees of freedom over 1 + half the excess kurtosis. The medians
    must differ too, as one outlier makes no noisy run.
    """
    places, runs = _runs(c, residual, all_that_repeats, relative)
    told = [run for run in runs if run.is_told]
    if len(told) < 2 or not _differ(told) or _loudest(runs).ratio > TOO_LOUD:
        return relative
    quietest = min(run.variance for run in told)
    if any(run.variance > _MUCH**2 * quietest and run.is_disturbed() for run in told):
        return relative
    pooled = _pooled(told)
    if step**2 > pooled:
        return relative
    size = np.ones(c.run.size) if relative is None else relative.copy()
    for own, run in zip(places, runs, strict=True):
        size[own] *= np.sqrt(run.variance if run.is_told else pooled)
    return np.asarray(size / np.sqrt(np.mean(size**2)))


def loud_run(
    c: Conditions, residual: Array, all_that_repeats: Array, relative: Array | None, step: float
) -> LoudRun | None:
    """Find the run that scatters most beside the others, of the same as `with_noise_of_runs`.

    There is none where the replicates of fewer than two runs tell their noise, or by a step alone.
    """
    runs = _runs(c, residual, all_that_repeats, relative)[1]
    told = [run for run in runs if run.is_told]
    return None if len(told) < 2 or step**2 > _pooled(told) else _loudest(runs)


def _pooled(runs: Sequence[_RunError]) -> float:
    return sum(run.pure.squares for run in runs) / sum(run.pure.dof for run in runs)


def _runs(
    c: Conditions, residual: Array, all_that_repeats: Array, relative: Array | None
) -> tuple[list[Ints], list[_RunError]]:
    """Readings of each run in the order of measuring, and their pure error."""
    error = in_units_of(relative, residual)
    columns = in_units_of(relative, all_that_repeats)
    places = [c.order[c.run[c.order] == each] for each in distinct(c.run).tolist()]
    runs = [_RunError(pure_error(error[own], columns[own]), c.stroke[own]) for own in places]
    return places, runs


def _loudest(runs: Sequence[_RunError]) -> LoudRun:
    """That with the largest scatter of several that tell their noise."""
    loudest = max((run.variance, i) for i, run in enumerate(runs) if run.is_told)[1]
    own = runs[loudest]
    others = [run for i, run in enumerate(runs) if run.is_told and i != loudest]
    dof = sum(run.pure.dof for run in others)
    ratio = own.variance / (sum(run.pure.squares for run in others) / dof)
    chance = min(1.0, (len(others) + 1) * f_survival(ratio, own.pure.dof, dof))
    return LoudRun(loudest, float(np.sqrt(ratio)), chance, own.pure.squares)


class _RunError(NamedTuple):
    """Pure error of one run in the order of measuring, and the stroke of each reading."""

    pure: PureError
    stroke: Ints

    @property
    def is_told(self) -> bool:
        """Whether it tells the noise of its run."""
        return self.pure.dof >= _FEWEST and self.pure.squares > 0.0

    @property
    def variance(self) -> float:
        return self.pure.squares / self.pure.dof

    @property
    def median(self) -> float:
        """Median of the squares, each over what is left of it."""
        return float(np.median(self.pure.scaled[self.pure.telling] ** 2))

    @property
    def excess(self) -> float:
        """Excess kurtosis."""
        normal = float((self.pure.free**2).sum()) * self.variance**2
        return float((self.pure.residual**4).sum()) / normal - 3.0

    def is_disturbed(self) -> bool:
        """Whether the scatter is of some strokes more than of others, or goes with the time."""
        left, places = self.pure.residual, np.arange(self.stroke.size - 1)
        expected = float(self.pure.shared(places, places + 1).sum())
        product = float(left[1:] @ left[:-1]) / self.variance - expected
        if product > _SLOW * np.sqrt(self.pure.dof):
            return True
        strokes = dummies(self.stroke).T
        dof, squares = strokes @ self.pure.free, strokes @ left**2
        told = dof > 1.0
        return bool(differ((squares[told] / dof[told])[:, None], dof[told], _UNEVEN)[0])


def _differ(runs: Sequence[_RunError]) -> bool:
    """Whether the noise of the runs differs, by far and not by chance."""
    for size in ([run.variance for run in runs], [run.median for run in runs]):
        if max(size) < _MUCH**2 * min(size):
            return False
    dof = np.array([run.pure.dof for run in runs])
    excess = max(float(dof @ [run.excess for run in runs]) / float(dof.sum()), 0.0)
    variance = np.array([[run.variance] for run in runs])
    return bool(differ(variance, dof / (1.0 + 0.5 * excess), _SIGNIFICANT)[0])
