"""Angles in degrees, minutes and seconds, as a dividing head is read."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from accelcal.io.values.cells import Column, numbers
from accelcal.io.words.signs import with_hyphen

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
