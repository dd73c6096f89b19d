"""Where readings were taken: the positions and angles of the head, as a table writes them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from accelcal.arguments.kinds import shown
from accelcal.arrays import Array, Ints, Mask
from accelcal.errors import TableError
from accelcal.head_angles import angular_distance
from accelcal.io.values.cells import Column, labels, numbers, whole_numbers
from accelcal.io.words.vocabulary import BACK, FORWARD, with_hyphen
from accelcal.numerics.grouping import distinct
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


# -- strokes -------------------------------------------------------------------------------------

_ASIDE = "column direction does not tell forward from back and was set aside"
_COUNTED = "strokes were counted by the column direction, odd ones forward and even ones back"
_FEW = 0.25
"""Part of the readings against the direction of their stroke that may still be mistakes."""

_FEWEST_STEPS = 3
"""Steps of the head in each direction that tell which it is."""


def strokes_by_direction(
    column: Column, number: Ints, row: Ints, angle: Array, *, cycles: bool = False
) -> tuple[Ints, tuple[str, ...]]:
    """Count strokes by number and direction: odd ones go forward and even ones back.

    The column has the direction of each row; of each reading there are the number of its stroke, or
    of its cycle of one stroke forward and one back, its row, and its head angle [deg]. Numbers that
    are called cycles do not tell the strokes. Notes say how these were counted, where not as the
    numbers have them, or that the column was set aside. Raises TableError where a direction has no
    known name, or few readings are against that of their stroke.
    """
    of_row, names = labels(column)
    words = [with_hyphen(name.casefold()) for name in names]
    is_back = np.array([1.0 if own in BACK else 0.0 if own in FORWARD else np.nan for own in words])
    label, even = of_row[row], number % 2 == 0
    if not cycles and _tell_what_numbers_tell(is_back, label, even):
        return number, ()
    told: tuple[str, ...] = ()
    if np.isnan(is_back).all():
        within = (np.diff(number) == 0) & (np.diff(label) != 0)
        two_ways = len(names) == 2 and within.any()
        if not cycles and not two_ways:  # words of something else, as heating
            return number, (_ASIDE,)
        if two_ways and not np.isnan(ways := _ways(label, angle)).any():
            is_back = ways
            forward, back = (shown(names[i]) for i in np.argsort(ways))
            told = (f"direction {forward} is forward and {back} back, as the angles show",)
    known = ~np.isnan(is_back)[of_row]
    remedy = "write forward or back, or number the strokes"
    column.check(known, "{} is neither forward nor back", remedy)
    back = is_back[label] == 1.0
    against: Mask = back != even
    if not cycles and against.mean() < _FEW:
        right = np.ones(of_row.size, dtype=bool)
        right[row[against]] = False
        remedy = "odd strokes go forward and even ones back, so correct one of both"
        column.check(right, "{} contradicts the number of the stroke", remedy)
    strokes = np.where(back, 2 * number, 2 * number - 1)
    return strokes, (*told, f"{_COUNTED}, up to {strokes.max()}")


def _ways(label: Ints, angle: Array) -> Array:
    """1 for a word with which most angles fall from row to row, 0 where they rise, else NaN."""
    step, same = np.sign(np.diff(angle)), np.diff(label) == 0
    ways = np.array([np.sum(step[same & (label[1:] == own)]) for own in (0, 1)])
    count = np.array([np.sum(same & (label[1:] == own)) for own in (0, 1)])
    are_ways = np.all((2 * abs(ways) > count) & (count >= _FEWEST_STEPS)) and ways.prod() < 0
    return np.where(are_ways, ways < 0, np.nan)


def _tell_what_numbers_tell(is_back: Array, label: Ints, even: Mask) -> bool:
    """Whether odd strokes have one direction and even ones another, whatever its name."""
    evens = np.bincount(label, even, minlength=is_back.size)
    whole = np.bincount(label, minlength=is_back.size)
    if not np.isnan(is_back[whole > 0]).any():
        return bool(np.array_equal(evens, np.where(whole > 0, is_back, 0.0) * whole))
    odd, both = (whole > 0) & (evens == 0), (evens > 0) & (evens < whole)
    return not both.any() and odd.sum() <= 1 and (evens > 0).sum() <= 1


def strokes_of_rows(column: Column) -> Ints:
    """Return the number of the stroke in each row.

    Raises TableError at the first cell that is no whole number from 1.
    """
    stroke = whole_numbers(column, "strokes count from 1, odd ones go forward and even ones back")
    column.check(stroke > 0, "{} is missing", "write the stroke in every row")
    return stroke
