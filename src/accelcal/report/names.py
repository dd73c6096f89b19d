"""Names from outside, made safe to show."""

from __future__ import annotations

__all__ = ["counted", "printable", "visible"]


def visible(text: str) -> str:
    r"""Replace what is not printable by its escape, so that no name can move the cursor.

    Parameters
    ----------
    text : str
        Any text.

    Returns
    -------
    str
        The text with escapes.

    Examples
    --------
    >>> visible("AL-15\x1b[2J µ")
    'AL-15\\x1b[2J µ'
    """
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def printable(text: str) -> str:
    r"""Replace what is not printable ASCII by its escape.

    Parameters
    ----------
    text : str
        Any text.

    Returns
    -------
    str
        The text with escapes.

    Examples
    --------
    >>> printable("AL-15\x1b[2J µ")
    'AL-15\\x1b[2J \\xb5'
    """
    return visible(text).encode("ascii", "backslashreplace").decode()


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
