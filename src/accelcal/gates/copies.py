"""Readings that are a copy of others, to the last digit."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from accelcal.arrays import Array, Mask, Places
from accelcal.gates.plan import TablePlan, once_a_plan
from accelcal.gates.stack import TableStack
from accelcal.numerics.decimal_steps import common_steps, decimal_step
from accelcal.numerics.grouping import grouped

NO_CHANCE = 1e-6
"""Chance of readings that agree to the last digit, below which it is none."""

_IRRATIONAL = 2.0**0.5  # so many times a decimal number is none that another one makes up for


def are_copies(output: Array, noise: float) -> bool:
    """Tell whether others that agree with some readings in all digits are a copy of them.

    That is where the chance of it is below 1e-6, by the noise of a reading; not where that is NaN,
    as nothing tells it [output unit].

    Notes
    -----
    The difference of two readings has the density 1 / (2 sqrt(pi) noise) at zero, which is taken
    over a step of the readings.

    Examples
    --------
    >>> import numpy as np
    >>> are_copies(np.array([1.3501, 0.9546, 0.0046]), noise=2e-4)
    False
    >>> are_copies(np.array([1.350123, 0.954610, 0.004623]), noise=2e-4)
    True
    """
    smallest = np.spacing(np.abs(output).max())
    digit = np.array([decimal_step(output)])
    step = float(common_steps(output[:, None], digit)[0])
    return chance_of_agreement(step, noise, smallest) ** output.size < NO_CHANCE


def chance_of_agreement(step: float, noise: float, smallest: float) -> float:
    """Chance that two readings of the same agree to the last digit.

    It is the density of their difference at zero, 1 / (2 sqrt(pi) noise), over a step of the
    readings. The noise is NaN where nothing tells it; the smallest is the distance of neighbouring
    floating point numbers of their size [output unit].

    Examples
    --------
    >>> round(chance_of_agreement(1e-6, 1e-5, 1e-16), 4)
    0.0282
    """
    density = 1.0 / (2.0 * np.sqrt(np.pi) * np.fmax(noise, smallest))
    return float(min(max(step, 4.0 * smallest) * density, 1.0))


def copied_strokes(stack: TableStack) -> dict[int, tuple[int, int]]:
    """Find the tables with strokes that are the copy of another one at the same angles.

    Each is told with the first two of them.
    """
    noise, found = stack.noise * stack.scatter, {}
    for strokes in _strokes_alike(stack.plan):
        for table in _look_alike(stack.output[strokes[:, :2]]):
            output = stack.output[strokes, table]
            pair = _equal(output)
            if pair and are_copies(output[pair[0]], float(noise[table])):
                found[table] = tuple(stack.plan.stroke[strokes[list(pair), 0]].tolist())
    return found


def may_be_copied(stack: TableStack) -> Mask:
    """Tables with gaps in which two strokes are equal wherever both have a reading, shape (T,)."""
    found, plan = np.zeros(len(stack), dtype=np.bool_), stack.plan
    angles = grouped(plan.angle)
    whole = np.full((plan.strokes.key.size, angles.key.size, len(stack)), np.nan)
    there = stack.known(np.ones(stack.output.shape)) > 0.0
    whole[plan.strokes.cell, angles.cell] = np.where(there, stack.output, np.nan)
    for one, other in combinations(whole, 2):
        differs = ((one < other) | (one > other)).any(axis=0)
        found |= (one == other).any(axis=0) & ~differs
    return found


def _look_alike(beginnings: Array) -> list[int]:
    """Tables in which two strokes begin alike, from their first readings, (strokes, 2, T)."""
    mixed = np.sort(beginnings[:, 0] + _IRRATIONAL * beginnings[:, -1], axis=0)
    alike: list[int] = np.flatnonzero((mixed[1:] == mixed[:-1]).any(axis=0)).tolist()
    return alike


def copy_said(first: str, second: str) -> str:
    """Say what is a copy of what, and the remedy."""
    return f"{second} has the readings of {first} to the last digit: give it its own"


def _equal(output: Array) -> tuple[int, int] | None:
    """The first two rows that are equal; None where all differ."""
    known: dict[bytes, int] = {}
    for row, own in enumerate(output):
        before = known.setdefault(own.tobytes(), row)
        if before != row:
            return before, row
    return None


@once_a_plan
def _strokes_alike(plan: TablePlan) -> list[Places]:
    """Readings of the strokes at the same angles, by angle, shape (strokes, angles)."""
    by_angle: dict[bytes, list[Places]] = {}
    for own in plan.strokes.parts:
        ordered = own[np.argsort(plan.angle[own], kind="stable")]
        by_angle.setdefault(plan.angle[ordered].tobytes(), []).append(ordered)
    return [np.stack(strokes) for strokes in by_angle.values() if len(strokes) > 1]
