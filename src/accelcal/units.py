"""Units as the people of a laboratory write them, and the one name that accelcal gives each."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

from accelcal.errors import InputError

if TYPE_CHECKING:
    import pandas as pd
    from numpy.typing import ArrayLike

    from accelcal.arrays import Array

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
        "V": ("volt", "volts", "VDC", "V DC", "volt DC", "\N{CYRILLIC CAPITAL LETTER VE}"),
        "mV": ("millivolt", "millivolts", "mVDC", "mV DC", "м\N{CYRILLIC CAPITAL LETTER VE}"),
        "uV": ("µV", "μV", "microvolt", "microvolts", "мк\N{CYRILLIC CAPITAL LETTER VE}"),
        "nV": ("nanovolt", "nanovolts"),
        "A": (
            "amp",
            "amps",
            "ampere",
            "amperes",
            "A DC",
            "amp DC",
            "\N{CYRILLIC CAPITAL LETTER A}",
        ),
        "mA": (
            *("milliamp", "milliamps", "milliampere", "milliamperes", "mADC", "mA DC"),
            "м\N{CYRILLIC CAPITAL LETTER A}",
        ),
        "uA": (
            *("µA", "μA", "microamp", "microamps", "microampere", "microamperes"),
            *("uADC", "uA DC", "µADC", "µA DC"),
            "мк\N{CYRILLIC CAPITAL LETTER A}",
        ),
        "nA": ("nanoamp", "nanoamps", "nanoampere", "nanoamperes"),
        "pA": ("picoamp", "picoamps", "picoampere", "picoamperes"),
        "Hz": ("hertz", "Гц"),
        "kHz": ("kilohertz", "кГц"),
        "MHz": ("megahertz",),
        "counts": ("count", "cnt", "cts", "lsb", "lsbs", "digit", "digits"),
        "pulses": ("pulse", "imp", "impulse", "impulsions", "имп"),
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
        "voltage": {"V": 0, "mV": -3, "uV": -6, "nV": -9},
        "current": {"A": 0, "mA": -3, "uA": -6, "nA": -9, "pA": -12},
        "frequency": {"Hz": 0, "kHz": 3, "MHz": 6},
        "acceleration": {"g": 0, "mg": -3, "ug": -6, "ng": -9},
        "gravity": {"m/s^2": 0, "Gal": -2, "mGal": -5},
    }
)
"""Kind of quantity -> its units as powers of ten."""

_DEGREE = math.pi / 180.0
UNITS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        **{
            kind: MappingProxyType({unit: float(f"1e{power}") for unit, power in powers.items()})
            for kind, powers in _POWERS_OF_TEN.items()
        },
        "angle": MappingProxyType(
            {"rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "nrad": 1e-9, "deg": _DEGREE}
            | {"arcmin": _DEGREE / 60.0, "arcsec": _DEGREE / 3600.0}
        ),
        "ratio": MappingProxyType({"1": 1.0, "%": 1e-2, "ppm": 1e-6, "ppb": 1e-9}),
        "temperature": MappingProxyType({"degC": 1.0}),
        "temperature difference": MappingProxyType(
            {"degC": 1.0, "K": 1.0, "mK": 1e-3, "degF": 5.0 / 9.0}
        ),
        "time": MappingProxyType(
            {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": HOUR, "d": DAY}
        ),
    }
)
"""Kind of quantity -> unit -> its size in the first one, such as g, rad, 1, degC or s.

