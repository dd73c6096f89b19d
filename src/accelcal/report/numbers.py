"""Numbers as a person reads them: as many digits as the uncertainty bears."""

from __future__ import annotations

import math

from accelcal.units import HOUR, MICRO

_MOST_DECIMALS = 10
_LAST_DIGIT = 1e-12  # below this share of the value an uncertainty is rounding error

SMALL_UNITS = {
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


def matching_digits(
    value: float, uncertainty: float | None, factor: float = 1.0
) -> tuple[str, str]:
    """Write a value and its uncertainty with two significant digits of the uncertainty.

    Both are multiplied by a factor first, from their unit to the one that is shown.

    Examples
    --------
    >>> matching_digits(3.26924, 0.02256)
    ('3.269', '0.023')
    >>> matching_digits(-16321.7, 413.0)
    ('-16320', '410')
    >>> matching_digits(1.35, None)
    ('1.35', 'unknown')
    >>> matching_digits(1.1521e-3, 5.6e-6, MICRO)
    ('1152.1', '5.6')
    """
    value *= factor
    if uncertainty is None or not math.isfinite(uncertainty):
        return f"{value:.6g}", "unknown"
    uncertainty *= factor
    if uncertainty <= _LAST_DIGIT * abs(value):
        return f"{value:.12g}", significant(uncertainty, 2)
    decimals = 1 - math.floor(math.log10(uncertainty))
    if round(uncertainty, decimals) >= 10.0 ** (2 - decimals):  # 0.0996 becomes 0.10
        decimals -= 1
    if decimals > _MOST_DECIMALS:
        size = math.floor(math.log10(abs(value))) if value else -decimals
        return f"{value:.{max(size + decimals + 1, 1)}g}", f"{uncertainty:.2g}"
    shown = max(decimals, 0)
    rounded = round(value, decimals) + 0.0  # + 0.0 turns -0.0 into 0.0
    return f"{rounded:.{shown}f}", f"{round(uncertainty, decimals):.{shown}f}"


def significant(value: float, digits: int = 3) -> str:
    """Write a number with a few significant digits, without an exponent where it is short.

    Examples
    --------
    >>> significant(45.678), significant(187.3, 2), significant(0.0000052, 2), significant(3e-12)
    ('45.7', '190', '0.0000052', '3e-12')
    """
    size = abs(value)
    if not 1e-8 <= size < 1e9:
        return f"{value:.{digits}g}"
    decimals = digits - 1 - math.floor(math.log10(float(f"{size:.{digits - 1}e}")))
    return f"{round(value, decimals):.{max(decimals, 0)}f}"


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
