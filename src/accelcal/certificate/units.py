r"""Units in the form of the D-SI: ``\milli\ampere`` for mA."""

from __future__ import annotations

import re

__all__ = ["NO_UNIT", "si_unit"]

NO_UNIT = r"\one"

_PREFIXES = {"n": r"\nano", "u": r"\micro", "µ": r"\micro", "m": r"\milli", "k": r"\kilo"}
_SYMBOLS = {"A": r"\ampere", "V": r"\volt", "Hz": r"\hertz", "C": r"\coulomb"}
_PLAIN = {"1": "", "rad": r"\radian", "g": ""}
_PARTS = re.compile(r"(?P<unit>[^/]+)(?:/g(?:\^(?P<power>\d))?)?(?P<slope>/degC)?")


def si_unit(unit: str) -> tuple[str, int] | None:
    r"""Write the unit of a coefficient in the form of the D-SI.

    Parameters
    ----------
    unit : str
        Unit such as ``"mA/g^2"``, ``"g/g^2"``, ``"rad"``, ``"g/degC"`` or ``"1"``.

    Returns
    -------
    tuple of str and int, or None
        The unit with m/s^2 in place of g, and the power of the local gravity in m/s^2 by which the
        value is multiplied; None for a unit that the SI does not know, such as counts.

    Examples
    --------
    >>> si_unit("mA/g")
    ('\\milli\\ampere\\metre\\tothe{-1}\\second\\tothe{2}', -1)
    >>> si_unit("rad"), si_unit("1/degC"), si_unit("counts/g")
    (('\\radian', 0), ('\\kelvin\\tothe{-1}', 0), None)
    """
    found = _PARTS.fullmatch(unit)
    base = None if found is None else _base(found["unit"])
    if found is None or base is None:
        return None
    per_g = int(found["power"] or 1) if "/g" in unit else 0
    power = (1 if found["unit"] == "g" else 0) - per_g
    slope = r"\kelvin\tothe{-1}" if found["slope"] else ""
    return (base + _acceleration(power) + slope) or NO_UNIT, power


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
