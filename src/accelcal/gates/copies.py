"""Readings that are a copy of others, to the last digit."""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array, Places
from accelcal.gates.plan import TablePlan, once_a_plan
from accelcal.gates.stack import TableStack
from accelcal.numerics.decimal_steps import common_steps, decimal_step

_NO_CHANCE = 1e-6  # of readings that agree to the last digit
_IRRATIONAL = 2.0**0.5  # so many times a decimal number is none that another one makes up for


def are_copies(output: Array, noise: float) -> bool:
    """Tell whether others that agree with some readings in all digits are a copy of them.

    Parameters
    ----------
    output : ndarray, shape (n,)
        The readings [output unit].
    noise : float
        Standard deviation of one of them [output unit]; NaN where nothing tells it.

    Returns
    -------
    bool
        True where the chance of it is below 1e-6; False where the noise is not known.

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
    step = max(float(common_steps(output[:, None], digit)[0]), 4.0 * smallest)
    density = 1.0 / (2.0 * np.sqrt(np.pi) * np.fmax(noise, smallest))
    return float(min(step * density, 1.0) ** output.size) < _NO_CHANCE


def copied_strokes(stack: TableStack) -> dict[int, tuple[int, int]]:
    """Find strokes that are the copy of another one at the same angles.

    Parameters
    ----------
    stack : TableStack
        The tables.

    Returns
    -------
    dict of int to tuple of int
        Tables with such strokes, each with the first two of them.
    """
    noise, found = stack.noise * stack.scatter, {}
    for strokes in _strokes_alike(stack.plan):
        for table in _look_alike(stack.output[strokes[:, :2]]):
            output = stack.output[strokes, table]
            pair = _equal(output)
            if pair and are_copies(output[pair[0]], float(noise[table])):
                found[table] = tuple(stack.plan.stroke[strokes[list(pair), 0]].tolist())
    return found


def _look_alike(beginnings: Array) -> list[int]:
    """Tables in which two strokes begin alike, from their first readings, (strokes, 2, T)."""
    mixed = np.sort(beginnings[:, 0] + _IRRATIONAL * beginnings[:, -1], axis=0)
    alike: list[int] = np.flatnonzero((mixed[1:] == mixed[:-1]).any(axis=0)).tolist()
    return alike


def copy_said(first: str, second: str) -> str:
    """Say what is a copy of what, and the remedy.

    Parameters
    ----------
    first, second : str
        The original and its copy.

    Returns
    -------
    str
        The finding.
    """
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