An acceleration is a multiple of the local gravity, which is itself the kind ``"gravity"``.
"""

SCALES: Mapping[str, tuple[float, float]] = MappingProxyType(
    {"degC": (0.0, 1.0), "K": (273.15, 1.0), "degF": (32.0, 5.0 / 9.0)}
)
"""Scale of temperatures -> its number at 0 degC, and its degree in degC."""

_SPELLINGS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        **OUTPUT_UNITS,
        "m/s^2": (*OUTPUT_UNITS["m/s^2"], "м/с^2", "м/с2", "м/с²"),
        "Gal": ("Гал",),
        "mGal": ("мГал",),
        "rad": ("radian", "radians", "рад"),
        "mrad": ("milliradian", "milliradians", "мрад"),
        "urad": ("µrad", "μrad", "microradian", "microradians", "мкрад"),
        "deg": (
            *("°", "degree", "degrees", "Grad", "degré", "degrés"),
            *("град", "град.", "градус", "градусы", "градусов", "градусах"),
        ),
        "arcmin": (
            *("'", "′", "’", "arcmins", "arcminute", "arcminutes", "arc-minutes", "arc minutes"),
            *("Winkelminute", "Winkelminuten", "Bogenminute", "Bogenminuten"),
            *("угл. мин", "угл. мин.", "угл.мин", "угл.мин.", "угловые минуты"),
            *("угловых минут", "угловых минутах", "minutes d'arc", "minutes d’arc"),
        ),
        "arcsec": (
            *('"', "″", "”", "''", "′′", "arcsecs", "arcsecond", "arcseconds"),
            *("arc-seconds", "arc seconds"),
            *("Winkelsekunde", "Winkelsekunden", "Bogensekunde", "Bogensekunden"),
            *("угл. с", "угл. с.", "угл.с", "угл. сек", "угл. сек.", "угл.сек", "угл.сек."),
            *("угловые секунды", "угловых секунд", "угловых секундах"),
            *("secondes d'arc", "secondes d’arc"),
        ),
        "%": ("percent",),
        "degC": ("°C", "℃", "C", "deg_C", "deg C", "Celsius", "°\N{CYRILLIC CAPITAL LETTER ES}"),
        "K": ("kelvin", "°K", "\N{CYRILLIC CAPITAL LETTER KA}"),
        "degF": ("°F", "℉", "F", "deg_F", "deg F", "Fahrenheit"),
        "mK": ("millikelvin", "м\N{CYRILLIC CAPITAL LETTER KA}"),
        "s": (
            *("sec", "secs", "second", "seconds", "Sekunden"),
            *("\N{CYRILLIC SMALL LETTER ES}", "сек", "сек."),
        ),
        "ms": ("мс",),
        "us": ("µs", "μs", "мкс"),
        "min": ("mins", "minute", "minutes", "Minuten", "мин", "мин."),
        "h": ("hr", "hrs", "hour", "hours", "ч"),
        "d": ("day", "days", "сут", "сут."),
    }
)
"""Unit -> other ways of writing it."""

AS_WRITTEN = frozenset({"Grad", "MHz"})
"""Spellings of which another case may be another unit: the German degree and grad for gon, mHz."""

_CYRILLIC = re.compile("[\u0400-\u04ff]")
_CAPITALS = {"M": ("begins with mega", "milli"), "N": ("begins with N, no prefix", "nano")}
"""Capital prefixes that mean something else than the small ones, and what the small ones mean."""
_PREFIXES = (*_CAPITALS, "\N{CYRILLIC CAPITAL LETTER EM}", "\N{CYRILLIC CAPITAL LETTER EN}")
_OUTPUT = "output"
_EXACT = {
    _OUTPUT: {way: name for name, others in OUTPUT_UNITS.items() for way in (name, *others)}
} | {
    kind: {way: name for name in units for way in (name, *_SPELLINGS.get(name, ()))}
    for kind, units in {**UNITS, "scale": SCALES}.items()
}
"""Kind of quantity -> spelling of a unit -> its name."""
_FOLDED = {
    kind: {
        way.casefold(): way
        for way in reversed(exact)
        if way not in AS_WRITTEN and not (kind == _OUTPUT and _CYRILLIC.search(way))
    }
    for kind, exact in _EXACT.items()
}
"""Kind of quantity -> spelling in small letters -> the spelling; a small Cyrillic ve is a word."""
_LONGEST = 40
"""Characters of a unit that a message shows."""


def canonical_unit(text: str) -> str:
    """Name of an output unit.

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
    return _name_of(unit, _OUTPUT) or unit


def _name_of(unit: str, kind: str) -> str | None:
    """Name of a unit by its spelling, or by that in another case but for that of a prefix."""
    exact = _EXACT[kind]
    spelling = unit if unit in exact else _FOLDED[kind].get(unit.casefold())
    if spelling is None or _has_other_prefix(unit, spelling, exact):
        return None
    return exact[spelling]


def _has_other_prefix(unit: str, spelling: str, known: Mapping[str, str]) -> bool:
    """Tell whether the first letter, of another case, is that of another prefix."""
    return unit[:1] != spelling[:1] and unit[:1] in _PREFIXES and spelling[1:] in known


