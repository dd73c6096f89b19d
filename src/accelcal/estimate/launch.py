"""Shift of bias and scale factor from one run to the next, declared or seen in repeated levels."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arrays import Array, Places
from accelcal.estimate.uncertainty import share_taken_off

SAME_LEVEL = 1.0
"""Temperatures that differ by less than this are one level [degC]."""

# Runs must span this much for their common slope to be worth anything [degC].
_TELLING_RANGE = 5.0


class RunShift(NamedTuple):
    """Standard uncertainty of a quantity from run to run, in one record or in each of a stack.

    Attributes
    ----------
    uncertainty : float or ndarray
        Standard uncertainty [g for the bias, relative for the scale factor].
    dof : float
        Degrees of freedom; infinite where declared.
    source : str
        ``"declared"``, ``"estimated"`` or ``"none"``.
    of_run : ndarray, shape (..., runs)
        The same for the shift of each run. Estimated, it comes from the other runs, so that the
        shift of a run and its uncertainty are independent, as Student's factor asks.
    dof_of_run : ndarray, shape (runs,)
        Its degrees of freedom.
    scatter : float or ndarray
        The same as `uncertainty` with all that other errors add to it: for estimates that are
        surer than those of single tables, and would lean on a shift that came out too small.
    holds_loop : bool
        Whether a hysteresis of the bias is in it: no repeat on one branch tells the two apart.
    """

    uncertainty: Any
    dof: float
    source: str
    of_run: Array
    dof_of_run: Array
    scatter: Any
    holds_loop: bool = False

    def alike(self) -> RunShift:
        """Return the shift with the same uncertainty in all runs, from all repeats.

        For what all runs tell together: a law through levels met several times goes through their
        means, which are independent of the scatter about them.
        """
        size = np.asarray(self.uncertainty)[..., None]
        return self._replace(
            of_run=size + np.zeros_like(self.of_run),
            dof_of_run=self.dof * np.ones_like(self.dof_of_run),
        )

    def of_records(self, records: int | slice) -> RunShift:
        """Return that of some records of a stack, or of one alone."""
        own = {name: getattr(self, name)[records] for name in ("uncertainty", "of_run", "scatter")}
        return self._replace(**own)


def reached_by(levels: Sequence[float]) -> Array | None:
    """Tell how the level of each run, in the order in which they were made [degC], was reached.

    1 after heating, -1 after cooling; 0 at the lowest and the highest level, where both branches of
    a loop meet; NaN at the first level elsewhere, as nobody knows how it was reached, and where a
    level is unknown. None where no level was reached both ways.

    Examples
    --------
    >>> reached_by([20.0, 50.0, 80.0, 50.0, -40.0]).tolist()
    [nan, 1.0, 0.0, -1.0, 0.0]
    """
    temperature = np.asarray(levels, dtype=np.float64)
    reached = np.full(temperature.size, np.nan)
    for before, now in pairwise(np.flatnonzero(np.isfinite(temperature)).tolist()):
        step = temperature[now] - temperature[before]
        # a chamber that wavers about its level neither heats nor cools
        reached[now] = np.sign(step) if abs(step) > SAME_LEVEL else reached[before]
    found = same_levels(temperature)
    for extreme in (*found[:1], *found[-1:]):
        reached[extreme] = 0.0
    both = ({-1.0, 1.0} <= set(reached[level].tolist()) for level in found)
    return reached if any(both) else None


def run_shift(
    declared: float | None,
    values: Array,
    variances: Array,
    levels: ArrayLike,
    reached: Array | None = None,
) -> RunShift:
    """Take the declared shift, or estimate it from runs at the same temperature.

    Parameters
    ----------
    declared : float or None
        Declared standard uncertainty.
    values : ndarray, shape (..., runs)
        The quantity in each run.
    variances : ndarray, shape (..., runs)
        Variance that errors new in each run (reading noise) give to it; NaN where unknown.
    levels : array_like, shape (..., runs)
        Temperature of each run [degC]; NaN where unknown. In all records of a stack the same runs
        share a level, see `same_levels`.
    reached : ndarray, shape (runs,), optional
        See `reached_by`: what goes with it, alike at all levels, is hysteresis and no shift; a
        run of which nobody knows how its level was reached tells nothing. Where no repeat is left
        for the shift, all of them count for it, whatever they were reached by.

    Returns
    -------
    RunShift
        Its size and source; ``"none"`` where no level was met twice.

    Notes
    -----
    With few repeats the estimate is zero too often, and intervals that rest on it hold the truth in
    fewer than 95 %; `accelcal.calibrate.weaknesses` says so below five degrees of freedom.

    Examples
    --------
    >>> import numpy as np
    >>> shift = run_shift(None, np.array([1.0, 2.0, 3.0]), np.zeros(3), [20.0, 20.1, 19.9])
    >>> float(shift.uncertainty), shift.dof, shift.dof_of_run.tolist()
    (1.0, 2.0, [1.0, 1.0, 1.0])
    """
    if declared is not None:
        return _same_in_all(values, declared, "declared")
    temperature, runs = np.asarray(levels, dtype=np.float64), values.shape[-1]
    pattern = temperature.reshape(-1, runs)[0]
    if all(level.size < 2 for level in same_levels(pattern)):
        return _same_in_all(values, 0.0, "none")
    told = _without_trend(values, temperature)
    sides = np.zeros(runs) if reached is None else reached
    pattern = np.where(np.isnan(sides), np.nan, pattern)
    whole = _scatter(told, variances, pattern, sides)
    if whole.dof == 0.0 and reached is not None:
        return run_shift(None, values, variances, levels)._replace(holds_loop=True)
    if whole.dof == 0.0:
        return _same_in_all(values, 0.0, "none")
    without = [np.where(np.arange(runs) == r, np.nan, pattern) for r in range(runs)]
    others = [_scatter(told, variances, rest, sides) for rest in without]
    own = [other if other.dof > 0.0 else whole for other in others]
    of_run = np.stack([found.size for found in own], axis=-1)
    dof_of_run = np.array([found.dof for found in own])
    return RunShift(whole.size, whole.dof, "estimated", of_run, dof_of_run, whole.as_it_was)


def _without_trend(values: Array, temperature: Array) -> Array:
    """Take off what temperature does to runs that miss their level by a fraction of a degree."""
    known = np.isfinite(temperature) + np.zeros(values.shape, dtype=bool)
    number = np.maximum(known.sum(axis=-1, keepdims=True), 1)
    t, y = (np.where(known, x, 0.0) for x in (temperature, values))
    t, y = (np.where(known, x - x.sum(axis=-1, keepdims=True) / number, 0.0) for x in (t, y))
    wide = np.ptp(t, axis=-1, keepdims=True) >= _TELLING_RANGE
    squares = np.where(wide, (t * t).sum(axis=-1, keepdims=True), np.inf)
    slope = (t * y).sum(axis=-1, keepdims=True) / squares
    return np.asarray(values - slope * np.where(known, temperature, 0.0))


def _same_in_all(values: Array, uncertainty: float, source: str) -> RunShift:
    same = np.full(values.shape, uncertainty)
    infinite = np.full(values.shape[-1:], np.inf)
    return RunShift(same[..., 0], np.inf, source, same, infinite, same[..., 0])


class _Scatter(NamedTuple):
    """Standard deviation from run to run at one level, its dof, and with the other errors in it."""

    size: Array
    dof: float
    as_it_was: Array


def _scatter(values: Array, variances: Array, temperature: Array, reached: Array) -> _Scatter:
    levels = [level for level in same_levels(temperature) if level.size > 1]
    nothing = np.zeros(values.shape[:-1])
    if not levels:
        return _Scatter(nothing, 0.0, nothing)
    repeats = float(sum(level.size - 1 for level in levels))
    others = sum(variances[..., level].mean(axis=-1) * (level.size - 1) for level in levels)
    shift, side = (
        np.concatenate([x[..., i] - x[..., i].mean(axis=-1, keepdims=True) for i in levels], -1)
        for x in (values, reached)
    )
    dof = repeats - bool(side.any())
    if dof <= 0.0 or np.isnan(others + shift.sum(axis=-1)).any():
        return _Scatter(nothing, 0.0, nothing)
    if side.any():
        shift = shift - side * (shift @ side)[..., None] / (side @ side)
    whole = (shift * shift).sum(axis=-1) / dof
    variance = whole - share_taken_off(dof) * others / repeats
    return _Scatter(np.sqrt(np.maximum(variance, 0.0)), dof, np.sqrt(whole))


def same_levels(temperature: Array) -> list[Places]:
    """Group the runs by temperature [degC], NaN where unknown, from the lowest level up.

    Examples
    --------
    >>> [level.tolist() for level in same_levels(np.array([20.0, 80.0, 20.3]))]
    [[0, 2], [1]]
    """
    order = np.argsort(temperature, kind="stable")
    order = order[~np.isnan(temperature[order])]
    breaks = (np.flatnonzero(np.diff(temperature[order]) > SAME_LEVEL) + 1).tolist()
    return [order[a:b] for a, b in pairwise([0, *breaks, order.size]) if b > a]
