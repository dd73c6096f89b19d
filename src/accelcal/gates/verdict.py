"""The verdict of a gate, and sizes as a gate words them."""

from __future__ import annotations

import math
from itertools import pairwise

from accelcal.results.quantity import Gate

__all__ = ["SIGNIFICANT", "acceleration", "angle", "not_assessed", "times", "warn_if"]

SIGNIFICANT = 0.01
"""False-alarm rate of a gate that is a statistical test."""


def warn_if(name: str, bad: bool, finding: str) -> Gate:
    """Warn or pass.

    Parameters
    ----------
    name : str
        What was checked.
    bad : bool
        Whether to warn.
    finding : str
        What was found.

    Returns
    -------
    Gate
        The verdict.

    Examples
    --------
    >>> warn_if("closure", False, "Y(return) - Y1 2.0 ug").verdict
    'pass'
    """
    return Gate(name, "warn" if bad else "pass", finding)


def not_assessed(name: str, reason: str) -> Gate:
    """Say why a gate could not look.

    Parameters
    ----------
    name : str
        What was to be checked.
    reason : str
        What is missing.

    Returns
    -------
    Gate
        The verdict.
    """
    return Gate(name, "not assessed", reason)


def acceleration(value: float) -> str:
    """Write an acceleration in ug, mg or g, whichever is short.

    Parameters
    ----------
    value : float
        Acceleration [g].

    Returns
    -------
    str
        Three or four digits and the unit.

    Examples
    --------
    >>> acceleration(-2.147e-5), acceleration(0.7777), acceleration(9.3)
    ('-21.5 ug', '778 mg', '9.3 g')
    """
    return _short(value, (1e-6, "ug"), (1e-3, "mg"), (1.0, "g"))


def angle(value: float) -> str:
    """Write an angle in urad, mrad or degrees, whichever is short.

    Parameters
    ----------
    value : float
        Angle [rad].

    Returns
    -------
    str
        Three digits and the unit.

    Examples
    --------
    >>> angle(2.1e-5), angle(0.0123), angle(0.5)
    ('21 urad', '12.3 mrad', '28.6 deg')
    """
    return _short(value, (1e-6, "urad"), (1e-3, "mrad"), (math.pi / 180.0, "deg"))


def _short(value: float, *units: tuple[float, str]) -> str:
    for (size, unit), (larger, _) in pairwise(units):
        if abs(value) < 0.9995 * larger:
            return f"{_three_digits(value / size)} {unit}"
    size, unit = units[-1]
    return f"{_three_digits(value / size)} {unit}"


def _three_digits(value: float) -> str:
    return f"{float(f'{value:.3g}'):.12g}" if 0.1 <= abs(value) < 1e9 else f"{value:.2g}"


def times(ratio: float) -> str:
    """Write a ratio as so many times.

    Parameters
    ----------
    ratio : float
        A ratio above zero.

    Returns
    -------
    str
        Two digits.

    Examples
    --------
    >>> times(38812.0), times(2.04), times(0.001003)
    ('39000', '2', '0.001')
    """
    return f"{float(f'{ratio:.2g}'):.12g}"
