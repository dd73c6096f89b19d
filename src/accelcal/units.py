"""Units as the people of a laboratory write them, and the one name that accelcal gives each."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType

from accelcal.errors import InputError

MICRO = 1e6
"""So many ug are a g, so many urad a rad, and so many ppm the whole."""

HOUR = 3600.0
"""Seconds of an hour."""

DAY = 24.0 * HOUR
"""Seconds of a day."""

YEAR = 365.25 * DAY
"""Seconds of a year."""

OUTPUT_UNITS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "V": ("volt", "volts", "\N{CYRILLIC CAPITAL LETTER VE}"),
        "mV": ("millivolt", "millivolts", "м\N{CYRILLIC CAPITAL LETTER VE}"),
        "uV": ("µV", "μV", "microvolt", "microvolts", "мк\N{CYRILLIC CAPITAL LETTER VE}"),
        "nV": ("nanovolt", "nanovolts"),
        "A": ("amp", "amps", "ampere", "amperes", "\N{CYRILLIC CAPITAL LETTER A}"),
        "mA": (
            *("milliamp", "milliamps", "milliampere", "milliamperes"),
            "м\N{CYRILLIC CAPITAL LETTER A}",
        ),
        "uA": (
            *("µA", "μA", "microamp", "microamps", "microampere", "microamperes"),
            "мк\N{CYRILLIC CAPITAL LETTER A}",
        ),
        "nA": ("nanoamp", "nanoamps", "nanoampere", "nanoamperes"),
        "pA": ("picoamp", "picoamps", "picoampere", "picoamperes"),
        "Hz": ("hertz", "Гц"),
        "kHz": ("kilohertz", "кГц"),
        "MHz": ("megahertz",),
        "counts": ("count", "cnt", "cts", "lsb", "lsbs", "digit", "digits"),
        "pulses": ("pulse", "imp", "имп"),
        "pulses/s": ("pulse/s", "pps", "imp/s", "имп/с"),
        "g": (),
        "mg": ("milli-g",),
        "ug": ("µg", "μg", "micro-g"),
        "m/s^2": ("m/s2", "m/s²", "m/s**2", "m s-2"),
    }
)
"""Canonical name of an output unit -> other ways of writing it."""

_POWERS_OF_TEN: Mapping[str, Mapping[str, int]] = MappingProxyType(
    {
        "V": {"V": 0, "mV": -3, "uV": -6, "nV": -9},
        "A": {"A": 0, "mA": -3, "uA": -6, "nA": -9, "pA": -12},
        "Hz": {"Hz": 0, "kHz": 3, "MHz": 6},
        "g": {"g": 0, "mg": -3, "ug": -6},
    }
)
"""Quantity -> its units as powers of ten."""

_CYRILLIC = re.compile("[\u0400-\u04ff]")
_EXACT = {name: name for name in OUTPUT_UNITS} | {
    other: name for name, others in OUTPUT_UNITS.items() for other in others
}
_FOLDED = {
    spelling.casefold(): name
    for spelling, name in reversed(_EXACT.items())
    if not _CYRILLIC.search(spelling)  # symbols, of which a capital would be mega
}
del _FOLDED["mhz"]  # mHz or MHz? only the exact spelling tells

_CAPITALS = {"M": ("begins with mega", "milli"), "N": ("begins with N, no prefix", "nano")}
"""Capital prefixes that mean something else than the small ones, and what the small ones mean."""

_LONGEST = 40
"""Characters of a unit that a message shows."""


def canonical_unit(text: str) -> str:
    """Name of an output unit.

    Parameters
    ----------
    text : str
        The unit as written.

    Returns
    -------
    str
        The name in `OUTPUT_UNITS`, or `text` without surrounding blanks if the unit is not known.

    Notes
    -----
    The exact spelling is looked up first, then the spelling without regard to case, but a symbol
    with a capital M or N is not that of milli or nano.

    Examples
    --------
    >>> canonical_unit(" Volts "), canonical_unit("µA"), canonical_unit("ma")
    ('V', 'uA', 'mA')
    >>> canonical_unit("furlong")
    'furlong'
    """
    unit = text.strip()
    found = _EXACT.get(unit) or _FOLDED.get(unit.casefold(), unit)
    return unit if _is_other_prefix(unit, found) else found


def _is_other_prefix(unit: str, found: str) -> bool:
    same_letters = unit.casefold() == found.casefold()
    return same_letters and unit != found and unit[0] in _CAPITALS


def output_unit(text: str) -> str:
    """Name of an output unit, which must be known.

    Parameters
    ----------
    text : str
        The unit as written.

    Returns
    -------
    str
        The name in `OUTPUT_UNITS`.

    Raises
    ------
    InputError
        If it is not known.

    Examples
    --------
    >>> output_unit("Volts")
    'V'
    >>> output_unit("MA")
    Traceback (most recent call last):
    accelcal.errors.InputError: unit 'MA' begins with mega; write mA if milli is meant
    """
    name = canonical_unit(text)
    if name in OUTPUT_UNITS:
        return name
    shown = text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."
    small = _FOLDED.get(name.casefold(), "")
    if _is_other_prefix(name, small):
        what, meant = _CAPITALS[name[0]]
        raise InputError(f"unit {shown!r} {what}; write {small} if {meant} is meant")
    raise InputError(f"unit {shown!r} is no output unit; it is one of {', '.join(OUTPUT_UNITS)}")


def is_output_unit(text: str) -> bool:
    """Tell whether a text is a known output unit.

    Parameters
    ----------
    text : str
        The unit as written.

    Returns
    -------
    bool
        True for a spelling of one of `OUTPUT_UNITS`.

    Examples
    --------
    >>> is_output_unit("mA"), is_output_unit("chamber")
    (True, False)
    """
    return canonical_unit(text) in OUTPUT_UNITS


def conversion_factor(given: str, wanted: str) -> float | None:
    """Factor from one output unit to another of the same quantity.

    Parameters
    ----------
    given, wanted : str
        The units as written.

    Returns
    -------
    float or None
        What a value in `given` is multiplied by; None where the units are of other quantities.

    Examples
    --------
    >>> conversion_factor("uA", "mA"), conversion_factor("mA", "mV")
    (0.001, None)
    """
    one, other = canonical_unit(given), canonical_unit(wanted)
    if one == other:
        return 1.0
    for powers in _POWERS_OF_TEN.values():
        if one in powers and other in powers:
            return float(f"1e{powers[one] - powers[other]}")
    return None
