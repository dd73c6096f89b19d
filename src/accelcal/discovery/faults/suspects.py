"""Readings that their replicates contradict, one after the other, the worst first.

Several faults hide one another, so suspects are taken out beyond the first that chance explains;
the last one that it does not explain takes those before it along (Rosner's generalised test).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array, Places
from accelcal.discovery.faults.heavy_tails import chance_of
from accelcal.discovery.faults.pure_error import (
    TELLING,
    PureError,
    moving,
    pooled,
    pure_error,
    smooth,
)
from accelcal.effects.conditions import Conditions
from accelcal.numerics.grouping import grouped
from accelcal.numerics.probability import f_survival, student_survival

_TRIES = 7.0
"""Factor on the chance of an outlier for what the tails of few readings do not tell, measured."""

_TRIES_OF_PAIRS = 1000.0
"""The same factor for an exchange of two readings, whose chance is computed for normal noise."""

_CONFIRMED = 3.0
"""Standard deviations by which the replicates of its own run must contradict a suspect."""

_CONSISTENT = 1e-4
"""An exchange is none where what it leaves of its two readings has a smaller chance than this."""

_DECAYS = (0.01, 0.03, 0.1, 0.3)
"""Time constants of decays that could look like a suspect, over the length of a run."""

_FEWEST = 8.0
"""Degrees of freedom of the replicates that it takes to suspect any reading."""

_IN_VAIN = 5
"""The search ends after so many suspects in a row that chance explains."""


class Views(NamedTuple):
    """Pure error in three views, with the same readings taken out.

    Attributes
    ----------
    pooled : PureError
        Runs are replicates of one another, but for six coefficients; the most powerful.
    moving : PureError
        Only readings of one run are replicates; physics that repeats in a run cannot show.
    smooth : PureError
        Forward and back strokes are replicates; a step in time shows.
    """

    pooled: PureError
    moving: PureError
    smooth: PureError

    def without(self, column: Array) -> Views:
        """Take a column out of all views."""
        return Views(*(view.without(column) for view in self))

    def changed(self, change: Array) -> Views:
        """Change readings in all views [g]."""
        return Views(*(view.changed(change) for view in self))


class Suspect(NamedTuple):
    """One step of the search.

    Attributes
    ----------
    readings : tuple of int
        One reading for an outlier, two for an exchange, none for something that goes on in time.
    p_value : float
        Chance of it over all readings or pairs.
    column : ndarray, shape (n,)
        What was taken out, or for an exchange the change of the readings [g].
    deviation : float
        How far an outlier is off, in standard deviations of the others.
    if_normal : float
        Chance of it over all readings if the noise had no heavy tails.
    """

    readings: tuple[int, ...]
    p_value: float
    column: Array
    deviation: float = 0.0
    if_normal: float = 1.0


def views_of(readings: Array, c: Conditions, mounting: NDArray[np.str_], weight: Array) -> Views:
    """Set up the views of n readings [g].

    The weight, shape (n,), is the relative inverse standard deviation of each reading's noise.
    """
    seen, weights = readings * weight, weight[:, None]
    kinds = (pooled, moving, smooth)
    return Views(*(pure_error(seen, kind(c, mounting) * weights) for kind in kinds))


def suspects(
    views: Views, readings: Array, weight: Array, c: Conditions, least: float, alpha: float
) -> tuple[list[Suspect], Views, list[Suspect]]:
    """Search outliers and exchanged readings.

    Parameters
    ----------
    views : Views
        Views of the readings.
    readings : ndarray, shape (n,)
        Readings [g].
    weight : ndarray, shape (n,)
        As in `views_of`.
    c : Conditions
        Their conditions.
    least : float
        Smallest standard deviation that the noise may have [g].
    alpha : float
        False-alarm rate.

    Returns
    -------
    list of Suspect
        In the order found.
    Views
        The views with all of them taken out.
    list of Suspect
        Readings that only noise with heavy tails explains: they are outliers or it is such.
    """
    pairs, current = _pairs(c), readings.copy()
    steps, after = [], [views]
    for _ in range(max(2, round(0.03 * readings.size))):
        found = _exchange(views, current, weight, pairs, least)
        if found is None or found.p_value >= alpha:
            found = _outlier(views, weight, c, least)
        if found is None:
            break
        if len(found.readings) == 2:
            pair = list(found.readings)
            current[pair] = current[pair[::-1]]
            views = views.changed(found.column)
        else:
            views = views.without(found.column)
        steps.append(found)
        after.append(views)
        if not any(_named(step, alpha) for step in steps[-_IN_VAIN:]) and len(steps) >= _IN_VAIN:
            break
    last = max((k + 1 for k, step in enumerate(steps) if _named(step, alpha)), default=0)
    doubtful = [step for step in steps[last:] if step.if_normal < alpha]
    return steps[:last], after[last], doubtful


def _named(step: Suspect, alpha: float) -> bool:
    return bool(step.readings) and step.p_value < alpha


def _pairs(c: Conditions) -> Places:
    """Pairs of readings of one stroke, shape (2, k)."""
    stroke = grouped(c.run * (int(c.stroke.max()) + 1) + c.stroke)[1]
    order = np.argsort(stroke, kind="stable")
    ends = np.flatnonzero(np.diff(stroke[order])) + 1
    groups = np.split(order, ends)
    return np.hstack([own[np.array(np.triu_indices(own.size, 1))] for own in groups])


def _exchange(
    views: Views, readings: Array, weight: Array, pairs: Places, least: float
) -> Suspect | None:
    """The exchange of two readings that leaves least, if it leaves no more than noise of them.

    An exchange has no free parameter, two outliers have two: it must do as well as they.
    """
    view = views.pooled
    if not pairs.size or view.dof < _FEWEST:
        return None
    i, j = _least(views, readings, weight, pairs)
    change = np.zeros(readings.size)
    change[[i, j]] = (readings[[j, i]] - readings[[i, j]]) * weight[[i, j]]
    both = np.ix_([i, j], [i, j])
    of_two = float(
        view.residual[[i, j]] @ np.linalg.pinv(view.projector[both]) @ view.residual[[i, j]]
    )
    dof = view.dof - 2.0
    noise = max((view.squares - of_two) / dof, least**2)
    left = (view.changed(change).squares - view.squares + of_two) / 2.0 / noise
    if f_survival(left, 2.0, dof) < _CONSISTENT:
        return None
    gain = of_two / 2.0 / noise
    tries = _TRIES_OF_PAIRS * pairs.shape[1]
    chance = min(1.0, tries * f_survival(gain, 2.0, dof))
    return Suspect((i, j), chance, change)


def _least(views: Views, readings: Array, weight: Array, pairs: Places) -> tuple[int, int]:
    """The pair whose exchange leaves least; of such that leave alike, judged by another view."""
    by_pooled = _squares_after(views.pooled, readings, weight, pairs)
    alike = by_pooled <= by_pooled.min() + 0.05 * max(views.pooled.squares - by_pooled.min(), 0.0)
    by_smooth = np.where(alike, _squares_after(views.smooth, readings, weight, pairs), np.inf)
    one = int(np.argmin(by_smooth))
    return int(pairs[0, one]), int(pairs[1, one])


def _squares_after(view: PureError, readings: Array, weight: Array, pairs: Places) -> Array:
    i, j = pairs
    d = readings[j] - readings[i]
    a, b = d * weight[i], d * weight[j]
    pull = 2.0 * (a * view.residual[i] - b * view.residual[j])
    own = a**2 * view.free[i] + b**2 * view.free[j]
    return np.asarray(view.squares + pull + own - 2.0 * a * b * view.projector[i, j])


def _outlier(views: Views, weight: Array, c: Conditions, least: float) -> Suspect | None:
    """The reading that stands out most, or what explains it better: a step, a decay in time."""
    view = views.pooled
    if views.moving.dof < _FEWEST or not (view.telling & views.moving.telling).any():
        return None
    worst = _worst(views)
    unit = _unit(worst, weight.size)
    rivals = _rivals(c, worst, weight)
    gains = views.smooth.gains(rivals)
    if gains.max() > 1.0001 * views.smooth.gains(unit[:, None])[0]:
        return Suspect((), 1.0, rivals[:, int(np.argmax(gains))])
    return _judged(views, Suspect((worst,), 1.0, unit), least)


def _judged(views: Views, found: Suspect, least: float) -> Suspect:
    """Give an outlier its chance over all readings; the replicates of the same run must agree."""
    (worst,) = found.readings
    view, own = views.moving, float(views.moving.scaled[worst])
    noise = np.sqrt(max((view.squares - own**2) / (view.dof - 1.0), least**2))
    if abs(own) < _CONFIRMED * noise:
        return found
    view, own = views.pooled, float(views.pooled.scaled[worst])
    others, dof = _others(view, worst), view.dof - 1.0
    deviation = abs(own) / max(float(np.sqrt((others**2).mean())), least)
    return found._replace(
        p_value=min(1.0, _TRIES * others.size * chance_of(own, others, dof, least)),
        deviation=deviation,
        if_normal=min(1.0, 2.0 * others.size * student_survival(deviation, max(dof, 1.0))),
    )


def _others(view: PureError, worst: int) -> Array:
    """Deviations of the other readings, with the variance of one, after one is taken out."""
    part = view.projector[:, worst] / np.sqrt(view.free[worst])
    free = view.free - part**2
    residual = view.residual - part * view.scaled[worst]
    kept = free > TELLING
    return np.asarray(residual[kept] / np.sqrt(free[kept]))


def _worst(views: Views) -> int:
    """The reading farthest off; of two replicates alone, the one that another view tells."""
    view = views.pooled
    size = np.where(views.moving.telling, np.abs(view.scaled), 0.0)
    first = int(np.argmax(size))
    alike = size > 0.98 * size[first]
    share = np.abs(view.projector[first]) / np.sqrt(np.maximum(view.free * view.free[first], 1e-12))
    alike &= share > 0.98
    return int(np.argmax(np.where(alike, np.abs(views.smooth.scaled), -1.0)))


def _rivals(c: Conditions, reading: int, weight: Array) -> Array:
    """Columns of what goes on in time: steps within the run of a reading, decays in all runs."""
    own = np.flatnonzero(c.run == c.run[reading])
    moments = np.sort(c.number[own])[1:]
    steps = (c.run == c.run[reading])[:, None] & (c.number[:, None] >= moments)
    length = max(float(c.run_time.max()), 1e-9)
    decays = np.exp(-c.run_time[:, None] / (length * np.array(_DECAYS)))
    return np.asarray(np.hstack([steps, decays]) * weight[:, None])


def _unit(place: int, size: int) -> Array:
    unit = np.zeros(size)
    unit[place] = 1.0
    return unit