def output_unit(text: str) -> str:
    """Name of an output unit, which must be known.

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
    small = _FOLDED[_OUTPUT].get(name.casefold())
    if small:
        what, meant = _CAPITALS[name[0]]
        raise InputError(f"unit {shown!r} {what}; write {small} if {meant} is meant")
    raise InputError(f"unit {shown!r} is no output unit; it is one of {', '.join(OUTPUT_UNITS)}")


def is_output_unit(text: str) -> bool:
    """Tell whether a text is a known output unit.

    Examples
    --------
    >>> is_output_unit("mA"), is_output_unit("chamber")
    (True, False)
    """
    return canonical_unit(text) in OUTPUT_UNITS


def conversion_factor(given: str, wanted: str) -> float | None:
    """Factor from one output unit to another; None where the units are of other quantities.

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


def spellings(kind: str) -> Mapping[str, str]:
    """Ways of writing the units of a kind of quantity, each with the name of the unit.

    The kind is one of `UNITS`, or ``"scale"`` for those of `SCALES`.

    Examples
    --------
    >>> spellings("ratio")["percent"]
    '%'
    """
    return MappingProxyType(_EXACT[kind])


def size_of(unit: str, *kinds: str) -> float | None:
    """Size of a unit in the first one of its kind, of some of `UNITS`; None where it is of none.

    It is as written, in any case; but a capital M or N is not the prefix milli or nano.

    Examples
    --------
    >>> size_of("ppm", "ratio"), size_of("µrad", "angle"), size_of("mg", "angle", "acceleration")
    (1e-06, 1e-06, 0.001)
    >>> size_of("mA", "angle"), size_of("Mrad", "angle")
    (None, None)
    """
    for kind in kinds:
        if name := _name_of(unit.strip(), kind):
            return UNITS[kind][name]
    return None


def scaled(number: str, size: float) -> float:
    """Multiply a number as it is written by the size of its unit, and round once.

    It is the float next to the product of what both have written.

    Raises
    ------
    ValueError
        If it is no number.

    Examples
    --------
    >>> 20 * 1e-6, scaled("20", 1e-6)
    (1.9999999999999998e-05, 2e-05)
    """
    value = float(number)
    if size == 1.0 or not math.isfinite(value):
        return value
    from decimal import Decimal

    return float(Decimal(number) * Decimal(repr(size)))


def headed_by_units(frame: pd.DataFrame) -> pd.DataFrame:
    """Write the units of columns, ``frame.attrs["units"]``, into their headings.

    Examples
    --------
    >>> import pandas as pd
    >>> frame = pd.DataFrame({"angle_deg": [0.0], "output": [1.35]})
    >>> frame.attrs["units"] = {"angle_deg": "deg", "output": "mA"}
    >>> list(headed_by_units(frame))
    ['angle [deg]', 'output [mA]']
    """
    units = frame.attrs["units"].items()
    return frame.rename(columns={n: f"{n.removesuffix(f'_{unit}')} [{unit}]" for n, unit in units})


def degrees_in(unit: str) -> float:
    """Degrees in a unit in which the angles of a head may be given: degrees themselves, or radians.

    Examples
    --------
    >>> degrees_in("deg"), degrees_in("radians")
    (1.0, 57.29577951308232)
    """
    return 180.0 / math.pi if size_of(unit, "angle") == 1.0 else 1.0


def is_same_unit(one: str, other: str) -> bool:
    """Tell whether two texts are one unit of a column, in whatever way it is written.

    Examples
    --------
    >>> is_same_unit("°", "deg"), is_same_unit("rad", "deg"), is_same_unit("Volts", "V")
    (True, False, True)
    """
    kinds = ("scale", "angle", "time", _OUTPUT)
    name, *others = (
        next(filter(None, (_name_of(unit.strip(), kind) for kind in kinds)), unit.strip())
        for unit in (one, other)
    )
    return others == [name]


def scale_of(unit: str | None) -> str:
    """Name of the scale of temperatures that a unit is, one of `SCALES`; else degC.

    Examples
    --------
    >>> scale_of("kelvin"), scale_of("°F"), scale_of("chamber"), scale_of(None)
    ('K', 'degF', 'degC', 'degC')
    """
    return _name_of((unit or "").strip(), "scale") or "degC"


def celsius(temperature: ArrayLike, unit: str | None) -> Array:
    """Temperatures in degC of those in a unit as of `scale_of`, rounded to 1e-9 degC.

    Those in degC stay as they are.

    Examples
    --------
    >>> celsius([296.45, 293.15], "kelvin").tolist(), float(celsius(68, "°F"))
    ([23.3, 20.0], 20.0)
    """
    import numpy as np  # which most units do without

    zero, degree = SCALES[scale_of(unit)]
    values: Array = np.asarray(temperature, dtype=np.float64)
    return values if zero == 0.0 else np.round((values - zero) * degree, 9)
