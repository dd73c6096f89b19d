"""Angles of the dividing head: positions by number, whole turns, angles as an encoder reads them.

The angle of a reading counts on over whole turns, so that 0 and 360 deg are two readings of one
place on the head.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arguments.numbers import check_number, number_array
from accelcal.arrays import Array
from accelcal.errors import InputError

__all__ = [
    "angular_distance",
    "head_positions",
    "nominal_angles",
    "position_angles",
    "turn_angles",
]

SAME_POSITION = 0.05
"""Readings of the head no further apart than this are of one position of it [deg]."""

_SAME_READING = 1e-6  # deg: what is left of rounding
_HALF_TURN = 180.0 - _SAME_READING  # deg: from here on a step may go either way


def checked_positions(positions: int) -> int:
    """Check the number of positions in a full turn, a whole number of 1 or more, and return it.

    Raises
    ------
    InputError
        If it is no whole number, or below 1.

    Examples
    --------
    >>> checked_positions(8)
    8
    """
    check_number(positions=positions)
    if positions < 1 or positions % 1:
        raise InputError(
            f"{positions} positions in a turn; a turn has at least 1 position, a whole number"
        )
    return int(positions)


def position_angles(position: ArrayLike, positions: int = 8) -> Array:
    """Head angle of the numbered positions of an equally spaced test.

    Parameters
    ----------
    position : array_like of int
        Position numbers J, counted from 1; J = `positions` + 1 is the return to J = 1.
    positions : int, default 8
        Number of positions in a full turn.

    Returns
    -------
    ndarray of float
        Head angle (J - 1) * 360 / `positions` [deg].

    Raises
    ------
    InputError
        If a number lies outside 1 .. `positions` + 1, or `positions` is below 1.

    References
    ----------
    Figure 2 of the paper: th_J = (J - 1) * 45 deg.

    Examples
    --------
    >>> import accelcal
    >>> accelcal.position_angles([1, 2, 9]).tolist()
    [0.0, 45.0, 360.0]
    """
    checked_positions(positions)
    given = number_array(position, "position")
    number = np.floor(given)
    outside = ~((number >= 1) & (number <= positions + 1) & (number == given))
    if outside.any():
        raise InputError(
            f"position {given[outside].flat[0]:g} is outside the turn; with {positions} positions"
            f" J is a whole number from 1 to {positions + 1:g}"
        )
    return np.asarray((number - 1.0) * 360.0 / positions)


def turn_angles(positions: int = 8) -> Array:
    """Head angles of one whole turn, the return to the start included [deg].

    Parameters
    ----------
    positions : int, default 8
        Number of positions in a full turn.

    Returns
    -------
    ndarray of float, shape (positions + 1,)
        0 .. 360 deg.

    Raises
    ------
    InputError
        If `positions` is below 1.

    Examples
    --------
    >>> turn_angles(4).tolist()
    [0.0, 90.0, 180.0, 270.0, 360.0]
    """
    return position_angles(np.arange(1, positions + 2), positions)


def head_positions(angle: Array) -> Array:
    """Head position of an angle: 0 and 360 deg are the same place on the head.

    Parameters
    ----------
    angle : ndarray
        Head angles [deg].

    Returns
    -------
    ndarray
        Angle within one turn, rounded to a micro-degree [deg].

    Examples
    --------
    >>> head_positions(np.array([0.1, 360.1, -90.0])).tolist()
    [0.1, 0.1, 270.0]
    """
    return np.asarray(np.mod(np.round(np.mod(angle, 360.0), 6), 360.0))


def nominal_angles(angle: Array) -> Array:
    """Bring angles as an encoder reads them to the nominal one of their position.

    Parameters
    ----------
    angle : ndarray, shape (n,)
        Head angles [deg].

    Returns
    -------
    ndarray, shape (n,)
        One angle for all readings of a position: its share of the turn where the positions are
        equally spaced, else the next multiple of `SAME_POSITION` [deg]. The very same array where
        each position has one angle already, or nothing tells the positions apart.

    Notes
    -----
    Neighbours round the turn no further apart than `SAME_POSITION` are of one position, and a
    position is no wider than twice that. Whole turns stay: 0 and 360 deg are two angles.

    Examples
    --------
    >>> nominal_angles(np.array([0.0004, 44.9991, 45.0008, 90.0, 359.9996])).tolist()
    [0.0, 45.0, 45.0, 90.0, 360.0]
    """
    turn = np.mod(angle, 360.0)
    order = np.argsort(turn)
    gaps = np.diff(turn[order], append=turn[order[0]] + 360.0)
    start = turn[order[(int(gaps.argmax()) + 1) % angle.size]]
    since = np.mod(turn - start, 360.0)
    order = np.argsort(since, kind="stable")
    first = np.diff(since[order], prepend=-np.inf) > SAME_POSITION
    place = np.empty(angle.size, dtype=np.intp)
    place[order] = np.cumsum(first) - 1
    starts = np.flatnonzero(first)
    lowest, highest = (f.reduceat(since[order], starts) for f in (np.minimum, np.maximum))
    width = float((highest - lowest).max())
    if not _SAME_READING < width <= 2.0 * SAME_POSITION:
        return angle
    nominal = _nominal(start + np.bincount(place, since) / np.bincount(place))[place]
    return np.asarray(nominal + 360.0 * np.round((angle - nominal) / 360.0))


def counted_on(angle: Array) -> Array:
    """Tell start and return of a stroke apart where the encoder begins anew after a turn.

    The nominal head angles of the stroke, shape (n,) [deg], are in the order of its readings. They
    stay but for 0 in place of 360 deg and the reverse, where the way of the stroke has it so: an
    encoder may tell 359.9994 deg at the start and 0.0003 at the return. It is the very same array
    where the readings do not go round the turn in one sense.

    Examples
    --------
    >>> counted_on(np.array([360.0, 90.0, 180.0, 270.0, 0.0])).tolist()
    [0.0, 90.0, 180.0, 270.0, 360.0]
    >>> counted_on(np.array([0.0, 270.0, 180.0, 90.0, 0.0])).tolist()
    [360.0, 270.0, 180.0, 90.0, 0.0]
    """
    step = _steps(angle)
    one_sense = step.size > 1 and abs(np.sign(step).sum()) == step.size
    in_the_turn = np.abs(angle - 180.0).max() < 180.0 + _SAME_READING
    once_round = abs(step.sum()) < 360.0 + _SAME_READING
    if not (one_sense and in_the_turn and once_round) or np.abs(step).max() >= _HALF_TURN:
        return angle
    way = angle[0] + np.concatenate([[0.0], np.cumsum(step)])
    way -= 360.0 * np.floor(way.min() / 360.0 + _SAME_READING)
    at_an_end = angular_distance(angle, 0.0) < _SAME_READING
    return np.where(at_an_end, way, angle)


def start_of_turn(angle: Array) -> float:
    """Tell where a stroke goes once round the turn, within which the encoder begins anew [deg].

    It is where the stroke starts and ends, by its nominal head angles in the order of its readings,
    shape (n,) [deg]; 0 where it goes no turn round, or none within 0 to 360 deg.

    Examples
    --------
    >>> start_of_turn(np.array([90.0, 180.0, 270.0, 0.0, 90.0]))
    90.0
    >>> start_of_turn(np.array([90.0, 180.0, 270.0, 360.0, 450.0]))
    0.0
    """
    step = _steps(angle)
    in_the_turn = np.abs(angle - 180.0).max() < 180.0 + _SAME_READING
    way = np.abs(step).max(initial=0.0), abs(step.sum())
    once_round = way[0] < _HALF_TURN and abs(way[1] - 360.0) < _SAME_READING
    at_zero = angular_distance(angle[:1], 0.0)[0] < _SAME_READING
    return float(angle[0]) if in_the_turn and once_round and not at_zero else 0.0


def from_start(angle: Array, start: float) -> Array:
    """Count angles on from the start of a turn: those below it follow behind 360 deg.

    They are nominal ones from 0 to 360 deg, shape (n,); what is counted is the angles less the
    start, from 0 to 360 deg.

    Examples
    --------
    >>> from_start(np.array([90.0, 180.0, 0.0, 45.0]), 90.0).tolist()
    [0.0, 90.0, 270.0, 315.0]
    """
    away = angle - start
    return np.where(away < -_SAME_READING, away + 360.0, away)


def _steps(angle: Array) -> Array:
    return _short_way(np.diff(angle))


def _nominal(means: Array) -> Array:
    """Shares of the turn where the means are near them, else multiples of `SAME_POSITION`."""
    for shares in (means.size, 360.0 / SAME_POSITION):
        nominal = np.round(means * shares / 360.0) * 360.0 / shares
        if (np.abs(nominal - means) <= SAME_POSITION / 2.0).all():
            break
    return np.asarray(np.mod(nominal, 360.0))


def angular_distance(angle: Array, other: Array | float) -> Array:
    """Distance of two angles by the shorter way round the turn.

    Parameters
    ----------
    angle, other : ndarray or float
        Angles [deg].

    Returns
    -------
    ndarray
        From 0 to 180 deg.

    Examples
    --------
    >>> angular_distance(np.array([1.0, 90.0, 270.0]), 360.0).tolist()
    [1.0, 90.0, 90.0]
    """
    return np.abs(_short_way(angle - other))


def _short_way(turn: Array) -> Array:
    """The shorter way round of turns, from -180 to 180 [deg]."""
    return np.asarray(np.mod(turn + 180.0, 360.0) - 180.0)
