"""Units as the people of a laboratory write them, and the one name that accelcal gives each."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

__all__ = ["OUTPUT_UNITS", "canonical_unit", "conversion_factor", "is_output_unit"]

OUTPUT_UNITS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "V": ("volt", "volts"),
        "mV": ("millivolt", "millivolts"),
        "uV": ("µV", "μV", "microvolt", "microvolts"),
        "nV": ("nanovolt", "nanovolts"),
        "A": ("amp", "amps", "ampere", "amperes"),
        "mA": ("milliamp", "milliamps", "milliampere", "milliamperes"),
        "uA": ("µA", "μA", "microamp", "microamps", "microampere", "microamperes"),
        "nA": ("nanoamp", "nanoamps", "nanoampere", "nanoamperes"),
        "Hz": ("hertz",),
        "kHz": ("kilohertz",),
        "MHz": ("megahertz",),
        "counts": ("count", "cnt", "cts", "lsb", "lsbs", "digit", "digits"),
        "pulses": ("pulse", "imp"),
        "pulses/s": ("pulse/s", "pps"),
        "g": (),
        "m/s^2": ("m/s2", "m/s²", "m/s**2", "m s-2"),
    }
)
"""Canonical name of an output unit -> other ways of writing it."""

_POWERS_OF_TEN: Mapping[str, Mapping[str, int]] = MappingProxyType(
    {
        "V": {"V": 0, "mV": -3, "uV": -6, "nV": -9},
        "A": {"A": 0, "mA": -3, "uA": -6, "nA": -9},
        "Hz": {"Hz": 0, "kHz": 3, "MHz": 6},
    }
)
"""Quantity -> its units as powers of ten."""

_EXACT = {name: name for name in OUTPUT_UNITS} | {
    other: name for name, others in OUTPUT_UNITS.items() for other in others
}
_FOLDED = {spelling.casefold(): name for spelling, name in reversed(_EXACT.items())}
del _FOLDED["mhz"]  # mHz or MHz? only the exact spelling tells


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
    The exact spelling is looked up first, then the spelling without regard to case.

    Examples
    --------
    >>> canonical_unit(" Volts "), canonical_unit("µA"), canonical_unit("ma")
    ('V', 'uA', 'mA')
    >>> canonical_unit("furlong")
    'furlong'
    """
    unit = text.strip()
    return _EXACT.get(unit) or _FOLDED.get(unit.casefold(), unit)


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
