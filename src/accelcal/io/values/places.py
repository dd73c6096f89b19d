"""Where readings were taken: the positions and angles of the head, as a table writes them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from accelcal.arrays import Array, Ints
from accelcal.errors import TableError
from accelcal.head_angles import angular_distance
from accelcal.io.values.cells import Column, numbers, whole_numbers
from accelcal.io.words.vocabulary import with_hyphen
from accelcal.numerics.sorting import distinct
from accelcal.units import degrees_in

_SIGN, _NUMBER = r"([+\-\u2212\u2013]?)", r"([0-9]+(?:[.,][0-9]+)?)"
_MARKED = re.compile(  # minutes have their mark, a blank behind them or nothing more
    rf"{_SIGN}([0-9]+) ?\u00b0"
    rf"(?: ?{_NUMBER}(?: ?['\u2032\u2019]| (?=[0-9])|$))?"
    rf"(?: ?{_NUMBER} ?(?:[\"\u2033\u201d]|''|\u2032\u2032)?)?"
)
_BELOW = "minutes and seconds are below 60"
_COLONS = re.compile(rf"{_SIGN}([0-9]+):{_NUMBER}(?::{_NUMBER})?")


def with_decimal_degrees(column: Column) -> Column:
    """Turn cells such as ``45°30'`` or ``45:30:15`` into decimal degrees.

    Raises TableError at the first cell with 60 minutes or seconds or more.

    Examples
    --------
    >>> cells = ["0°", "22°30'", "-0:00:36"]
    >>> with_decimal_degrees(Column("angle", "angle", None, cells, np.arange(3), "a.csv")).cells
    ['0', '22.5', '-0.01']
    """
    if isinstance(column.cells, np.ndarray) or not any(map(_is_divided, column.cells)):
        return column
    cells = [_decimal(column, index) for index in range(len(column.cells))]
    return column._replace(cells=cells, unit=column.unit or "deg")


def with_parts(angle: Column, parts: Sequence[Column]) -> Column:
    """Put minutes and seconds, which stand in columns of their own, to the degrees of an angle.

    A blank cell is 0. Raises TableError at the first cell with a fraction of a degree, or 60
    minutes or seconds or more.

    Examples
    --------
    >>> columns = [
    ...     Column(name, name, None, cells, np.arange(2), "a.csv")
    ...     for name, cells in (("angle", ["22", "-0"]), ("minutes", ["30", "15"]))
    ... ]
    >>> with_parts(columns[0], columns[1:]).cells.tolist()
    [22.5, -0.25]
    """
    degrees = numbers(angle)
    whole = np.isnan(degrees) | (degrees == np.rint(degrees))
    angle.check(whole, "{} has a fraction beside minutes", "write whole degrees, or no minutes")
    size = np.abs(degrees)
    for part, of_degree in zip(parts, (60.0, 3600.0), strict=False):
        values = np.nan_to_num(numbers(part))
        part.check((values >= 0.0) & (values < 60.0), "{} is not from 0 to below 60", _BELOW)
        size = size + values / of_degree
    return angle._replace(cells=np.copysign(size, degrees), unit=angle.unit or "deg")


def _is_divided(cell: str) -> bool:
    """Whether a cell has minutes or seconds."""
    found = _parts(cell)
    return found is not None and any(found.groups()[2:])


def _parts(cell: str) -> re.Match[str] | None:
    return _MARKED.fullmatch(cell) or _COLONS.fullmatch(cell)


def _decimal(column: Column, index: int) -> str:
    """Cell in decimal degrees; as it is where it is no such angle."""
    cell = str(column.cells[index])
    found = _parts(cell)
    if found is None:
        return cell
    parts = ((part or "0").replace(",", ".") for part in found.groups()[1:])
    degrees, minutes, seconds = map(float, parts)
    if max(minutes, seconds) >= 60.0:
        raise column.refuse(index, "{} has 60 minutes or seconds or more", _BELOW)
    size = f"{degrees + minutes / 60.0 + seconds / 3600.0:.12g}"
    return with_hyphen(found[1]) + size.replace(".", column.decimal)


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
