"""Uncertainties asked for, as they are written: ``K1=5ppm``, ``k2=2ug/g^2`` or ``lam1=0.1ug/K``."""

from __future__ import annotations

import math
import re

from accelcal.errors import InputError
from accelcal.units import UNITS, scaled, size_of

_KINDS = {"g": "acceleration", "rad": "angle", "1": "ratio"}
"""Numerator of the unit of a coefficient -> what it is; that of an output is not among them."""

_USUAL = {"acceleration": "2ug", "angle": "5urad", "ratio": "5ppm"}
_FORGOTTEN = 0.1  # of g, rad or one: so large a target is one whose unit was forgotten
_POWERS = str.maketrans({"²": "2", "³": "3", "^": None})
_WRITTEN = re.compile(r"\s*([0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(([^/]*?)\s*(?:/\s*(\S+)\s*)?)")


def target_size(name: str, text: str, unit: str, nominal: float | None = None) -> float:
    """Read an uncertainty with its unit; whether it is a standard one, the caller says.

    The text is as ``"5ppm"``, ``"2ug"``, ``"2e-6"``, ``"0.1ug/degC"``; the denominator may be left
    out. The unit is that of the coefficient, such as ``"g/degC"``, ``"rad"``, ``"1"`` or
    ``"mA/g"``; of a coefficient in units of the output, ppm are a part of its nominal value, and
    without that the target is in its own unit only.

    Raises
    ------
    InputError
        If it is no positive number with a unit of that, or a number so large that its unit was
        forgotten. A coefficient in units of the output needs a unit.

    Examples
    --------
    >>> target_size("k2", "2 ug/g^2", "g/g^2"), target_size("K1", "10ppm", "mA/g", nominal=1.5)
    (2e-06, 1.5e-05)
    """
    kind, per = _kind_of(unit, nominal)
    of_output = unit.partition("/")[0] not in _KINDS
    match = _WRITTEN.fullmatch(text)
    number, given = (match[1], match[2].strip()) if match else ("", "")
    size = _size(given, unit, kind, per, nominal)
    try:
        value = scaled(number, size or math.nan)
    except ValueError:
        value = math.nan
    own = "relative" if unit == "1" else f"in {unit}"
    usual = f"{name}={_usual(unit, kind, per)}"
    if not 0.0 < value < math.inf or (of_output and not given):
        known = [unit] * of_output + [one for one in UNITS.get(kind, {}) if one != "1"]
        raise InputError(
            f"target {name}={text!r}, and {name} is {own}; write a number above zero with"
            f" {', '.join(known)}{'' if of_output else ' or none'}, as in {usual}"
        )
    if not given and value >= _FORGOTTEN:
        raise InputError(
            f"target {name}={text!r} has no unit, and {name} is {own}: it is too large; write the"
            f" unit, as in {usual}"
        )
    return value


def _kind_of(unit: str, nominal: float | None) -> tuple[str, str]:
    """What a target is, or nothing for one in units of the output, and its denominator."""
    numerator, _, per = unit.partition("/")
    if numerator in _KINDS:
        return _KINDS[numerator], per
    return ("", "") if nominal is None else ("ratio", "")


def _usual(unit: str, kind: str, per: str) -> str:
    if not kind:
        return f"1e-5 {unit}"
    return _USUAL[kind] + (f"/{per}" if per else "")


def _size(given: str, unit: str, kind: str, per: str, nominal: float | None) -> float | None:
    """Size of a unit as written in that of the coefficient; None where it is another."""
    if not given or _plain(given) == _plain(unit):
        return 1.0
    numerator, _, given_per = given.partition("/")
    if not numerator or (given_per and not is_denominator(given_per, per)):
        return None
    size = size_of(numerator, kind) if kind else None
    return None if size is None else size * abs(1.0 if nominal is None else nominal)


def is_denominator(given: str, per: str) -> bool:
    """Tell whether a denominator as written is the one that is meant, of a coefficient.

    Examples
    --------
    >>> is_denominator("K", "degC"), is_denominator("g²", "g^2"), is_denominator("g", "g^2")
    (True, True, False)
    """
    given = given.strip()
    per_degree = per == "degC" and size_of(given, "temperature difference") == 1.0
    return per_degree or _plain(given) == _plain(per)


def _plain(unit: str) -> str:
    return unit.translate(_POWERS)
