"""The best angles and repetitions for some hours, beside the equally spaced tests."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from accelcal.accelerometer import AL15, Accelerometer
from accelcal.arguments.kinds import expect, several
from accelcal.arguments.numbers import check_number, check_whole
from accelcal.arguments.options import check_flag
from accelcal.arrays import Array, Ints, Numbers
from accelcal.errors import InputError
from accelcal.head_angles import angular_distance, head_positions, turn_angles
from accelcal.model import COEFFICIENTS
from accelcal.planning.compare import (
    PACE,
    STAND,
    TEMPERATURES,
    blank_plan,
    compared,
    design_of,
)
from accelcal.planning.exchange import (
    Angles,
    Budget,
    Criterion,
    covariances,
    criterion_of,
    exchange,
    losses,
    polish,
    seen_from,
)
from accelcal.planning.pace import Pace, per_run, strokes_within
from accelcal.planning.prediction import forecasts
from accelcal.planning.targets import checked_targets
from accelcal.results.optimal_design import OptimalDesign
from accelcal.simulation import NoiseComponents, TumblePlan

__all__ = ["SPACING", "optimal_design"]

SPACING = 15.0
"""Least distance of two positions [deg]."""

_GRID = 5.0
_STARTS = 10
_FEWEST = len(COEFFICIENTS)
_MOST_READINGS = 5000


class _Question(NamedTuple):
    """What is asked for, with all that the angles do not change."""

    plan: TumblePlan
    noise: NoiseComponents
    pace: Pace
    hours: float
    accelerometer: Accelerometer
    criterion: Criterion
    shifts: Array
    spacing: float

    def seen(self, degrees: Array, strokes: int) -> Angles:
        """What a reading at each angle is worth, in a test of some strokes."""
        nominal = self.accelerometer.scale_factor.at_T0
        return seen_from(
            degrees,
            self.noise,
            self.accelerometer,
            strokes=strokes,
            tables=len(self.plan.temperatures) * len(self.plan.mountings),
            shifts=self.shifts,
            mounting=self.plan.mountings[0],
            resolution=self.plan.resolution / nominal,
        )

    def loss(self, plan: TumblePlan) -> float:
        """What a test comes to."""
        degrees, counts = np.unique(head_positions(plan.stops), return_counts=True)
        found = covariances(self.seen(degrees, plan.strokes), counts.astype(float))
        return float(losses(self.criterion, found))

    @property
    def budget(self) -> Budget:
        """What a stroke of the plan may cost: its first turn is that of the stroke before it."""
        run = per_run(self.plan, self.pace, self.hours)
        stroke = (run - self.pace.turn) / self.plan.strokes + self.pace.turn
        return Budget(self.pace.reading, self.pace.turn, stroke, self.spacing)


def optimal_design(
    criterion: str,
    *,
    hours: float,
    strokes: int = 2,
    temperatures: Numbers = TEMPERATURES,
    mountings: Sequence[str] = ("o+",),
    noise: NoiseComponents = STAND,
    resolution: float = 0.0,
    pace: Pace = PACE,
    targets: Mapping[str, float | str] | None = None,
    spacing: float = SPACING,
    seed: int = 0,
    declare: bool = True,
    effects: bool = False,
    accelerometer: Accelerometer = AL15,
) -> OptimalDesign:
    """Find the best angles and repetitions for some hours.

    Parameters
    ----------
    criterion : str
        ``"D"`` for all coefficients at once (determinant of their covariance), ``"A"`` for the mean
        of their variances over the squares of the targets, or the name of a coefficient.
    hours : float
        Time of the whole test [h].
    strokes : int, default 2
        Strokes in a run. More time goes into readings at a stop, which cost no turn.
    temperatures, mountings, noise, resolution, pace, declare, effects, accelerometer
        As of `accelcal.design`, one choice each.
    targets : mapping of str to float or str, optional
        Standard uncertainties asked for; for A also what counts as one. By default those of 8
        positions.
    spacing : float, default 15
        Least distance of two positions [deg]. Head errors count as independent from position to
        position, which those of near positions are not.
    seed : int, default 0
        Of the starts of the search; the same seed gives the same angles.

    Returns
    -------
    OptimalDesign
        The test, beside equally spaced ones of the same hours.

    Raises
    ------
    InputError
        If an argument breaks a rule, the hours are too few, or a target is below the floor.

    Notes
    -----
    Exchanges on a grid of 5 deg from several starts, then each angle moves by itself. What is
    minimised is the covariance that `accelcal.fit` will state, head errors and launches included.

    Examples
    --------
    >>> import accelcal
    >>> found = accelcal.optimal_design("K2", hours=8.5)
    >>> found.gain("8 positions") > 1.1
    True
    """
    asked = checked_targets(targets)
    check_flag(declare=declare, effects=effects)
    check_number(hours=hours, spacing=spacing)
    check_whole(0, seed=seed)
    expect(noise, NoiseComponents)
    if not 1.0 <= spacing <= 60.0:
        raise InputError(f"spacing is {spacing:g}; it is from 1 to 60 deg")
    plan = replace(
        blank_plan(pace, resolution, accelerometer),
        strokes=strokes,
        temperatures=several(temperatures),
        mountings=several(mountings),
    )
    sizes, shifts = _of_eight_positions(plan, noise, accelerometer)
    aim = criterion_of(criterion, asked or sizes)
    question = _Question(plan, noise, pace, hours, accelerometer, aim, shifts, spacing)
    _check_time(question)
    plans = {"optimal": _best(question, int(seed)), **dict(_rivals(question))}
    designs = tuple(
        design_of(each, noise, pace, accelerometer, declared=declare, effects=effects)
        for each in plans.values()
    )
    comparison = compared(designs, noise, resolution, pace, asked, declared=declare)
    found = {name: question.loss(each) for name, each in plans.items()}
    return OptimalDesign(criterion, comparison, found, spacing, int(seed))


def _of_eight_positions(
    plan: TumblePlan, noise: NoiseComponents, accelerometer: Accelerometer
) -> tuple[dict[str, float], Array]:
    """Uncertainties of the coefficients in a usual test, and what shifts of the runs add to them.

    The shifts, shape (p,), are variances. They do not depend on the angles.
    """
    usual = {f.name: f for f in reversed(forecasts(plan, noise, accelerometer))}
    sizes = {name: f.standard_uncertainty for name, f in usual.items()}
    budgets = [usual[name].budget for name in COEFFICIENTS]
    shifts = [sum(part.get(source, 0.0) ** 2 for source in _SHIFTS) for part in budgets]
    return sizes, np.array(shifts)


_SHIFTS = ("launch", "launch_sf", "temperature")


def _check_time(question: _Question) -> None:
    budget = question.budget
    needed = _FEWEST * (budget.reading + budget.turn)
    if budget.stroke < needed:
        raise InputError(
            f"{question.hours:g} h leave {max(budget.stroke, 0.0):.0f} s for a stroke, and the"
            f" {_FEWEST} positions that six coefficients need take {needed:g} s; allow more hours,"
            " or fewer strokes, levels or mountings"
        )
    if budget.stroke / budget.reading > _MOST_READINGS:
        raise InputError(
            f"{question.hours:g} h are time for more than {_MOST_READINGS} readings in a stroke;"
            " give fewer hours or more strokes"
        )


def _best(question: _Question, seed: int) -> TumblePlan:
    """The best test of all starts of the search, and of those from equal angles off its grid."""
    strokes, budget = question.plan.strokes, question.budget
    grid = np.arange(0.0, 360.0, _GRID, dtype=np.float64)
    starts = [(grid, start) for start in _starts(question, grid, np.random.default_rng(seed))]
    for plan in _repeated(question):
        own, counts = np.unique(plan.stops, return_counts=True)
        starts.append((own, counts))
    ends: list[tuple[float, int, Array, Ints]] = []
    for degrees, start in starts:
        found, _ = exchange(question.seen(degrees, strokes), question.criterion, budget, start)
        counts = found[found > 0]
        seen = partial(question.seen, strokes=strokes)
        angles, loss = polish(degrees[found > 0], counts, question.criterion, budget, seen)
        ends.append((round(float(np.log(loss)), 9), len(ends), angles, counts))
    _, _, angles, counts = min(ends, key=lambda end: end[:2])
    order = np.argsort(angles)
    stops = np.repeat(angles[order], counts[order])
    return replace(question.plan, angles=tuple(stops.tolist()))


def _starts(question: _Question, grid: Array, rng: np.random.Generator) -> Iterator[Ints]:
    """Choices within the budget: nearly equal angles, of various numbers, turned at random."""
    budget = question.budget
    most = int(budget.stroke / (budget.reading + budget.turn) + 1e-9)
    most = min(most, int(360.0 / max(question.spacing, _GRID)))
    for stops in np.unique(np.linspace(min(_FEWEST, most), most, _STARTS).round().astype(int)):
        counts = np.zeros(grid.size, dtype=np.int64)
        for degrees in np.arange(stops) * 360.0 / stops + rng.uniform(0.0, 360.0):
            free = np.flatnonzero(budget.free(grid, counts) & (counts == 0))
            if free.size:
                distance = angular_distance(grid[free], degrees)
                counts[free[int(distance.argmin())]] = 1
        yield counts


def _rivals(question: _Question) -> Iterator[tuple[str, TumblePlan]]:
    most = int(360.0 / question.spacing + 1e-9)
    filled = [
        replace(question.plan, positions=n, strokes=s)
        for n in range(_FEWEST, most + 1)
        if (s := strokes_within(replace(question.plan, positions=n), question.pace, question.hours))
    ]
    eight = [plan for plan in filled if plan.positions == 8]
    if eight:
        yield "8 positions", eight[0]
    if filled:
        yield "equally spaced", min(filled, key=question.loss)
    repeated = list(_repeated(question))
    if repeated:
        yield "equally spaced, repeated at its stops", min(repeated, key=question.loss)


def _repeated(question: _Question) -> Iterator[TumblePlan]:
    """Equal angles without the return, as many readings at each stop as fit."""
    budget = question.budget
    for positions in range(_FEWEST, int(360.0 / question.spacing + 1e-9) + 1):
        times = int((budget.stroke / positions - budget.turn) / budget.reading + 1e-9)
        if times:
            stops = np.repeat(turn_angles(positions)[:-1], times)
            yield replace(question.plan, angles=tuple(stops.tolist()))
