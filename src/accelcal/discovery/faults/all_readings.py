"""What is wrong with all readings: noise that is larger where the angle matters more, and a step.

The noise is judged by the scatter of replicates; all readings are multiples of a step, where their
noise does not hide it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array
from accelcal.discovery.columns import dummies, orthonormal, without
from accelcal.discovery.noise.pure_error import TELLING, PureError, tilting
from accelcal.effects.conditions import Conditions
from accelcal.numerics.decimal_steps import decimal_step
from accelcal.numerics.grouping import distinct, grouped, median
from accelcal.numerics.probability import student_survival

_FEWEST_CELLS = 8
_STEPS = 30

_DRAWS = 1000
"""Readings drawn: the scatter of the slope is known to 2 %."""

_WORTH_DRAWS = 0.05
"""Chance of independent cells beyond which no draws are needed: those of real ones are larger."""


class _Cells(NamedTuple):
    """Readings of one position in one run, reached in the same sense, where they tell a scatter.

    `member`, shape (m, n), tells the readings of each of m cells, `square` is its a_p^2, and `free`
    are the degrees of freedom that are left of its readings.
    """

    member: Array
    square: Array
    free: Array

    @classmethod
    def of(cls, view: PureError, c: Conditions, mounting: NDArray[np.str_]) -> _Cells:
        member = dummies(c.run, mounting, np.round(c.angle, 6), c.rotation).T
        readings, free = member.sum(axis=1), member @ view.free
        telling = free > TELLING * readings
        square = (member @ c.cross**2) / readings
        return cls(member[telling], square[telling], free[telling])

    def scatter(self, residual: Array) -> Array:
        """Mean square of the readings of each cell, (m,) or (m, k), from (n,) or (n, k)."""
        return np.asarray(((self.member @ residual**2).T / self.free).T)

    def correlation(self, residual: Array) -> Array:
        """Correlation of the ranks of the scatter with a_p^2, of each column of (n, k)."""
        ranks = np.stack([_ranks(own) for own in self.scatter(residual).T])
        ranks -= ranks.mean(axis=1, keepdims=True)
        x = self.square - self.square.mean()
        return np.asarray((ranks @ x) / np.sqrt((ranks**2).sum(axis=1) * (x @ x)))


def chance_of_vibration(view: PureError, c: Conditions, mounting: NDArray[np.str_]) -> float:
    """Chance that the scatter of cells grows so much with a_p^2; 1 where there are too few.

    Notes
    -----
    One-sided test of the slope of the ranks, which no outlier and no heavy tail misleads: the cells
    (readings of one position in one run, reached in the same sense) are alike where the noise is
    even. They are not independent, as the drifts of the cycles were taken out of all of them:
    normal noise that is drawn tells how much the slope scatters. With four strokes in one run,
    where Student's quantile for independent cells was exceeded in 5 % in place of 1 %, that counts
    most. The draws are the same each time.
    """
    cells = _Cells.of(view, c, mounting)
    if cells.square.size < _FEWEST_CELLS or np.ptp(cells.square) < 1e-6:
        return 1.0
    if not np.ptp(cells.scatter(view.residual)) > 0.0:
        return 1.0
    r = float(cells.correlation(view.residual[:, None])[0])
    chance = _chance_of_slope(r, cells.square.size)
    if chance > _WORTH_DRAWS:
        return chance
    drawn = np.random.default_rng(0).standard_normal((view.residual.size, _DRAWS))
    variance = float((cells.correlation(without(drawn, view.taken)) ** 2).mean())
    return _chance_of_slope(r, min(1.0 / variance + 1.0, float(cells.square.size)))


def _chance_of_slope(r: float, size: float) -> float:
    """Chance that a correlation of so many independent pairs is larger."""
    dof = size - 2.0
    return student_survival(r * np.sqrt(dof / max(1.0 - r * r, 1e-12)), dof)


def _ranks(values: Array) -> Array:
    """Ranks, those of equal values alike."""
    _, place, members = grouped(values)
    return np.asarray((np.cumsum(members) - 0.5 * members)[place])


def vibration_over_noise(view: PureError, c: Conditions, mounting: NDArray[np.str_]) -> float:
    """Estimate how the variance grows with a_p^2, whatever the outliers.

    It is the variance from vibration at a_p = 1 g over that where the angle does not matter, by the
    medians of the cells of each a_p^2 [1].
    """
    cells = _Cells.of(view, c, mounting)
    square, scatter = np.round(cells.square, 6), cells.scatter(view.residual)
    levels = distinct(square)
    medians = np.array([median(scatter[square == level]) for level in levels])
    weights = np.sqrt([(square == level).sum() for level in levels])
    columns = np.column_stack([np.ones_like(levels), levels]) * weights[:, None]
    start, slope = np.linalg.lstsq(columns, medians * weights, rcond=None)[0]
    return max(float(slope), 0.0) / max(float(start), 0.02 * float(medians.max()))


def vibration(readings: Array, c: Conditions, mounting: NDArray[np.str_]) -> tuple[float, ...]:
    """Estimate normal noise from vibration by restricted maximum likelihood, without outliers [g].

    Returned are its standard deviation at a_p = 1 g, the standard uncertainty of that, and the
    standard deviation of the noise where the angle does not matter.

    Notes
    -----
    In the eigenvectors of what a_p^2 makes of the pure error, coordinate k has the variance
    sigma^2 + lambda_k vibration^2, independent of the others; Fisher's scoring does the rest.
    """
    basis = orthonormal(tilting(c, mounting))
    rest = np.linalg.qr(basis, mode="complete")[0][:, basis.shape[1] :]
    values, vectors = np.linalg.eigh(rest.T @ (c.cross[:, None] ** 2 * rest))
    squares = (vectors.T @ (rest.T @ readings)) ** 2
    columns = np.column_stack([np.ones_like(values), np.maximum(values, 0.0)])
    parts = np.array([0.5, 0.5]) * squares.mean()
    for _ in range(_STEPS):
        weight = 1.0 / (columns @ parts) ** 2
        normal = columns.T @ (weight[:, None] * columns)
        found = np.linalg.solve(normal, columns.T @ (weight * squares))
        parts = np.maximum(found, 1e-3 * np.abs(found).max())
    variance = float(np.linalg.inv(0.5 * normal)[1, 1])
    size = float(np.sqrt(parts[1]))
    return size, float(np.sqrt(variance)) / (2.0 * size), float(np.sqrt(parts[0]))


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
    # the rounding by a step is in the scatter
    smallest = scatter / float(np.sqrt(1.0 / _VISIBLE**2 + 1.0 / 12.0))
    for guess, near in _guesses(output):
        if guess * (1.0 + near) < smallest or not guess > 0.0:
            continue
        found = _locked(output, guess, near)
        if found is not None and found.step >= smallest and found.p_value < 1e-3:
            return found
    return None


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
    blocks = np.split(steps, range(_BLOCK, steps.size, _BLOCK))
    lengths = np.concatenate([_resultants(centred, block) for block in blocks])
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
