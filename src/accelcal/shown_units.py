"""The unit in which a number is shown: of the unit that results have, the one to be read easily."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from accelcal.units import HOUR, MICRO

ACCELERATIONS = ((1e-6, "ug"), (1e-3, "mg"), (1.0, "g"))
"""Units of an acceleration [g], for `by_size`."""

ANGLES = ((1e-6, "urad"), (1e-3, "mrad"), (math.pi / 180.0, "deg"))
"""Units of an angle [rad], for `by_size`."""

SMALL_UNITS = {
    "A/g": "uA/g",
    "g": "ug",
    "g/g^2": "ug/g^2",
    "g/g^3": "ug/g^3",
    "g/degC": "ug/degC",
    "rad": "urad",
    "rad/day": "urad/day",
    "rad/degC": "urad/degC",
    "1": "ppm",
    "1/degC": "ppm/degC",
}
"""Unit of a result -> the millionth of it, in which a report tells it."""


def in_small_unit(unit: str) -> tuple[float, str]:
    """Tell the unit in which a report has values of some unit: a factor, and the unit shown.

    It is that of `SMALL_UNITS`, else the unit itself.

    Examples
    --------
    >>> in_small_unit("g/degC"), in_small_unit("mA/g")
    ((1000000.0, 'ug/degC'), (1.0, 'mA/g'))
    """
    return (MICRO, SMALL_UNITS[unit]) if unit in SMALL_UNITS else (1.0, unit)


def by_size(
    largest: float, units: Sequence[tuple[float, str]], most: float = 1.0
) -> tuple[float, str]:
    """Choose the first unit of which a number has not yet `most` times the next one.

    Examples
    --------
    >>> by_size(2e-4, ACCELERATIONS), by_size(2e-3, ACCELERATIONS, 10.0), by_size(0.1, ANGLES)
    ((1e-06, 'ug'), (1e-06, 'ug'), (0.017453292519943295, 'deg'))
    """
    for unit, (larger, _) in pairwise(units):
        if largest < most * larger:
            return unit
    return units[-1]


def three_digits(value: float) -> str:
    """Write a number with three significant digits, two where it is small, and no exponent.

    Examples
    --------
    >>> three_digits(1234.5), three_digits(12.3), three_digits(0.0123)
    ('1230', '12.3', '0.012')
    """
    return f"{float(f'{value:.3g}'):.12g}" if 0.1 <= abs(value) < 1e9 else f"{value:.2g}"


def time_unit(seconds: float) -> tuple[float, str]:
    """Choose the unit in which a time is best read: its seconds, and its symbol.

    Examples
    --------
    >>> time_unit(7200.0), time_unit(100.0)
    ((3600.0, 'h'), (1.0, 's'))
    """
    for size, unit in ((HOUR, "h"), (60.0, "min")):
        if seconds >= 2.0 * size:
            return size, unit
    return 1.0, "s"


_PREFIXES = ((1e-6, "µ"), (1e-3, "m"), (1.0, ""))
_SMALL = 0.1
_DOWN = {"": ("m", "µ", "n"), "m": ("µ", "n", "p"), "u": ("n", "p", "f"), "k": ("", "m", "µ")}
_ELECTRICAL = re.compile(r"(u|m|k)?(V|A|Hz)(?![a-z])")
_PREFIXED = re.compile(r"(g|rad)(?![a-z])")
_PLAIN = str.maketrans({"µ": "u", "°": "deg", "²": "^2", "³": "^3", "·": "*"})
_SIGNS = (("degC", "°C"), ("^2", "²"), ("^3", "³"), ("*", "·"))


class Scale(NamedTuple):
    """What a number is multiplied by to be read easily."""

    factor: float  # number shown over number in the unit of the result
    unit: str  # shown


def readable(unit: str, *values: Any) -> Scale:
    """Choose the unit in which some numbers, NaN where unknown, are best read.

    Micro, milli or none before g and rad, a smaller prefix before V and A where numbers are small;
    ppm or percent in place of 1, but for 1 and more; else the unit itself.

    Examples
    --------
    >>> readable("g", [3e-5, float("nan")]), readable("1/degC", 1e-5), readable("mA", 7)
    (Scale(factor=1000000.0, unit='µg'), Scale(factor=1000000.0, unit='ppm/°C'), \
Scale(factor=1.0, unit='mA'))
    """
    known = np.concatenate([np.ravel(np.asarray(v, dtype=float)) for v in values] or [np.zeros(1)])
    largest = float(np.abs(known[np.isfinite(known)]).max(initial=0.0))
    if unit == "1" and largest >= 1.0:  # a number of something
        return Scale(1.0, unit)
    if unit == "1" or unit.startswith("1/"):
        factor, name = (1e6, "ppm") if largest < 1e-2 else (1e2, "%")
        return Scale(factor, written(name + unit[1:]))
    if electrical := _ELECTRICAL.match(unit):
        return _smaller(electrical[1] or "", unit[electrical.start(2) :], largest)
    if not _PREFIXED.match(unit):
        return Scale(1.0, written(unit))
    size, prefix = by_size(largest, _PREFIXES, 2.0)
    return Scale(1.0 / size, prefix + written(unit))


def _smaller(prefix: str, rest: str, largest: float) -> Scale:
    """A smaller prefix before V, A or Hz, until the largest number is above 0.1."""
    factor, names = 1.0, [prefix, *_DOWN[prefix]]
    while names[1:] and 0.0 < factor * largest < _SMALL:
        factor, names = 1e3 * factor, names[1:]
    return Scale(factor, written(names[0] + rest))


def plain(unit: str) -> str:
    """Write a unit of `readable` without signs that a terminal may lack.

    Examples
    --------
    >>> plain("µg/g²"), plain("1")
    ('ug/g^2', '')
    """
    return "" if unit == "1" else unit.translate(_PLAIN)


def written(unit: str) -> str:
    """Write a unit with the signs that a picture has and a terminal may lack.

    Examples
    --------
    >>> written("uA/g^2"), written("urad/degC")
    ('µA/g²', 'µrad/°C')
    """
    for plain, sign in _SIGNS:
        unit = unit.replace(plain, sign)
    return re.sub(r"^u(?=(?:[AVg]|rad)\b)", "µ", unit)
