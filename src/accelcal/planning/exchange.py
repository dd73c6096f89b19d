"""The best angles and repetitions for a time, by exchanges (Fedorov) and a polish.

References
----------
V. V. Fedorov, Theory of Optimal Experiments, Academic Press 1972, chapter 3.
A. C. Atkinson, A. N. Donev, R. D. Tobias, Optimum Experimental Designs, with SAS, Oxford 2007,
chapter 12: exchange algorithms from several random starts.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Ints, Mask
from accelcal.head_angles import angular_distance
from accelcal.planning.criterion import Angles, Criterion, covariances, losses

_GAIN = 1e-9
_PASSES = 60
_CHUNKS = 40
"""The time of a stroke is first dealt out in about as many parts."""

_STEPS = (4.0, 2.0, 1.0, 0.5)


class Budget(NamedTuple):
    """What a stroke may cost."""

    reading: float  # time of one [s]
    turn: float  # time of a turn to another angle [s]
    stroke: float  # time of a stroke, with a turn to each of its angles [s]
    spacing: float  # least distance of two angles [deg]

    def left(self, counts: Ints) -> float:
        """Time that is left of a stroke [s]."""
        used = self.reading * counts.sum() + self.turn * np.count_nonzero(counts)
        return float(self.stroke - used) + 1e-9 * self.stroke

    def free(self, degrees: Array, counts: Ints) -> Mask:
        """Angles that are taken already, or far enough from those that are."""
        taken = degrees[counts > 0]
        distance = angular_distance(degrees[:, None], taken)
        near = (distance < self.spacing - 1e-6).any(axis=1)
        return np.asarray(~near | (counts > 0))


def exchange(
    angles: Angles, criterion: Criterion, budget: Budget, start: Ints
) -> tuple[Ints, float]:
    """Improve a choice of repetitions until no exchange makes it better.

    It starts from readings at each angle in a stroke, shape (a,), within the budget, and gives the
    best ones and what they come to.

    Notes
    -----
    An exchange takes a reading, or all readings at an angle, and deals out the time that is free
    then: each time where it buys most for its cost.
    """
    search = _Search(angles, criterion, budget)
    chunk = max(1, round(budget.stroke / budget.reading / _CHUNKS))
    best = search.filled(start, chunk)
    for size in sorted({chunk, 1}, reverse=True):
        for _ in range(_PASSES):
            better = search.better(best, size)
            if better is None:
                break
            best = better
    return best, float(search.losses(best))


class _Search(NamedTuple):
    """Angles with what is to be small and what a stroke may cost."""

    angles: Angles
    criterion: Criterion
    budget: Budget

    def losses(self, counts: Ints) -> Array:
        """What some choices of repetitions come to."""
        return losses(self.criterion, covariances(self.angles, counts.astype(float)))

    def better(self, counts: Ints, chunk: int) -> Ints | None:
        """The best choice that a pass of exchanges leads to; None where none is better."""
        now, best = float(self.losses(counts)), None
        for i in np.flatnonzero(counts).tolist():
            for amount in {min(chunk, int(counts[i])), int(counts[i])}:
                without = counts.copy()
                without[i] -= amount
                tried = self.filled(without, chunk)
                loss = float(self.losses(tried))
                if loss < now * (1.0 - _GAIN):
                    now, best, counts = loss, tried, tried
                    break
        return best

    def filled(self, counts: Ints, chunk: int) -> Ints:
        """Deal out the time that is left, each time where it buys most for its cost."""
        counts = counts.copy()
        while True:
            added = self._addition(counts, chunk)
            if added is None and chunk > 1:
                added = self._addition(counts, 1)
            if added is None:
                return counts
            counts[added[0]] += added[1]

    def _addition(self, counts: Ints, amount: int) -> tuple[int, int] | None:
        budget = self.budget
        cost = amount * budget.reading + budget.turn * (counts == 0)
        fits = (cost <= budget.left(counts)) & budget.free(self.angles.degrees, counts)
        places = np.flatnonzero(fits)
        if not places.size:
            return None
        tried = np.repeat(counts[None], places.size, axis=0)
        tried[np.arange(places.size), places] += amount
        gain = np.log(float(self.losses(counts))) - np.log(self.losses(tried))
        best = int(np.argmax(np.round(gain / cost[places] * budget.stroke, 12)))
        return int(places[best]), amount


def polish(
    degrees: Array,
    counts: Ints,
    criterion: Criterion,
    budget: Budget,
    seen: Callable[[Array], Angles],
) -> tuple[Array, float]:
    """Move the angles off their grid, one by one, as long as it helps.

    Stops are at angles, shape (m,) [deg], with counts of readings; `seen` makes `Angles` of
    degrees, and the budget has the least distance. It gives the angles, in steps of half a degree
    off the grid, and what they come to.
    """

    def loss_of(tried: Array) -> float:
        return float(losses(criterion, covariances(seen(tried), counts.astype(float))))

    best, now = degrees.copy(), loss_of(degrees)
    for step in _STEPS:
        for _ in range(_PASSES):
            before = now
            for i in range(best.size):
                for move in (-step, step):
                    tried = best.copy()
                    tried[i] = (tried[i] + move) % 360.0
                    if _apart(tried, i, budget.spacing) and (loss := loss_of(tried)) < now * (
                        1 - _GAIN
                    ):
                        best, now = tried, loss
            if now > before * (1.0 - 1e-6):
                break
    return best, now


def _apart(degrees: Array, i: int, spacing: float) -> bool:
    distance = angular_distance(np.delete(degrees, i), degrees[i])
    return bool((distance >= spacing - 1e-6).all())
