"""The step of which all readings are multiples, where their noise does not hide it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array
from accelcal.numerics.decimal_steps import decimal_step
from accelcal.numerics.grouping import distinct

_VISIBLE = 1.5
"""A step shows where it is so many times the noise that is left without it."""

_LOCKED = 0.8
"""Mean resultant of the places within a step, as angles, from which on readings lie on steps."""

_FEWEST_LEVELS = 5
"""Different outputs that it takes to look for a step between them."""

_NEAR = 0.03
"""Largest relative error of the first guess of a step."""

_MOST = 20_000
"""Steps that are tried about one guess."""

_BLOCK = 500
"""Steps that are tried at once, to bound the memory."""


class VisibleStep(NamedTuple):
    """A step of the readings."""

    step: float  # the step [output unit]
    uncertainty: float  # its standard uncertainty [output unit]
    p_value: float  # chance that readings without it are so close to multiples of any step


def visible_step(output: Array, scatter: float) -> VisibleStep | None:
    """Find the step of the readings, as long as it stands out of the noise.

    There is none below 1.5 standard deviations of a reading, rounding included [output unit].

    Notes
    -----
    The phases of the readings in a step are alike if it is theirs, and of all values if it is not
    (Rayleigh's test, for all steps tried).

    Examples
    --------
    >>> import numpy as np
    >>> readings = 2.44e-4 * np.round(np.sin(np.arange(60.0)) / 2.44e-4)
    >>> found = visible_step(readings, 1e-4)
    >>> round(found.step, 9), found.p_value < 1e-9
    (0.000244, True)
    """
    smallest = _least_step(scatter)
    for guess, near in _guesses(output):
        if guess * (1.0 + near) < smallest or not guess > 0.0:
            continue
        found = _locked(output, guess, near)
        if found is not None and found.step >= smallest and found.p_value < 1e-3:
            return found
    return None


def _least_step(scatter: float) -> float:
    """Step that is 1.5 standard deviations of the noise, whose rounding is in the scatter."""
    return scatter / float(np.sqrt(1.0 / _VISIBLE**2 + 1.0 / 12.0))


def _guesses(output: Array) -> list[tuple[float, float]]:
    """Steps that the values suggest, with the relative error of each."""
    levels = distinct(output)
    gaps = np.sort(np.diff(levels))
    gaps = gaps[gaps > 1e-9 * float(np.abs(output).max())]
    if gaps.size < _FEWEST_LEVELS:
        return []
    digit = decimal_step(output)
    counts = np.round((output - output[0]) / digit).astype(np.int64) if digit else np.zeros(1, int)
    exact = digit * float(np.gcd.reduce(counts))
    first = float(gaps[gaps.size // 10])
    written = max(digit, 1e-11 * float(np.abs(output).max()))
    near = min(3.0 * written / first, _NEAR)
    return [(exact, 0.0)] + [(first / part, near) for part in (1.0, 2.0, 3.0)]


def _locked(output: Array, guess: float, near: float) -> VisibleStep | None:
    """The step next to a guess, if the readings are multiples of it."""
    centred = output - output.mean()
    # relative: from one step tried to the next, the outermost reading moves by a fifth of a step
    spacing = 0.2 * guess / float(np.abs(centred).max())
    count = int(min(np.ceil(near / spacing), _MOST // 2))
    steps = guess / (1.0 + spacing * np.arange(-count, count + 1))
    lengths = np.concatenate(
        [
            _resultants(centred, np.asarray(steps[k : k + _BLOCK]))
            for k in range(0, steps.size, _BLOCK)
        ]
    )
    best = int(np.argmax(lengths))
    if lengths[best] < _LOCKED:
        return None
    chance = min(1.0, 3.0 * steps.size * float(np.exp(-output.size * lengths[best] ** 2)))
    return _refined(centred, float(steps[best]), max(chance, 1e-300))


def _resultants(values: Array, steps: NDArray[np.floating]) -> Array:
    return np.asarray(np.abs(np.exp(2j * np.pi * values / steps[:, None]).mean(axis=1)))


def _refined(values: Array, step: float, chance: float) -> VisibleStep:
    """Straight line through the values by their numbers of steps."""
    for _ in range(3):
        phase = np.angle(np.exp(2j * np.pi * values / step).mean()) * step / (2.0 * np.pi)
        number = np.round((values - phase) / step)
        centred = number - number.mean()
        spread = float(centred @ centred) or 1.0
        step = float(centred @ values) / spread
    rest = values - values.mean() - step * centred
    return VisibleStep(step, float(np.sqrt((rest @ rest) / values.size / spread)), chance)
