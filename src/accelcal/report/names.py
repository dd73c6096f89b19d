"""Names from outside, made safe to show."""

from __future__ import annotations

from collections.abc import Iterable

from accelcal.escapes import visible

__all__ = ["counted", "visible_lines"]


def visible_lines(lines: Iterable[str]) -> str:
    r"""Join the lines of a report, whatever names stand in them.

    Parameters
    ----------
    lines : iterable of str
        The lines.

    Returns
    -------
    str
        The text, each line with escapes as of `visible`.

    Examples
    --------
    >>> visible_lines(["serial AL\n15", "K1"])
    'serial AL\\n15\nK1'
    """
    return "\n".join(map(visible, lines))


def counted(number: int, what: str) -> str:
    """Write a number of things.

    Parameters
    ----------
    number : int
        How many.
    what : str
        One of them.

    Returns
    -------
    str
        Number and noun.

    Examples
    --------
    >>> counted(1, "degree") + ", " + counted(3, "table")
    '1 degree, 3 tables'
    """
    return f"{number} {what}{'' if number == 1 else 's'}"
