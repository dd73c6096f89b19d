"""Ticks of axes: names where there is room for them, and short numbers on logarithmic axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any


def name_ticks(axis: Any, places: Any, names: Sequence[str], most: int, **text: Any) -> None:
    """Name places on an axis, each of them or every second, third ... one.

    Parameters
    ----------
    axis : matplotlib.axis.Axis
        The axis.
    places : range or ndarray
        Where the names belong.
    names : sequence of str
        One for each place.
    most : int
        Names that there is room for.
    **text
        How matplotlib writes them.
    """
    every = max(1, -(-len(names) // most))
    axis.set_ticks(places[::every], names[::every], **text)


def short_log_ticks(axis: Any, steps: Sequence[float], digits: int = 6) -> None:
    """Label a logarithmic axis with plain numbers.

    Parameters
    ----------
    axis : matplotlib.axis.Axis
        The axis.
    steps : sequence of float
        Numbers of each decade that have a label, such as 1, 2 and 5.
    digits : int, default 6
        Digits of the labels.
    """
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=steps))
    axis.set_major_formatter(FuncFormatter(lambda number, _: f"{number:.{digits}g}"))
    axis.set_minor_formatter(NullFormatter())
