"""Levels of temperature, of which some may be unknown."""

from __future__ import annotations

import math
from collections.abc import Sequence


def nearest_level(levels: Sequence[float | None], temperature: float | None) -> int:
    """Find the level that is nearest to a temperature.

    Parameters
    ----------
    levels : sequence of float or None
        Temperatures, one or more; None where unknown [degC].
    temperature : float or None
        What is asked for; None where unknown [degC].

    Returns
    -------
    int
        Place of the first of the nearest; a level that is unknown is farther than all others.

    Examples
    --------
    >>> nearest_level([None, 80.0, 22.0], 20.0), nearest_level([None, None], 20.0)
    (2, 0)
    """

    def away(place: int) -> float:
        level = levels[place]
        return math.inf if level is None or temperature is None else abs(level - temperature)

    return min(range(len(levels)), key=away)
