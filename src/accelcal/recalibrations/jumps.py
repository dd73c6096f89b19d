"""Jumps and bends of a line through calibrations, with chances that are honest for the search."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Places
from accelcal.recalibrations.regression import ROUNDING, proportions, shares

FEWEST = 5
"""Calibrations that a jump needs: three for line and step, and two to see the scatter."""

SMALLEST_CHANCE = 0.001
"""Chances below it are not resolved by the values that are drawn."""

_SIDE = 2  # calibrations before and behind a jump; a single one is an outlier or a jump
_DRAWS, _MORE_DRAWS, _NEAR = 1999, 20_000, 0.05
"""Values drawn, and as many more for chances below 0.05: of 1999 a chance of 0.005 is within a
third of itself, and as the draws are the same each time, so would be the rate of false alarms."""

_AT_A_TIME = 100_000
"""Values drawn at a time, which the caches of a processor hold."""

_MOST = 5

_PAIRS = 10.0
"""Chances of pairs are so many times as large, so that they add a tenth to the false alarms."""


class _Measure(NamedTuple):
    """What tests further columns where the standard deviations are in one proportion.

    `roots`, shape (n,), are their inverses; `base`, shape (n, p), is an orthonormal basis of the
    line in the values times `roots`, and `further`, shape (n, s), are the columns apart from it,
    each of length 1.
    """

    roots: Array
    base: Array
    further: Array
    constant: float

    @classmethod
    def of(cls, columns: Array, tried: Array, sigma: Array) -> _Measure:
        """Work it out of the columns of the line and those that are tried beside them."""
        base, triangle = np.linalg.qr(columns / sigma[:, None])
        further = tried / sigma[:, None]
        further -= base @ (base.T @ further)
        further /= np.sqrt((further**2).sum(axis=0))
        constant = -np.log(sigma).sum() - np.log(np.abs(np.diagonal(triangle))).sum()
        return cls(1.0 / sigma, base, further, float(constant))

    def likelihoods(self, values: Array) -> tuple[Array, Array]:
        """Logarithms of the restricted likelihood of the line, and of it with each column.

        Of each row of values, whose size is free, so that it takes the place of a variance.
        """
        whitened = values * self.roots
        left = whitened - (whitened @ self.base) @ self.base.T
        squares = (left**2).sum(axis=1, keepdims=True)
        taken = (left @ self.further) ** 2
        dof = values.shape[1] - self.base.shape[1]
        line = self.constant - 0.5 * dof * np.log(np.maximum(squares, ROUNDING))
        stepped = self.constant - 0.5 * dof * np.log(np.maximum(squares - taken, ROUNDING))
        return line[:, 0], stepped


class Search(NamedTuple):
    """What a search for jumps found."""

    places: tuple[int, ...]  # number of calibrations before each jump, in the order found
    # for each, the chance that a straight line with what was found before looks so by noise; of two
    # that were found together, that of both
    p_values: tuple[float, ...]
    # the same of the largest jump that was not believed; None where there was none to try
    rest: float | None
    gaps: int  # gaps between dates that were searched


def search_jumps(time: Array, values: Array, uncertainty: Array, alpha: float) -> Search:
    """Search for jumps, one after the other, until the largest may be noise.

    Dates, rising [years], have values with standard uncertainties, all of shape (n,). A jump with a
    larger chance than alpha is not believed.

    Notes
    -----
    For each gap between dates with two calibrations or more on both sides, the likelihoods of the
    line with and without a step are compared, each the mean over proportions of the variances from
    as stated to all alike; where they are alike, that is F. The largest ratio of all gaps is held
    against that of values that are drawn from the line alone, so that the chance counts the
    search. Each is drawn in one of the proportions, by how likely the values make it. The draws
    are the same each time.

    A jump and its return hide each other where calibrations are few. Where no jump is believed,
    each pair is held against the line as well: the chance is that of F with the correction of
    Bonferroni for their number, the largest of all proportions, ten times.
    """
    places: list[int] = []
    p_values: list[float] = []
    rest = None
    while len(places) < _MOST:
        found = _next_jump(time, values, uncertainty, places)
        if found is None:
            break
        if found[1] > alpha:
            rest, found = found[1], _next_pair(time, values, uncertainty, places)
        some, chance = found
        if chance > alpha:
            break
        rest = None
        places += some
        p_values += [chance] * len(some)
    return Search(tuple(places), tuple(p_values), rest, len(_places_to_try(time, [])))


def line_with_steps(time: Array, places: Sequence[int] | Places) -> Array:
    """Columns of a straight line with steps: 1, time less its mean [years], and a step for each.

    The places are numbers of calibrations before each step.
    """
    steps = np.greater_equal.outer(np.arange(time.size), np.array(places, dtype=np.intp))
    return np.column_stack([np.ones(time.size), time - time.mean(), steps])


def _next_jump(
    time: Array, values: Array, uncertainty: Array, places: list[int]
) -> tuple[tuple[int, ...], float] | None:
    """Place of the largest jump beside those known, and its chance; None where none can be."""
    columns = line_with_steps(time, places)
    tried = np.array(_places_to_try(time, places), dtype=np.intp)
    if not tried.size or time.size - columns.shape[1] - 1 < _SIDE:
        return None
    place, chance = likeliest(columns, line_with_steps(time, tried)[:, 2:], values, uncertainty)
    return (int(tried[place]),), chance


def _next_pair(
    time: Array, values: Array, uncertainty: Array, places: list[int]
) -> tuple[tuple[int, ...], float]:
    """Places of the two jumps that values ask for most beside those known, and their chance."""
    columns = line_with_steps(time, places)
    tried = np.array(_places_to_try(time, places), dtype=np.intp)
    first, second = np.nonzero(np.subtract.outer(tried, tried) <= -_SIDE)
    dof = time.size - columns.shape[1] - 2
    if not first.size or dof < _SIDE:
        return (), 1.0
    steps = line_with_steps(time, tried)[:, 2:]
    sigma = np.sqrt(proportions(uncertainty**2))
    left = np.array([_left_by_pairs(_Measure.of(columns, steps, own), values) for own in sigma])
    shares_left = left.max(axis=0)[first, second]
    place = int(shares_left.argmin())
    chance = _PAIRS * first.size * float(shares_left[place]) ** (0.5 * dof)  # F of 2 and dof
    return (int(tried[first[place]]), int(tried[second[place]])), min(1.0, chance)


def _left_by_pairs(measure: _Measure, values: Array) -> Array:
    """Part of the squares about the line that each pair of further columns leaves."""
    whitened = values * measure.roots
    rest = whitened - measure.base @ (whitened @ measure.base)
    one = (rest @ measure.further) / np.sqrt(max(float(rest @ rest), ROUNDING))
    alike = measure.further.T @ measure.further
    both = one**2 + one[:, None] ** 2 - 2.0 * alike * np.multiply.outer(one, one)
    return np.asarray(np.clip(1.0 - both / np.maximum(1.0 - alike**2, ROUNDING), ROUNDING, 1.0))


def likeliest(columns: Array, tried: Array, values: Array, uncertainty: Array) -> tuple[int, float]:
    """Find which further column values ask for most, and the chance that noise asks as much.

    Beside the columns that the values have, shape (n, p), s others are tried, shape (n, s), where
    n > p + 1; the values and their standard uncertainties are of shape (n,). The chance is that of
    the largest of all, by values that are drawn as `search_jumps` says.

    Examples
    --------
    >>> time = np.arange(10.0)
    >>> columns = np.stack([np.ones(10), time], axis=1)
    >>> tried = np.stack([time**3, time**2], axis=1)
    >>> values = time**2 + np.cos(2.0 * time)
    >>> place, chance = likeliest(columns, tried, values, np.ones(10))
    >>> place, chance < 0.001
    (1, True)
    """
    line = np.linalg.lstsq(columns, values, rcond=None)[0]
    sigma = np.sqrt(proportions(uncertainty**2))
    measures = [_Measure.of(columns, tried, each) for each in sigma]
    found, likelihood = _log_ratios(measures, (values - columns @ line)[None, :])
    shared = shares(likelihood[:, 0])
    random = np.random.default_rng(0)
    drawn = larger = 0
    chance = 0.0
    for draws in (_DRAWS, _MORE_DRAWS):
        if chance > _NEAR:
            break
        for rows in _in_parts(draws, values.size):
            drawn_from = random.choice(len(sigma), rows, p=shared)
            noise = sigma[drawn_from] * random.standard_normal((rows, values.size))
            by_noise, _ = _log_ratios(measures, noise)
            larger += int((by_noise.max(axis=1) >= found.max()).sum())
        drawn += draws
        chance = (1 + larger) / (1 + drawn)
    return int(found.argmax()), chance


def _in_parts(draws: int, values: int) -> list[int]:
    """Draws to be made at a time, of so many values each."""
    most = max(_AT_A_TIME // values, 1)
    return [min(most, draws - done) for done in range(0, draws, most)]


def _places_to_try(time: Array, places: list[int]) -> list[int]:
    """Gaps between dates with enough calibrations on both sides, up to the next known jump."""
    edges = [0, *sorted(places), time.size]
    return [
        place
        for low, high in pairwise(edges)
        for place in range(low + _SIDE, high - _SIDE + 1)
        if time[place] > time[place - 1]
    ]


def _log_ratios(measures: Sequence[_Measure], values: Array) -> tuple[Array, Array]:
    """Logarithms of the likelihood with each column over that of the line, and those of the line.

    Of each row of values, which are off the line: shape (rows, tried), and (measures, rows).
    """
    both = [measure.likelihoods(values) for measure in measures]
    line, stepped = (np.array(each) for each in zip(*both, strict=True))
    return _log_of_sum(stepped) - _log_of_sum(line)[:, None], line


def _log_of_sum(logarithms: Array) -> Array:
    """Logarithms of the sums along the first axis, as numpy.logaddexp.reduce gives them."""
    largest = logarithms.max(axis=0)
    return np.asarray(largest + np.log(np.exp(logarithms - largest).sum(axis=0)))


_SETTLING = (0.1, 0.2, 0.4)
"""Time constants of a unit that settles, as parts of the whole time."""

_SHORT = 0.01
"""Part of the whole time in which the steepness at both ends of a bend is told."""

_SLOPE = 0
"""Place of another slope among the bends; from the first date on it is none beside a line."""

_ALIKE = 1e-6
"""Size of a bend beside a line with steps, over its own, below which it is none of its own."""


class Bend(NamedTuple):
    """What a bent line says of values."""

    chance: float  # that noise about a straight line looks so; it counts all shapes that are tried
    # whether the bent line is less steep at the last date than where the bend begins, or than
    # before a jump from which on it has another slope
    slows: bool
    start: int  # number of calibrations before the bend
    columns: Array  # shape (n, 3 + number of jumps): columns of the bent line, the bend last


def bend_of(
    time: Array, values: Array, uncertainty: Array, places: Sequence[int] = ()
) -> Bend | None:
    """Compare a line with those that bend: parabola and exponentials from the first date or a jump.

    Dates, rising [years], have values with standard uncertainties, all of shape (n,), and jumps,
    `places` being the numbers of calibrations before each. It is what the best of them says; None
    of less values than a search for a further jump needs.

    Examples
    --------
    >>> time = np.arange(10.0)
    >>> bend_of(time, np.exp(-time / 2.0) + 0.01 * np.cos(2.0 * time), np.ones(10)).slows
    True
    >>> round(bend_of(time, time + 0.01 * np.cos(2.0 * time), np.ones(10)).chance, 1)
    0.5
    """
    if time.size < FEWEST + len(places):
        return None
    columns = line_with_steps(time, places)
    tried = [(start, shape) for start in (0, *places) for shape in range(2 + len(_SETTLING))]
    bends = np.column_stack([_from(time, start)[:, shape] for start, shape in tried])
    own = bends - columns @ np.linalg.lstsq(columns, bends, rcond=None)[0]
    kept = np.flatnonzero(np.linalg.norm(own, axis=0) > _ALIKE * np.linalg.norm(bends, axis=0))
    place, chance = likeliest(columns, bends[:, kept], values, uncertainty)
    start, shape = tried[kept[place]]
    bent, u = np.column_stack([columns, bends[:, kept[place]]]), uncertainty
    line = np.linalg.lstsq(bent / u[:, None], values / u, rcond=None)[0]
    left = 1.0 - _since(time)[start]
    ends = np.array([0.0, _SHORT, left - _SHORT, left])
    straight, off = line[1] * np.ptp(time) * ends, line[-1] * _bends(ends)[:, shape]
    first, _, last = np.abs(np.diff(straight + off))
    before = abs(straight[1]) if shape == _SLOPE else first
    return Bend(chance, bool(last < before), start, bent)


def jumps_like_bends(
    time: Array, values: Array, uncertainty: Array, places: tuple[int, ...]
) -> tuple[int, ...]:
    """Find the jumps in whose place a bend of the line fits better, as of a unit that settles.

    There a parabola, or an exponential, from the first date or another jump on, leaves a smaller
    sum of squares than the step. It has as many parameters.

    Examples
    --------
    >>> time = np.arange(10.0)
    >>> jumps_like_bends(time, np.exp(-time / 2.0), np.ones(10), (2,))
    (2,)
    >>> jumps_like_bends(time, 1.0 * (time > 4.0), np.ones(10), (5,))
    ()
    """

    def squares(columns: Array) -> float:
        seen, told = columns / uncertainty[:, None], values / uncertainty
        return float(((told - seen @ np.linalg.lstsq(seen, told, rcond=None)[0]) ** 2).sum())

    stepped = squares(line_with_steps(time, places))

    def fits_better(place: int) -> bool:
        others = [other for other in places if other != place]
        line = line_with_steps(time, others)
        bends = np.hstack([_from(time, start) for start in (0, *others)]).T
        return min(squares(np.column_stack([line, bend])) for bend in bends) < stepped

    return tuple(filter(fits_better, places))


def _since(time: Array) -> Array:
    """Parts of the whole time since the first date."""
    return np.asarray((time - time[0]) / (time[-1] - time[0]))


def _from(time: Array, start: int) -> Array:
    """The bends, from so many calibrations on; 0 before."""
    since = _since(time) - _since(time)[start]
    return np.where(np.arange(time.size)[:, None] < start, 0.0, _bends(np.maximum(since, 0.0)))


def _bends(since: Array) -> Array:
    """Another slope, a parabola and the exponentials, shape (n, 2 + number of time constants)."""
    settled = (np.exp(-since / constant) for constant in _SETTLING)
    return np.column_stack([since, since**2, *settled])
