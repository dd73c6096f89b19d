"""Whether a unit settles: a line that bends, with a drift that is not the same in all years."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.recalibrations.jumps import FEWEST, likeliest, line_with_steps

_SETTLING = (0.1, 0.2, 0.4)
"""Time constants of a unit that settles, as parts of the whole time."""

_ENDS = np.array([0.0, 0.01, 0.99, 1.0])
"""Parts of the whole time between which the steepness at both ends is told."""


class Bend(NamedTuple):
    """What a bent line says of values.

    Attributes
    ----------
    chance : float
        That noise about a straight line looks so; it counts all shapes that are tried.
    slows : bool
        Whether the bent line is less steep at the last date than at the first.
    columns : ndarray, shape (n, 3)
        Columns of the bent line, the bend last.
    """

    chance: float
    slows: bool
    columns: Array


def bend_of(time: Array, values: Array, uncertainty: Array) -> Bend | None:
    """Compare a straight line with lines that bend: parabola and exponentials from the first date.

    Dates, rising [years], have values with standard uncertainties, all of shape (n,). It is what
    the best of them says; None of less values than a search for jumps needs.

    Examples
    --------
    >>> time = np.arange(10.0)
    >>> bend_of(time, np.exp(-time / 2.0) + 0.01 * np.cos(2.0 * time), np.ones(10)).slows
    True
    >>> round(bend_of(time, time + 0.01 * np.cos(2.0 * time), np.ones(10)).chance, 1)
    0.5
    """
    if time.size < FEWEST:
        return None
    columns, bends = line_with_steps(time, ()), _bends(_since(time))
    place, chance = likeliest(columns, bends, values, uncertainty)
    bent, u = np.column_stack([columns, bends[:, place]]), uncertainty
    _, drift, size = np.linalg.lstsq(bent / u[:, None], values / u, rcond=None)[0]
    ends = drift * np.ptp(time) * _ENDS + size * _bends(_ENDS)[:, place]
    first, _, last = np.abs(np.diff(ends))
    return Bend(chance, bool(last < first), bent)


def jumps_like_bends(
    time: Array, values: Array, uncertainty: Array, places: tuple[int, ...]
) -> tuple[int, ...]:
    """Find the jumps in whose place a bend of the line fits better, as of a unit that settles.

    There a parabola, or an exponential from the first date on, leaves a smaller sum of squares than
    the step. It has as many parameters.

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

    bends = _bends(_since(time)).T
    stepped = squares(line_with_steps(time, places))

    def fits_better(place: int) -> bool:
        others = line_with_steps(time, [other for other in places if other != place])
        return min(squares(np.column_stack([others, bend])) for bend in bends) < stepped

    return tuple(filter(fits_better, places))


def _since(time: Array) -> Array:
    """Parts of the whole time since the first date."""
    return np.asarray((time - time[0]) / (time[-1] - time[0]))


def _bends(since: Array) -> Array:
    """A parabola and the exponentials, shape (n, 1 + number of time constants)."""
    return np.column_stack([since**2, *(np.exp(-since / constant) for constant in _SETTLING)])
