"""Units of engineers, in pictures and notebooks: µg, µrad, ppm."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

import numpy as np

from accelcal.report.numbers import matching_digits
from accelcal.results.quantity import Quantity

_PREFIXES = ((1e6, "µ", 2e-3), (1e3, "m", 2.0))
_SMALL = 0.1
_DOWN = {"": ("m", "µ", "n"), "m": ("µ", "n", "p"), "u": ("n", "p", "f"), "k": ("", "m", "µ")}
_ELECTRICAL = re.compile(r"(u|m|k)?(V|A|Hz)(?![a-z])")
_PREFIXED = re.compile(r"(g|rad)(?![a-z])")
_PLAIN = str.maketrans({"µ": "u", "°": "deg", "²": "^2", "³": "^3", "·": "*"})
_SIGNS = (("degC", "°C"), ("^2", "²"), ("^3", "³"), ("*", "·"))


class Scale(NamedTuple):
    """What a number is multiplied by to be read easily.

    Attributes
    ----------
    factor : float
        Number shown over number in the unit of the result.
    unit : str
        Unit shown.
    """

    factor: float
    unit: str


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
    for factor, prefix, below in _PREFIXES:
        if largest < below:
            return Scale(factor, prefix + written(unit))
    return Scale(1.0, written(unit))


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


def sized(quantity: Quantity) -> str:
    """Tell a size with its half width, where there is one, in the unit in which it is best read.

    Examples
    --------
    >>> sized(Quantity(2.04e-5, 7e-7, "rad", 1.4e-6)), sized(Quantity(57.0, None, "1"))
    ('20.4 +- 1.4 urad', '57')
    """
    if quantity.value is None:
        return "unknown"
    factor, unit = readable(quantity.unit, quantity.value)
    if quantity.standard_uncertainty is None:
        return f"{factor * quantity.value:g} {plain(unit)}".rstrip()
    half = quantity.expanded_uncertainty or 2.0 * quantity.standard_uncertainty
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
