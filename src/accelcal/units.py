"""Units as the people of a laboratory write them, and the one name that accelcal gives each."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

__all__ = ["OUTPUT_UNITS", "canonical_unit", "is_output_unit"]

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
