"""The scatter of replicates, when the readings of a run were taken, and a smooth drift over it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from accelcal.arrays import Array, Ints
from accelcal.numerics.grouping import Grouped, distinct, grouped

FEW = 3
"""Degrees of freedom below which a scatter of its own says too little."""


class Scatter(NamedTuple):
    """Sums of squares in units of the declared scatter, shape (R,), with their dof."""

    squares: Array
    dof: Any  # float, or ndarray of shape (R,)

    @property
    def variance(self) -> Array:
        """Mean square."""
        return np.asarray(self.squares / self.dof)

    @classmethod
    def pooled(cls, scatters: Iterable[Scatter]) -> Scatter:
        """Put those of several tables together."""
        squares, dof = np.zeros(1), 0.0
        for scatter in scatters:
            squares, dof = squares + scatter.squares, dof + scatter.dof
        return cls(squares, dof)


def pure_error(output: Array, size: Array, positions: Grouped) -> Scatter:
    """Scatter of replicates about their weighted means, in R records, shape (R, n) [output unit].

    It counts in units of the declared standard uncertainties, shape (n,), which may be ones; of
    shape (R, n) they are infinite where a record has no reading.

    Examples
    --------
    >>> from accelcal.numerics.grouping import grouped
    >>> found = pure_error(np.array([[1.0, 3.0, 9.0]]), np.ones(3), grouped(np.array([0, 0, 90])))
    >>> found.squares.tolist(), float(found.dof)
    ([2.0], 1.0)
    """
    weight = size**-2.0
    means = positions.weighted_sums(output, weight) / positions.sums(weight[..., None])[..., 0]
    apart = (output - means[:, positions.cell]) / size
    dof = np.isfinite(size).sum(axis=-1) - float(positions.key.size)
    return Scatter(np.einsum("rn,rn->r", apart, apart), dof)


_HIGHEST_POWER = 3  # of a drift, however many strokes there are


def directed(angle: Array, stroke: Ints) -> Ints:
    """Sort readings by angle [deg] and direction: odd strokes go forward.

    The same number is that of readings of one angle in strokes of one direction: even back, and one
    more forward.
    """
    return np.asarray(2 * grouped(np.round(angle, 6)).cell + stroke % 2)


class Trend(NamedTuple):
    """Columns of a smooth drift over a run, shape (D, n, q), by what drifts."""

    bias: Array  # powers of the time
    scale_factor: Array  # time by the cosine of the head angle; none where readings are too few
    angle: Array  # time by its sine, as a turn of the unit in the head makes

    @property
    def columns(self) -> Array:
        """All columns, side by side."""
        return np.concatenate(self, axis=2)


def trend_of(angle: Array, stroke: Ints, moment: Array, directions: int) -> Trend:
    """Columns of a smooth drift over a run: of the bias, one for each two strokes, and of the rest.

    The readings have angles [deg], strokes and moments, shape (D, n), in any unit; they were taken
    at so many angles, in one direction each. The powers are those of the time from -1 to 1; there
    is no column where the readings are too few.

    Notes
    -----
    So many powers leave the alternation of forward and back strokes almost untouched.
    """
    x = _run_time(moment)
    free = angle.size - directions - FEW
    powers = max(0, min(powers_of(distinct(stroke).size), free))
    whole = powers > 0 and free >= powers + 2
    th = np.radians(angle)
    return Trend(
        bias=np.multiply.accumulate(np.repeat(x[..., None], powers, axis=-1), axis=-1),
        scale_factor=(x * np.cos(th))[..., None][..., : int(whole)],
        angle=(x * np.sin(th))[..., None][..., : int(whole)],
    )


def powers_of(strokes: int) -> int:
    """How many powers of the time a drift over so many strokes has, where readings are enough.

    Examples
    --------
    >>> [powers_of(strokes) for strokes in (2, 3, 6, 12)]
    [0, 1, 2, 3]
    """
    return min((strokes - 1) // 2, _HIGHEST_POWER)


def _run_time(moment: Array) -> Array:
    """Time from -1 at the first reading to 1 at the last."""
    span = np.ptp(moment, axis=1, keepdims=True)
    since = moment - moment.min(axis=1, keepdims=True)
    return np.asarray(2.0 * since / np.where(span > 0.0, span, 1.0) - 1.0)


def moments(angle: Array, stroke: Ints, time: Array | None) -> Array:
    """When each reading was taken, shape (D, n), D being one where all tables have the same.

    By the times of T tables, shape (T, n) [s], or where there are none by the places in the order
    of measuring, from angles [deg] and strokes [strokes].
    """
    angles, row, _ = grouped(np.round(angle, 6))
    place = np.where(stroke % 2 == 1, row, angles.size - 1 - row)
    strokes = (stroke + place / angles.size)[None]
    if time is None:
        return np.asarray(strokes)
    known = np.isfinite(time).all(axis=1) & (np.ptp(time, axis=1) > 0.0)
    found = np.where(known[:, None], time, strokes)
    return found[:1] if (found == found[0]).all() else found
