"""Whether a unit settles: a line that bends, with a drift that is not the same in all years."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.recalibrations.jumps import FEWEST, likeliest, line_with_steps

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
