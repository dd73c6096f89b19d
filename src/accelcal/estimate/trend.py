"""When the readings of a run were taken, and a smooth drift over it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Ints
from accelcal.estimate.pure_error import FEW
from accelcal.numerics.grouping import grouped
from accelcal.numerics.sorting import distinct

_HIGHEST_POWER = 3  # of a drift, however many strokes there are


def directed(angle: Array, stroke: Ints) -> Ints:
    """Sort readings by angle and direction.

    Parameters
    ----------
    angle : ndarray, shape (n,)
        Angle of each reading [deg].
    stroke : ndarray of int, shape (n,)
        Its stroke; those of odd numbers go forward.

    Returns
    -------
    ndarray of int, shape (n,)
        The same number for readings of one angle in strokes of one direction: even back, and one
        more forward.
    """
    return np.asarray(2 * grouped(np.round(angle, 6)).cell + stroke % 2)


class Trend(NamedTuple):
    """Columns of a smooth drift over a run, shape (D, n, q), by what drifts.

    Attributes
    ----------
    bias : ndarray, shape (D, n, b)
        Powers of the time.
    scale_factor : ndarray, shape (D, n, s)
        Time by the cosine of the head angle; no column where the readings are too few.
    angle : ndarray, shape (D, n, s)
        Time by the sine of the head angle, as a turn of the unit in the head makes.
    """

    bias: Array
    scale_factor: Array
    angle: Array

    @property
    def columns(self) -> Array:
        """All columns, side by side."""
        return np.concatenate(self, axis=2)


def trend_of(angle: Array, stroke: Ints, moment: Array, directions: int) -> Trend:
    """Columns of a smooth drift over a run: of the bias, one for each two strokes, and of the rest.

    Parameters
    ----------
    angle : ndarray, shape (n,)
        Angle of each reading [deg].
    stroke : ndarray of int, shape (n,)
        Its stroke.
    moment : ndarray, shape (D, n)
        When each reading was taken, in any unit.
    directions : int
        At how many angles, in one direction each, they were taken.

    Returns
    -------
    Trend
        Powers of the time from -1 to 1, and that time by cosine and sine; no column where the
        readings are too few.

    Notes
    -----
    So many powers leave the alternation of forward and back strokes almost untouched.
    """
    x = _run_time(moment)
    free = angle.size - directions - FEW
    powers = min((distinct(stroke).size - 1) // 2, _HIGHEST_POWER)
    powers = max(0, min(powers, free))
    whole = powers > 0 and free >= powers + 2
    th = np.radians(angle)
    return Trend(
        bias=np.multiply.accumulate(np.repeat(x[..., None], powers, axis=-1), axis=-1),
        scale_factor=(x * np.cos(th))[..., None][..., : int(whole)],
        angle=(x * np.sin(th))[..., None][..., : int(whole)],
    )


def _run_time(moment: Array) -> Array:
    """Time from -1 at the first reading to 1 at the last."""
    span = np.ptp(moment, axis=1, keepdims=True)
    since = moment - moment.min(axis=1, keepdims=True)
    return np.asarray(2.0 * since / np.where(span > 0.0, span, 1.0) - 1.0)


def moments(angle: Array, stroke: Ints, time: Array | None) -> Array:
    """When each reading was taken.

    Parameters
    ----------
    angle : ndarray, shape (n,)
        Angle of each reading [deg].
    stroke : ndarray of int, shape (n,)
        Its stroke.
    time : ndarray, shape (T, n), or None
        Times of the readings of each table [s].

    Returns
    -------
    ndarray, shape (D, n)
        Times [s], or where there are none the places in the order of measuring [strokes]; one row
        where all tables have the same.
    """
    angles, row, _ = grouped(np.round(angle, 6))
    place = np.where(stroke % 2 == 1, row, angles.size - 1 - row)
    strokes = (stroke + place / angles.size)[None]
    if time is None:
        return np.asarray(strokes)
    known = np.isfinite(time).all(axis=1) & (np.ptp(time, axis=1) > 0.0)
    found = np.where(known[:, None], time, strokes)
    return found[:1] if (found == found[0]).all() else found
