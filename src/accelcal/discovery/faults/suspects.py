"""Readings that their replicates contradict, one after the other, the worst first.

Several faults hide one another, so suspects are taken out beyond the first that chance explains;
the last one that it does not explain takes those before it along (Rosner's generalised test). How
likely one is so far off hangs on how heavy the tails of the others are.
"""

from __future__ import annotations

import math
from functools import reduce
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array, Places
from accelcal.discovery.noise.pure_error import (
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

_AT_A_TIME = 2**22
"""Numbers that are worked out at a time, 32 MB."""

_FEWEST = 8.0
"""Degrees of freedom of the replicates that it takes to suspect any reading."""

_IN_VAIN = 5
"""The search ends after so many suspects in a row that chance explains."""


class Views(NamedTuple):
    """Pure error of n readings in three views, with the same readings taken out."""

    readings: Array  # readings, those that were exchanged in their places, (n,) [g]
    weight: Array  # relative inverse standard deviation of each reading's noise, (n,)
    least: float  # smallest standard deviation that the noise may have [g]
    conditions: Conditions  # of the readings
    pooled: PureError
    """Runs are replicates of one another, but for six coefficients; the most powerful."""
    moving: PureError
    """Only readings of one run are replicates; physics that repeats in a run cannot show."""
    smooth: PureError  # forward and back strokes are replicates; a step in time shows

    def after(self, step: Suspect) -> Views:
        """Take a suspect out of all views, or exchange its readings in them."""
        three, readings = (self.pooled, self.moving, self.smooth), self.readings
        if step.is_exchange:
            pair, readings = list(step.readings), readings.copy()
            readings[pair] = readings[pair[::-1]]
            views = [view.changed(step.columns[:, 0]) for view in three]
        else:
            views = [reduce(PureError.without, step.columns.T, view) for view in three]
        return Views(readings, self.weight, self.least, self.conditions, *views)


class Suspect(NamedTuple):
    """One step of the search."""

    readings: tuple[int, ...]
    """One reading for an outlier, two for an exchange, none for something that goes on in time."""
    p_value: float  # chance of it over all readings or pairs
    columns: Array  # what was taken out, or for an exchange the change of the readings, (n, k) [g]
    deviation: float = 0.0  # how far an outlier is off, in standard deviations of the others
    if_normal: float = 1.0  # chance of it over all readings if the noise had no heavy tails

    @property
    def is_outlier(self) -> bool:
        """Whether it is one reading."""
        return len(self.readings) == 1

    @property
    def is_exchange(self) -> bool:
        """Whether it is two readings in each other's place."""
        return len(self.readings) == 2


def views_of(
    readings: Array, c: Conditions, mounting: NDArray[np.str_], weight: Array, least: float
) -> Views:
    """Set up the views of n readings [g]."""
    seen, weights = readings * weight, weight[:, None]
    kinds = (pooled(c, mounting), moving(c, mounting), smooth(c, mounting))
    views = (pure_error(seen, columns * weights) for columns in kinds)
    return Views(readings, weight, least, c, *views)


def suspects(views: Views, alpha: float) -> tuple[list[Suspect], Views, list[Suspect]]:
    """Search outliers and exchanged readings at a false-alarm rate.

    Returns
    -------
    list of Suspect
        In the order found.
    Views
        The views with all of them taken out.
    list of Suspect
        Readings that only noise with heavy tails explains: they are outliers or it is such.
    """
    pairs = _pairs(views.conditions)
    steps: list[Suspect] = []
    after, last, beside = views, 0, views
    for _ in range(max(2, round(0.03 * views.readings.size))):
        found = _exchange(beside, pairs)
        if found is None or found.p_value >= alpha:
            found = _outlier(beside)
        if found is None:
            break
        steps.append(found)
        beside = beside.after(found)
        if _named(found, alpha):
            after, last = beside, len(steps)
        if not any(_named(step, alpha) for step in steps[-_IN_VAIN:]) and len(steps) >= _IN_VAIN:
            break
    doubtful = [step for step in steps[last:] if step.if_normal < alpha]
    return steps[:last], after, doubtful


def _named(step: Suspect, alpha: float) -> bool:
    return bool(step.readings) and step.p_value < alpha


def _pairs(c: Conditions) -> Places:
    """Pairs of readings of one stroke, shape (2, k)."""
    strokes = grouped(c.run * (int(c.stroke.max()) + 1) + c.stroke).parts
    return np.hstack([own[np.array(np.triu_indices(own.size, 1))] for own in strokes])


def _exchange(views: Views, pairs: Places) -> Suspect | None:
    """The exchange of two readings that leaves least, if it leaves no more than noise of them.

    An exchange has no free parameter, two outliers have two: it must do as well as they.
    """
    view, readings = views.pooled, views.readings
    if not pairs.size or view.dof < _FEWEST:
        return None
    pair = _least(views, pairs)
    change = np.zeros(readings.size)
    change[pair] = (readings[pair[::-1]] - readings[pair]) * views.weight[pair]
    inverse = np.linalg.pinv(view.among(pair))
    of_two = float(view.residual[pair] @ inverse @ view.residual[pair])
    dof = view.dof - 2.0
    noise = max((view.squares - of_two) / dof, views.least**2)
    left = (view.changed(change).squares - view.squares + of_two) / 2.0 / noise
    if f_survival(left, 2.0, dof) < _CONSISTENT:
        return None
    gain = of_two / 2.0 / noise
    tries = _TRIES_OF_PAIRS * pairs.shape[1]
    chance = min(1.0, tries * f_survival(gain, 2.0, dof))
    return Suspect(tuple(pair), chance, change[:, None])


def _least(views: Views, pairs: Places) -> list[int]:
    """The pair whose exchange leaves least; of such that leave alike, judged by another view."""
    by_pooled = _squares_after(views, views.pooled, pairs)
    alike = by_pooled <= by_pooled.min() + 0.05 * max(views.pooled.squares - by_pooled.min(), 0.0)
    by_smooth = np.where(alike, _squares_after(views, views.smooth, pairs), np.inf)
    one, other = pairs[:, int(np.argmin(by_smooth))].tolist()
    return [one, other]


def _squares_after(views: Views, view: PureError, pairs: Places) -> Array:
    """Sum of squares that each exchange leaves in one of the views, shape (k,)."""
    i, j = pairs
    d = views.readings[j] - views.readings[i]
    a, b = d * views.weight[i], d * views.weight[j]
    pull = 2.0 * (a * view.residual[i] - b * view.residual[j])
    own = a**2 * view.free[i] + b**2 * view.free[j]
    parts = np.array_split(pairs, 1 + pairs.size * view.taken.shape[1] // _AT_A_TIME, axis=1)
    shared = np.concatenate([view.shared(*some) for some in parts])
    return np.asarray(view.squares + pull + own - 2.0 * a * b * shared)


def _outlier(views: Views) -> Suspect | None:
    """The reading that stands out most, or what explains it better: a step, a decay in time."""
    view = views.pooled
    if views.moving.dof < _FEWEST or not (view.telling & views.moving.telling).any():
        return None
    worst = _worst(views)
    unit = np.eye(1, views.weight.size, worst).T
    likelier, gain = _rival(views, worst)
    if gain > 1.0001 * views.smooth.gains(unit)[0]:
        # what is over after the first reading, as a loop that begins elsewhere, is no decay of more
        first = views.conditions.run_time[worst] == 0.0
        return Suspect((), 1.0, np.hstack([unit, likelier]) if first else likelier)
    return _judged(views, Suspect((worst,), 1.0, unit))


def _judged(views: Views, found: Suspect) -> Suspect:
    """Give an outlier its chance over all readings; the replicates of the same run must agree."""
    (worst,) = found.readings
    view, own = views.moving, float(views.moving.scaled[worst])
    noise = np.sqrt(max((view.squares - own**2) / (view.dof - 1.0), views.least**2))
    if abs(own) < _CONFIRMED * noise:
        return found
    view, own = views.pooled, float(views.pooled.scaled[worst])
    others, dof = _others(view, worst), view.dof - 1.0
    deviation = abs(own) / max(float(np.sqrt((others**2).mean())), views.least)
    return found._replace(
        p_value=min(1.0, _TRIES * others.size * chance_of(own, others, dof, views.least)),
        deviation=deviation,
        if_normal=min(1.0, 2.0 * others.size * student_survival(deviation, max(dof, 1.0))),
    )


def _others(view: PureError, worst: int) -> Array:
    """Deviations of the other readings, with the variance of one, after one is taken out."""
    part = view.shared(np.arange(view.residual.size), worst) / np.sqrt(view.free[worst])
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
    with_first = view.shared(np.arange(size.size), first)
    share = np.abs(with_first) / np.sqrt(np.maximum(view.free * view.free[first], 1e-12))
    alike &= share > 0.98
    return int(np.argmax(np.where(alike, np.abs(views.smooth.scaled), -1.0)))


def _rival(views: Views, reading: int) -> tuple[Array, float]:
    """What goes on in time that takes most, (n, 1), and the squares that it takes [g^2].

    It is a step within the run of a reading, or a decay in all runs.
    """
    c, weight, view = views.conditions, views.weight, views.smooth
    own = c.order[c.run[c.order] == c.run[reading]]
    length = max(float(c.run_time.max()), 1e-9)
    decays = np.exp(-c.run_time[:, None] / (length * np.array(_DECAYS))) * weight[:, None]
    of_steps, of_decays = view.gains_of_steps(own, weight), view.gains(decays)
    if not of_steps.size or of_steps.max() < of_decays.max():
        best = int(np.argmax(of_decays))
        return decays[:, [best]], float(of_decays[best])
    best = int(np.argmax(of_steps))
    step = np.zeros((weight.size, 1))
    step[own[best + 1 :], 0] = weight[own[best + 1 :]]
    return step, float(of_steps[best])


_TAILS = (4.0, 5.0, 6.0, 8.0, 11.0, 16.0, 30.0, math.inf)
"""Degrees of freedom of Student's distributions that the noise may have."""

_NORMAL = 5.0
"""Weight of normal noise beforehand, over that of each heavier tail."""

_STEPS = 25


def chance_of(size: float, rest: Array, dof: float, least: float) -> float:
    """Two-sided chance of one deviation, from the size and the tails of the others.

    It is the mean of the chances under Student's distributions of several tails, each with the
    weight that the likelihood of the others gives it. These have the variance of the one, shape
    (n,), and amount to `dof` degrees of freedom; the noise has no smaller scale than `least` [g].
    """
    scales, logs = zip(*(_fit(rest, nu, least) for nu in _TAILS), strict=True)
    weights = np.exp((np.array(logs) - max(logs)) * min(dof / rest.size, 1.0))
    weights[-1] *= _NORMAL
    chances = [
        2.0 * student_survival(abs(size) / scale, min(nu, max(dof, 1.0)))
        for nu, scale in zip(_TAILS, scales, strict=True)
    ]
    return float(weights @ np.array(chances) / weights.sum())


def _fit(rest: Array, nu: float, least: float) -> tuple[float, float]:
    """Scale of a Student distribution, and its log likelihood."""
    square = max(float(rest @ rest) / rest.size, least**2)
    if math.isinf(nu):
        loss = rest.size * math.log(square) + float(rest @ rest) / square
        return math.sqrt(square), -0.5 * (loss + rest.size * math.log(2.0 * math.pi))
    for _ in range(_STEPS):
        weight = (nu + 1.0) / (nu + rest**2 / square)
        square = max(float(weight @ rest**2) / rest.size, least**2)
    front = math.lgamma((nu + 1.0) / 2.0) - math.lgamma(nu / 2.0) - 0.5 * math.log(nu * math.pi)
    tail = 0.5 * (nu + 1.0) * float(np.log1p(rest**2 / (nu * square)).sum())
    return math.sqrt(square), rest.size * (front - 0.5 * math.log(square)) - tail
