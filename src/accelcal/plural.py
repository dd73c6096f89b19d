"""Nouns in their number."""

from __future__ import annotations

from collections.abc import Collection

_HISSING = ("ch", "sh", "s", "x")


def plural(noun: str, number: float) -> str:
    """Put a noun into the plural where there are several.

    Parameters
    ----------
    noun : str
        One of the things.
    number : float
        How many there are.

    Returns
    -------
    str
        The noun.

    Examples
    --------
    >>> plural("run", 1), plural("run", 2), plural("launch", 0)
    ('run', 'runs', 'launches')
    """
    if number == 1:
        return noun
    return noun + ("es" if noun.endswith(_HISSING) else "s")


def named(noun: str, names: Collection[str]) -> str:
    """Write the names of some things behind what they are.

    Parameters
    ----------
    noun : str
        One of the things.
    names : collection of str
        Their names.

    Returns
    -------
    str
        Noun and names.

    Examples
    --------
    >>> named("run", ["1"]), named("run", ["2", "3"])
    ('run 1', 'runs 2, 3')
    """
    return f"{plural(noun, len(names))} {', '.join(names)}"


def counted(number: int, noun: str) -> str:
    """Write a number of things.

    Parameters
    ----------
    number : int
        How many.
    noun : str
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
    return f"{number} {plural(noun, number)}"
