"""Times of a column: seconds, dates, or clock times and the days on which they were read."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array, Ints
from accelcal.dates import date_of
from accelcal.io.values.cells import Column, numbers
from accelcal.io.words.vocabulary import TIME_UNITS, is_missing
from accelcal.pace import LATEST
from accelcal.plural import lines_named

DAY = np.timedelta64(1, "D")
"""A day, to add clock times to."""

HOUR = np.timedelta64(1, "h")
"""By which clocks are put back."""

_HALF_A_DAY = np.timedelta64(12, "h")
_MINUTES = r":([0-5]\d)(?::([0-5]\d(?:[.,]\d+)?))?"
_CLOCKS = (
    re.compile(rf"([01]?\d|2[0-3]){_MINUTES}()"),
    re.compile(rf"(0?[1-9]|1[0-2]){_MINUTES} ?([ap])\.?m\.?", re.IGNORECASE),
)
_DAY_AND_CLOCK = re.compile(r"(.+?)(?:[Tt]|,? +(?=\d{1,2}:))(\d.*)")
_ISO = re.compile(r"[12]\d{3}-\d\d-\d\d(?:[T ]\d\d:\d\d:\d\d(?:\.\d{1,6})?)?", re.ASCII)
"""Dates that NumPy reads as `date_of` does, and seven times as fast."""

_YEAR_LAST = re.compile(
    r"(0?[1-9]|[12]\d|3[01])/(0?[1-9]|[12]\d|3[01])/(\d{4})"
    r"(?: +([01]?\d|2[0-3]):(\d\d)(?::(\d\d)(?:[.,:](\d+))?)?(?: ?([AP])M)?)?",
    re.ASCII | re.IGNORECASE,
)
"""A date as programs of the USA and of other countries write it, perhaps with a clock time."""

_ZONE = re.compile(r"[T ]\d[^\n]*[+-]")
"""A clock time in another zone than UTC."""

_MIDNIGHT = re.compile(r"[0:.,]+(?:Z|[+-].*)?")


def times(column: Column, dates: Column | None = None, group: Ints | None = None) -> NDArray[Any]:
    """Times of a column, of the kind that its first cell is.

    They are numbers in the unit of the column; UTC dates; or, of clock times without days, the time
    since the midnight before the first of their group. One that is more than 12 h before the one
    above it is of the next day. Cells of a group follow each other in time; by default all do.
    Raises TableError at the first cell that is empty or not of the kind of the first.

    Examples
    --------
    >>> cells, lines = ["23:59:30", "0:00:30.5"], np.array([2, 3])
    >>> times(Column("time", "time", None, cells, lines, "a.csv")) / np.timedelta64(1, "s")
    array([86370. , 86430.5])
    """
    first = str(column.cells[0])
    clock = next((form for form in _CLOCKS if form.fullmatch(first)), None)
    if clock is not None:
        found = _clock_times(column, clock)
        return _with_midnights(found, group) if dates is None else _days(dates) + found
    if date_of(first) is None or first.isdigit():
        values = numbers(column)
        remedy = "write the time of every reading, or leave the column out"
        column.check(~np.isnan(values), "{} is missing", remedy)
        return values
    return _dates(column, "{} is not a date and time", "write it as 2024-05-31T14:30:00")


def days(column: Column, found: NDArray[Any]) -> NDArray[np.datetime64] | None:
    """Days of the times of a column, where the readings were taken.

    They are as written, which those of UTC need not be; None where the times have no days.

    Examples
    --------
    >>> cells = ["2024-06-01T00:30:00+02:00", "2024-06-01T02:30:00+02:00"]
    >>> column = Column("time", "time", None, cells, np.array([2, 3]), "a.csv")
    >>> days(column, times(column)).astype(str).tolist()
    ['2024-06-01', '2024-06-01']
    """
    if found.dtype.kind != "M":
        return None
    cells = list(map(str, column.cells))
    if not _ZONE.search("\n".join(cells)):
        return found.astype("datetime64[D]")
    return np.array(list(map(_as_written, cells)), dtype="datetime64[D]")


def in_seconds(column: Column, values: Array) -> Array:
    """Turn the numbers of a column of times into seconds.

    Without a unit the column is in seconds, and of ``s since start`` the first word counts. Raises
    TableError if the unit is none of a time, or a time is far from all clocks, as ms since 1970
    are.

    Examples
    --------
    >>> in_seconds(Column("time", "time", "h", ["2"], np.array([2]), "a.csv"), np.array([2.0]))
    array([7200.])
    """
    unit = (column.unit or "").strip() or "s"
    factor = TIME_UNITS.get(unit.split()[0].casefold())
    if factor is None:
        problem = "{} is in " + unit.replace("{", "{{").replace("}", "}}")
        raise column.refuse(0, problem, "write the unit of the time, such as time [s]")
    with np.errstate(over="ignore"):
        seconds = values * factor
    remedy = "write seconds, or name the unit of the time in its heading, such as time [ms]"
    column.check(np.abs(seconds) <= LATEST, "{} is no time of a record", remedy)
    return seconds


def with_year_first(column: Column) -> Column:
    """Write dates such as ``05/31/2024`` in the form of ISO 8601, where one tells day from month.

    That is where of the first two numbers of the cells either the first or the second is above 12
    somewhere. Other columns stay as they are.

    Examples
    --------
    >>> cells, lines = ["05/31/2024 2:30:00 PM", "06/01/2024 0:00"], np.array([2, 3])
    >>> with_year_first(Column("time", "time", None, cells, lines, "a.csv")).cells
    ['2024-05-31T14:30:00', '2024-06-01T00:00:00']
    """
    if column.role not in ("time", "date") or not _YEAR_LAST.fullmatch(str(column.cells[0])):
        return column
    found = [_YEAR_LAST.fullmatch(str(cell)) for cell in column.cells]
    parts = [match.groups("") for match in found if match]
    first_is_day, second_is_day = (any(int(part[n]) > 12 for part in parts) for n in (0, 1))
    if len(parts) < len(found) or first_is_day == second_is_day:
        return column
    return column._replace(cells=[_in_iso(part, int(second_is_day)) for part in parts])


def _in_iso(part: Sequence[str], day: int) -> str:
    """Date of its parts, of which that of the index is the day."""
    *_, year, hour, minute, second, fraction, half = part
    date = f"{year}-{part[1 - day]:0>2}-{part[day]:0>2}"
    if not hour:
        return date
    hours = int(hour) % 12 + 12 * (half in "pP") if half else int(hour)
    return f"{date}T{hours:02}:{minute}:{second or '00'}{'.' * bool(fraction)}{fraction}"


def has_clock_times(column: Column) -> bool:
    """Tell whether a column of times needs the days of its clock times."""
    return any(form.fullmatch(str(cell)) for cell in column.cells for form in _CLOCKS)


def has_times_of_day(column: Column) -> bool:
    """Tell whether a column of dates tells the times of the readings as well.

    That is where its cells differ and one has a time of day other than midnight, which is what
    programs write behind a mere date.
    """
    found = {str(cell) for cell in column.cells}
    return len(found) > 1 and any(map(_is_moment, found))


def _is_moment(text: str) -> bool:
    match = _DAY_AND_CLOCK.fullmatch(text)
    is_bare = match is None or _MIDNIGHT.fullmatch(match[2])
    return not is_bare and date_of(text) is not None


def one_date(column: Column, *, timed: bool) -> str | None:
    """Text that stands in all cells of a column of dates.

    None where there are several, or it stands for nothing. `timed` looks at the days only, as the
    cells have times of day.
    """
    found = {str(cell) for cell in column.cells}
    if timed:
        found = {_DAY_AND_CLOCK.sub(r"\1", text) for text in found}
    return None if len(found) > 1 or is_missing(next(iter(found))) else found.pop()


def _dates(
    column: Column, problem: str, remedy: str, *, in_utc: bool = True
) -> NDArray[np.datetime64]:
    cells = list(map(str, column.cells))
    if all(map(_ISO.fullmatch, cells)):
        with suppress(ValueError):  # one is no day of the calendar, as is told below
            return np.array(cells, dtype="datetime64[us]")
    dates = list(map(_in_utc if in_utc else _as_written, cells))
    column.check(np.array([date is not None for date in dates]), problem, remedy)
    return np.array(dates, dtype="datetime64[us]")


def _in_utc(text: str) -> datetime | None:
    date = date_of(text)
    try:
        return date.astimezone(UTC).replace(tzinfo=None) if date and date.tzinfo else date
    except OverflowError:  # in the first or the last hours of all calendars
        return None


def _as_written(text: str) -> datetime | None:
    date = date_of(text)
    return date.replace(tzinfo=None) if date else None


def _days(column: Column) -> NDArray[np.datetime64]:
    remedy = "write it as 2024-05-31 in every row"
    dates = _dates(column, "{} is not a date", remedy, in_utc=False)
    return dates.astype("datetime64[D]")


def _clock_times(column: Column, form: re.Pattern[str]) -> NDArray[np.timedelta64]:
    found = [form.fullmatch(str(cell)) for cell in column.cells]
    remedy = "write it as in the first row, such as 14:30:00, in every row, or times in seconds"
    column.check(np.array([match is not None for match in found]), "{} is no clock time", remedy)
    return np.array([_microseconds(match) for match in found if match], dtype="timedelta64[us]")


def _microseconds(match: re.Match[str]) -> int:
    """Time since midnight; 12 AM is midnight and 12 PM noon."""
    hour, minute, second, half = match.groups("0")
    hours = int(hour) % 12 + 12 * (half in "pP") if half else int(hour)
    seconds = float(second.replace(",", "."))
    return (hours * 60 + int(minute)) * 60_000_000 + round(seconds * 1e6)


def _with_midnights(clock: NDArray[np.timedelta64], group: Ints | None) -> NDArray[np.timedelta64]:
    """Clock times with the days that have passed since the first of their group."""
    since = clock.copy()
    groups = np.zeros(clock.size, dtype=np.int64) if group is None else group
    for own in (groups == index for index in range(groups.max() + 1)):
        step = np.diff(clock[own], prepend=clock[own][:1])
        since[own] += np.cumsum(step < -_HALF_A_DAY) * DAY
    return since


# -- notes -----------------------------------------------------------------------------------------

_FEWEST = 9
"""Readings among which one that is out of the order of the others is told."""


def notes_of_midnight(time: NDArray[Any] | None, line: Ints) -> list[str]:
    """Say where clock times without a date were taken to be of the next day."""
    if time is None or time.dtype.kind != "m":
        return []
    passed = time // DAY
    found = passed > 0
    found[1:] &= np.diff(passed) != 0
    where = lines_named(line[found])
    return [f"the clock passes midnight: another day begins at {where}"] if found.any() else []


def notes_of_order(time: NDArray[Any] | None, line: Ints) -> list[str]:
    """Say where times, which otherwise go on from row to row, once step back.

    That is by an hour or less where they are dates, else where without one of the rows all are in
    order.

    Examples
    --------
    >>> time = np.array([0.0, 60.0, 1200.0, 180.0, 240.0, 300.0, 360.0, 420.0, 480.0])
    >>> for note in notes_of_order(time, np.arange(2, 11)):
    ...     print(note)
    the time steps back once, from line 4 to line 5: is it right in both?
    """
    step = np.diff(time) if time is not None else np.empty(0)
    back = np.flatnonzero(step < np.zeros((), step.dtype))
    if time is None or back.size != 1:
        return []
    at = int(back[0])
    if time.dtype.kind != "f" and step[at] >= -HOUR:
        return [
            f"the time steps back at {lines_named(line[back + 1])}; if the clock was put back"
            " there, as at the end of daylight saving, write times of UTC or with their zone, such"
            " as 2024-10-27T02:30:00+01:00"
        ]
    rest = (np.delete(time, place) for place in (at, at + 1))
    if time.size < _FEWEST or not any((own[1:] >= own[:-1]).all() for own in rest):
        return []
    told = f"from line {line[at]} to line {line[at + 1]}"
    return [f"the time steps back once, {told}: is it right in both?"]
