"""Ticks of axes: names where there is room for them, and short numbers on logarithmic axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any


def name_ticks(axis: Any, places: Any, names: Sequence[str], most: int, **text: Any) -> None:
    """Name places on an axis, each or every second, third ... one, `most` at most."""
    every = max(1, -(-len(names) // most))
    axis.set_ticks(places[::every], names[::every], **text)


def shortened(name: str, most: int) -> str:
    """Take letters out of the middle of a long name: names of a series differ at their ends.

    Examples
    --------
    >>> shortened("visit number 12", 8), shortened("20 (2)", 8)
    ('vi…er 12', '20 (2)')
    """
    begin = most // 3
    return name if len(name) <= most else f"{name[:begin]}…{name[begin + 1 - most :]}"


def short_log_ticks(axis: Any, steps: Sequence[float], digits: int = 6) -> None:
    """Label a logarithmic axis with plain numbers at `steps` of each decade, such as 1, 2, 5."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=steps))
    axis.set_major_formatter(FuncFormatter(lambda number, _: f"{number:.{digits}g}"))
    axis.set_minor_formatter(NullFormatter())
