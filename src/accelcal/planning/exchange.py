"""The best angles and repetitions for a time, by exchanges (Fedorov) and a polish.

A choice of angles is as good as the covariance that the fit will have. A reading at an angle has
noise of its own, and the error of the head at this angle, which all readings there share in all
strokes and levels. So a second reading at one angle is worth less than one at another angle, but
saves a turn. With w the variance of a position's mean, the coefficients of one of R tables on one
head have the covariance

    C = (X' W^-1 X)^-1 + (1 - 1/R) s^2 (X' N X)^-1 + shifts,

W of the means over all R tables (noise and head), N the readings in a table: what the tables have
in common is weighted by noise and head, what differs between them by the noise alone.

References
----------
V. V. Fedorov, Theory of Optimal Experiments, Academic Press 1972, chapter 3.
A. C. Atkinson, A. N. Donev, R. D. Tobias, Optimum Experimental Designs, with SAS, Oxford 2007,
chapter 12: exchange algorithms from several random starts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from accelcal.accelerometer import Accelerometer
from accelcal.arguments.options import check_choice
from accelcal.arrays import Array, Ints, Mask
from accelcal.errors import InputError
from accelcal.estimate.tables import angular_derivative
from accelcal.geometry import accelerations
from accelcal.head_angles import angular_distance
from accelcal.model import COEFFICIENTS, design_matrix
from accelcal.simulation import NoiseComponents

CRITERIA = ("D", "A", *COEFFICIENTS)
"""What a choice of angles may be best for."""

_ENDLESS = 1e60


class Angles(NamedTuple):
    """Angles of a head with what a reading at each of them is worth."""

    degrees: Array  # head angles [deg], shape (a,)
    rows: Array  # of the design matrix, shape (a, 6)
    head: Array  # variance of the head error in a reading [g^2], shape (a,)
    noise: float  # variance of the noise of a reading, over the strokes [g^2]
    tables: int  # that share the head
    shifts: Array  # variances that come whatever the angles are: launch and temperature, shape (6,)


class Criterion(NamedTuple):
    """What is to be small."""

    name: str  # one of `CRITERIA`
    weights: Array  # of the variances, for A and a single coefficient, shape (6,)


def criterion_of(name: str, scales: Mapping[str, float]) -> Criterion:
    """Make one of `CRITERIA`, for A with the uncertainty of each coefficient that counts as one.

    Coefficients without one do not count in A.

    Raises
    ------
    InputError
        If the name is unknown, or A has nothing to weigh.
    """
    check_choice(CRITERIA, criterion=name)
    if name == "A" and not set(scales) & set(COEFFICIENTS):
        raise InputError(f"A needs a target for one or more of {', '.join(COEFFICIENTS)}")
    if name in COEFFICIENTS:
        scales = {name: 1.0}
    sizes = np.array([scales.get(k, np.inf) for k in COEFFICIENTS])
    return Criterion(name, sizes**-2 / np.isfinite(sizes).sum())


def seen_from(
    degrees: Array,
    noise: NoiseComponents,
    accelerometer: Accelerometer,
    *,
    strokes: int,
    tables: int,
    shifts: Array,
    mounting: str = "o+",
    resolution: float = 0.0,
) -> Angles:
    """Work out what a reading at each angle [deg], in so many strokes and tables, is worth.

    Launch and temperature shift the coefficients by variances of shape (6,). The step of the
    readings counts as noise [g].
    """
    slope = angular_derivative(degrees, 0.0, mounting) @ _nominal(accelerometer)
    variance = max(noise.reading, 1e-12) ** 2 + resolution**2 / 12.0
    return Angles(
        degrees=degrees,
        rows=design_matrix(accelerations(degrees, 0.0, mounting), mounting),
        head=np.asarray((noise.head * slope) ** 2),
        noise=variance / strokes,
        tables=tables,
        shifts=shifts,
    )


def _nominal(accelerometer: Accelerometer) -> Array:
    """Coefficients over K1, in the order of `COEFFICIENTS`."""
    bias, misalignment = accelerometer.bias.at_T0, accelerometer.misalignment.at_T0
    others = accelerometer.k2, accelerometer.k3, misalignment, accelerometer.cross_coupling
    return np.array([bias, 1.0, *others])


def covariances(angles: Angles, counts: Array) -> Array:
    """Covariance of the coefficients over K1, shape (..., 6, 6), for choices of repetitions.

    There are counts, shape (..., a), of readings at each angle in a stroke. It is infinite where
    the coefficients are not determined.
    """
    taken = counts > 0
    per_mean = angles.noise / (np.where(taken, counts, 1) * angles.tables)
    common = np.where(taken, 1.0 / (angles.head + per_mean), 0.0)
    whole = _inverses(_information(angles.rows, common))
    if angles.tables > 1:
        share = 1.0 - 1.0 / angles.tables
        whole = whole + share * _inverses(_information(angles.rows, counts / angles.noise))
    return np.asarray(whole + np.diag(angles.shifts))


def _information(rows: Array, weights: Array) -> Array:
    pairs = (rows[:, :, None] * rows[:, None, :]).reshape(rows.shape[0], -1)
    size = rows.shape[1]
    return (np.asarray(weights) @ pairs).reshape(*weights.shape[:-1], size, size)


def _inverses(information: Array) -> Array:
    """Inverses of matrices, infinite for those that have none."""
    scale = np.sqrt(np.linalg.diagonal(information))
    scale = np.where(scale > 0.0, scale, 1.0)
    scaled = information / (scale[..., :, None] * scale[..., None, :])
    good = np.linalg.det(scaled) > 1e-12
    safe = np.where(good[..., None, None], scaled, np.eye(scaled.shape[-1]))
    found = np.linalg.inv(safe) / (scale[..., :, None] * scale[..., None, :])
    return np.asarray(np.where(good[..., None, None], found, _ENDLESS * np.eye(scaled.shape[-1])))


def losses(criterion: Criterion, covariance: Array) -> Array:
    """What is to be small, as a standard uncertainty, of covariances of shape (..., 6, 6).

    For D it is the sixth root of the root of the determinant, for A the root mean square of the
    uncertainties over their scales, else the uncertainty of the coefficient.
    """
    if criterion.name == "D":
        sign, logarithm = np.linalg.slogdet(covariance)
        return np.asarray(np.where(sign > 0, np.exp(logarithm / (2 * len(COEFFICIENTS))), np.inf))
    variances = np.linalg.diagonal(covariance)
    return np.asarray(np.sqrt(variances @ criterion.weights))


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
