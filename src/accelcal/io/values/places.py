"""Where readings were taken: the positions and angles of the head, as a table has them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from accelcal.arrays import Array, Ints
from accelcal.errors import TableError
from accelcal.head_angles import angular_distance
from accelcal.io.values.cells import Column, numbers, whole_numbers
from accelcal.numerics.grouping import distinct
from accelcal.units import degrees_in

MAXIMUM_ANGLE = 36000.0
"""Above it an angle is taken for a mistake: a hundred turns of the head [deg]."""

_LEAST_STEP, _ROUNDED = 2.5, 0.02
"""Fractions of a turn that radians are of [deg], and the part of one by which they are rounded."""

_ANGLES = "head angles in degrees have the heading 'angle'"
"""Remedy where angles stand under `position`."""

_FROM_ZERO = "add 1 to each where they are counted from 0"


def places_of_rows(columns: Mapping[str, Column], positions: int) -> tuple[Ints, Array]:
    """Read positions and head angles.

    A position is 0 where there is none. Angles [deg] are as written where they are, else those of
    the positions. Raises TableError at the first cell that is no such place, or where both do not
    agree.
    """
    position, angle = _position(columns.get("position"), positions), None
    if "angle" in columns:
        angle = _angle(columns["angle"])
    if position is None:
        column = columns["angle"]
        assert angle is not None  # one of the two is required
        column.check(~np.isnan(angle), "{} is missing", "write the head angle in every row")
        return np.zeros(angle.size, dtype=np.int64), angle
    nominal = np.where(position > 0, (position - 1) * 360.0 / positions, np.nan)
    if angle is None:
        angle = nominal
    else:
        _check_agreement(columns["angle"], angle, nominal, positions)
    angle = np.where(np.isnan(angle), nominal, angle)
    remedy = "write the position in every row"
    columns["position"].check(~np.isnan(angle), "{} is missing", remedy)
    return position, angle


def _angle(column: Column) -> Array:
    values = in_degrees(column, numbers(column))
    beyond = np.abs(values) > MAXIMUM_ANGLE
    column.check(~beyond, "{} is no angle of a head", "write head angles in degrees")
    return values


def in_degrees(column: Column, angle: Array) -> Array:
    """Angles of a column in degrees, NaN where one is missing.

    Raises TableError at the first that is no whole number, if they look like radians and no unit is
    written: they go around in a few degrees, and not by whole ones. Below a unit of degrees, as for
    a tilt, where they are fractions of a turn in radians.
    """
    if (size := degrees_in(column.unit or "")) != 1.0:
        return angle * size
    known = angle[~np.isnan(angle)]
    if known.size == 0 or np.ptp(known) < 1.5 or np.abs(known).max() > 2.0001 * np.pi:
        return angle
    broken = np.flatnonzero(angle % 1.0 > 0.0)
    steps = np.degrees(known) / _LEAST_STEP
    if broken.size and (column.unit is None or np.abs(steps - np.rint(steps)).max() < _ROUNDED):
        problem = f"angles of at most {np.abs(known).max():g} look like radians"
        remedy = "write their unit in the heading, as angle [deg] or angle [rad]"
        raise TableError(problem, remedy, source=column.source, line=int(column.lines[broken[0]]))
    return angle


def notes_of_minutes(angle: Array) -> list[str]:
    """Say where angles look like degrees with minutes behind the decimal mark.

    That is where with minutes, and not with decimals, they divide the turn evenly. Angles are in
    deg.

    Examples
    --------
    >>> protocol = [0.0, 22.3, 45.0, 67.3, 90.0, 112.3, 135.0, 157.3, 180.0, 202.3, 225.0, 247.3]
    >>> for note in notes_of_minutes(np.array([*protocol, 270.0, 292.3, 315.0, 337.3, 360.0])):
    ...     print(note)
    angles such as 22.3 deg divide the turn evenly as 22°30': write them so if 30 are minutes
    """
    if not (angle % 1.0).any():
        return []
    place = distinct(np.round(angle % 360.0, 9))
    minutes = np.round(place % 1.0 * 100.0, 6)
    even = np.arange(place.size) * 360.0 / place.size
    if (minutes % 1.0).any() or not np.allclose(place // 1.0 + minutes / 60.0, even):
        return []
    first = int(np.flatnonzero(minutes)[0])
    written = f"{place[first] // 1.0:g}°{minutes[first]:02.0f}'"
    meant = f"write them so if {minutes[first]:02.0f} are minutes"
    return [f"angles such as {place[first]:g} deg divide the turn evenly as {written}: {meant}"]


def _position(column: Column | None, positions: int) -> Ints | None:
    if column is None:
        return None
    last = f"J runs from 1 to {positions + 1} in a turn of {positions} positions"
    number = whole_numbers(column, f"{last}; {_FROM_ZERO}; {_ANGLES}")
    remedy = f"{last}, and a header line '# positions: N' declares another number; {_ANGLES}"
    column.check(number <= positions + 1, "{} is outside the turn", remedy)
    return number


def _check_agreement(column: Column, angle: Array, nominal: Array, positions: int) -> None:
    """Demand that angle and position differ by less than half a step of the head."""
    away = angular_distance(angle, nominal)
    half = 180.0 / positions
    problem = f"{{}} does not belong to its position, which it misses by more than {half:g} deg"
    column.check(~(away > half), problem, "correct one, or declare '# positions: N'")
