"""Names in pictures, as they are written and where there is room, and short numbers on axes."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from functools import cache
from typing import Any

from accelcal.escapes import visible

FONT = "DejaVu Sans"
"""Comes with matplotlib: the same picture everywhere."""

LONGEST_TITLE = 60
"""Letters of a name that have room in the title of a picture."""


def name_ticks(axis: Any, places: Any, names: Sequence[str], most: int, **text: Any) -> None:
    """Name places on an axis, each or every second, third ... one, `most` at most."""
    every = max(1, -(-len(names) // most))
    axis.set_ticks(places[::every], names[::every], **text)


def literal(name: str) -> str:
    r"""Write a name as it is: what stands between two dollar signs would be mathematics.

    Letters that the font lacks are escaped.

    Examples
    --------
    >>> literal("$12 or $15")
    '\\$12 or \\$15'
    """
    return _drawable(name).replace("$", r"\$")


def _drawable(name: str) -> str:
    known = _letters()
    return "".join(c if ord(c) in known else _escaped(c) for c in visible(name))


@cache
def _letters() -> Collection[int]:
    from matplotlib.font_manager import findfont, get_font

    return get_font(findfont(FONT)).get_charmap().keys()


def _escaped(letter: str) -> str:
    return letter.encode("ascii", "backslashreplace").decode()


def shortened(name: str, most: int) -> str:
    """Take letters out of the middle of a long name: names of a series differ at their ends.

    What is left is `literal`.

    Examples
    --------
    >>> shortened("visit number 12", 8), shortened("20 (2)", 8)
    ('vi…er 12', '20 (2)')
    """
    begin = most // 3
    name = _drawable(name)
    return literal(name if len(name) <= most else f"{name[:begin]}…{name[begin + 1 - most :]}")


def short_log_ticks(axis: Any, steps: Sequence[float], digits: int = 6) -> None:
    """Label a logarithmic axis with plain numbers at `steps` of each decade, such as 1, 2, 5."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=steps))
    axis.set_major_formatter(FuncFormatter(lambda number, _: f"{number:.{digits}g}"))
    axis.set_minor_formatter(NullFormatter())
