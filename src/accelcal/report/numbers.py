"""Numbers as a person reads them: with the digits that the uncertainty bears."""

from __future__ import annotations

import math
import re

from accelcal.results.quantity import Quantity
from accelcal.shown_units import plain, readable
from accelcal.units import MICRO

_MOST_DECIMALS = 10
_LAST_DIGIT = 1e-12  # below this share of the value an uncertainty is rounding error


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


def in_millionths(quantity: Quantity) -> tuple[str, str]:
    """Write value and half width of the 95 % interval in the millionth of their unit.

    Examples
    --------
    >>> in_millionths(Quantity(1.1521e-3, 2.8e-6, "rad", 5.6e-6))
    ('1152.1', '5.6')
    """
    return matching_digits(quantity.value or 0.0, quantity.expanded_uncertainty, MICRO)


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


_FORMAT = re.compile(r"((?:.?[<>^])?[0-9]*)([+ ]?,?(?:\.[0-9]+[eEfFgG]?|[eEfFgG]))?")
"""Fill, alignment and width of a text, and a format of the numbers in it."""


def is_number_of(quantity: Quantity) -> bool:
    """Tell a whole number that is no ratio: of a reading, or of one way among several.

    Examples
    --------
    >>> is_number_of(Quantity(0.0, None, "1")), is_number_of(Quantity(0.0, 1e-6, "1"))
    (True, False)
    """
    known = quantity.value is not None and quantity.standard_uncertainty is None
    return known and quantity.unit == "1" and float(quantity.value or 0.0).is_integer()


def sized(quantity: Quantity) -> str:
    """Tell a size with its half width, where there is one, in the unit in which it is best read.

    Examples
    --------
    >>> sized(Quantity(2.04e-5, 7e-7, "rad", 1.4e-6)), sized(Quantity(57.0, None, "1"))
    ('20.4 +- 1.4 urad', '57')
    >>> sized(Quantity(0.0, None, "1")), sized(Quantity(0.0, 0.58, "1", 1.0))
    ('0', '0.0 +- 1.0')
    """
    if quantity.value is None:
        return "unknown"
    if is_number_of(quantity):
        return f"{quantity.value:g}"
    factor, unit = readable(quantity.unit, quantity.value)
    if quantity.standard_uncertainty is None:
        return f"{factor * quantity.value:g} {plain(unit)}".rstrip()
    half = quantity.expanded_uncertainty or 2.0 * quantity.standard_uncertainty
    if quantity.unit == "1":  # a ratio may be zero with an uncertainty of one
        factor, unit = readable(quantity.unit, quantity.value, half)
    value, uncertainty = matching_digits(quantity.value, half, factor)
    return f"{value} +- {uncertainty} {plain(unit)}".rstrip()


def told(quantity: Quantity) -> str:
    """Tell a quantity as `sized`, and that its half width is that of a 95 % interval.

    Examples
    --------
    >>> told(Quantity(2.04e-5, 7e-7, "rad", 1.4e-6))
    '20.4 +- 1.4 urad (95 %)'
    """
    known = quantity.standard_uncertainty is not None
    return f"{sized(quantity)} (95 %)" if known else sized(quantity)


def formatted(quantity: Quantity, spec: str) -> str:
    """Write a quantity as a format asks: its numbers in its own unit, else the text of `told`.

    Examples
    --------
    >>> bias = Quantity(3.323e-3, 7.6e-6, "g", 1.5e-5)
    >>> formatted(bias, ".6f"), formatted(bias, ">25")
    ('0.003323 +- 0.000015 g (95 %)', ' 3.323 +- 0.015 mg (95 %)')
    >>> formatted(bias, ".3f")
    '0.003 +- 1.5e-05 g (95 %)'
    """
    parts = _FORMAT.fullmatch(spec)
    if parts is None:
        raise ValueError(f"format {spec!r} is none of a quantity; write .4f, .3g, .2e or a width")
    text = told(quantity) if parts[2] is None else _in_numbers(quantity, parts[2])
    return format(text, parts[1])


def _in_numbers(quantity: Quantity, spec: str) -> str:
    """Write value and half width in one format; a half width that is no 0 is never written so."""
    if quantity.value is None:
        return told(quantity)
    unit = "" if quantity.unit == "1" else f" {quantity.unit}"
    value = f"{float(quantity.value):{spec}}"
    if quantity.standard_uncertainty is None:
        return f"{value}{unit}"
    half = float(quantity.expanded_uncertainty or 2.0 * quantity.standard_uncertainty)
    width = f"{half:{spec.lstrip('+ ')}}"
    if half and not re.search("[1-9]", width.lower().partition("e")[0]):
        width = f"{half:.2g}"
    return f"{value} +- {width}{unit} (95 %)"
