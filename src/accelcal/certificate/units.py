r"""Units in the form of the D-SI: ``\milli\ampere`` for mA."""

from __future__ import annotations

import re
from typing import NamedTuple

from accelcal.units import conversion_factor

NO_UNIT = r"\one"

_PREFIXES = {
    **{"p": r"\pico", "n": r"\nano", "u": r"\micro", "µ": r"\micro", "m": r"\milli"},
    **{"k": r"\kilo", "M": r"\mega"},
}
_SYMBOLS = {"A": r"\ampere", "V": r"\volt", "Hz": r"\hertz", "C": r"\coulomb"}
_PLAIN = {"1": "", "rad": r"\radian"}
_ACCELERATION = "m/s^2"
_PARTS = re.compile(r"(?P<unit>m/s\^2|[^/]+)(?P<per>/g(?:\^(?P<power>\d))?)?(?P<slope>/degC)?")


class SiUnit(NamedTuple):
    """A unit of the D-SI, and how a value comes into it.

    Attributes
    ----------
    text : str
        The unit, with m/s^2 in place of g.
    power : int
        Power of the local gravity in m/s^2 by which the value is multiplied.
    scale : float
        Number by which it is multiplied as well: 0.001 where mg became m/s^2.
    """

    text: str
    power: int
    scale: float = 1.0


def si_unit(unit: str) -> SiUnit | None:
    r"""Write the unit of a coefficient in the form of the D-SI.

    Parameters
    ----------
    unit : str
        Unit such as ``"mA/g^2"``, ``"g/g^2"``, ``"rad"``, ``"g/degC"`` or ``"1"``.

    Returns
    -------
    SiUnit or None
        The unit; None for one that the SI does not know, such as counts.

    Examples
    --------
    >>> si_unit("mA/g")
    SiUnit(text='\\milli\\ampere\\metre\\tothe{-1}\\second\\tothe{2}', power=-1, scale=1.0)
    >>> si_unit("rad").text, si_unit("1/degC").text, si_unit("counts/g")
    ('\\radian', '\\kelvin\\tothe{-1}', None)
    >>> si_unit("mg")
    SiUnit(text='\\metre\\second\\tothe{-2}', power=1, scale=0.001)
    """
    found = _PARTS.fullmatch(unit)
    if found is None:
        return None
    name, scale = found["unit"], conversion_factor(found["unit"], "g")
    is_acceleration = scale is not None or name == _ACCELERATION
    base = "" if is_acceleration else _base(name)
    if base is None:
        return None
    per_g = int(found["power"] or 1) if found["per"] else 0
    slope = r"\kelvin\tothe{-1}" if found["slope"] else ""
    text = base + _acceleration(is_acceleration - per_g) + slope
    if scale is None:
        return SiUnit(text or NO_UNIT, -per_g)
    return SiUnit(text or NO_UNIT, 1 - per_g, scale)


def product(one: str, other: str) -> str:
    r"""Write the product of two units of the D-SI.

    Examples
    --------
    >>> product(r"\volt", r"\metre"), product(NO_UNIT, r"\metre"), product(NO_UNIT, NO_UNIT)
    ('\\volt\\metre', '\\metre', '\\one')
    """
    return "".join(unit for unit in (one, other) if unit != NO_UNIT) or NO_UNIT


def _base(unit: str) -> str | None:
    if unit in _PLAIN:
        return _PLAIN[unit]
    if unit in _SYMBOLS:
        return _SYMBOLS[unit]
    prefix, symbol = _PREFIXES.get(unit[:1]), _SYMBOLS.get(unit[1:])
    return prefix + symbol if prefix and symbol else None


def _acceleration(power: int) -> str:
    """(m/s^2) to a power."""
    if power == 0:
        return ""
    metre = r"\metre" if power == 1 else rf"\metre\tothe{{{power}}}"
    return rf"{metre}\second\tothe{{{-2 * power}}}"
