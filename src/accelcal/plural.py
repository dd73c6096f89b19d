"""Nouns in their number, and names in a sentence."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sized

_HISSING = ("ch", "sh", "s", "x")


def plural(noun: str, number: float) -> str:
    """Put a noun into the plural where there are several.

    Examples
    --------
    >>> plural("run", 1), plural("run", 2), plural("launch", 0), plural("summary", 2)
    ('run', 'runs', 'launches', 'summaries')
    """
    if number == 1:
        return noun
    if noun.endswith("y") and noun[-2:-1] not in "aeiou":
        return f"{noun[:-1]}ies"
    return noun + ("es" if noun.endswith(_HISSING) else "s")


def named(noun: str, names: Collection[str]) -> str:
    """Write the names of some things behind what they are.

    Examples
    --------
    >>> named("run", ["1"]), named("run", ["2", "3"])
    ('run 1', 'runs 2, 3')
    """
    return f"{plural(noun, len(names))} {', '.join(names)}"


def are(names: Collection[str]) -> str:
    """Say whether one thing is, or several are.

    Examples
    --------
    >>> are(["K1"]), are(["K0", "K1"])
    ('is', 'are')
    """
    return "is" if len(names) == 1 else "are"


def counted(number: int, noun: str) -> str:
    """Write a number of things.

    Examples
    --------
    >>> counted(1, "degree") + ", " + counted(3, "table")
    '1 degree, 3 tables'
    """
    return f"{number} {plural(noun, number)}"


def degrees_of_freedom(number: float) -> str:
    """Write a number of degrees of freedom, which need not be whole.

    Examples
    --------
    >>> degrees_of_freedom(1), degrees_of_freedom(47.8)
    ('1 degree of freedom', '48 degrees of freedom')
    """
    return counted(round(number), "degree") + " of freedom"


def listed(names: Iterable[str], most: int = 8) -> str:
    """Name some things in a sentence, with the number of the rest; empty without names.

    Examples
    --------
    >>> listed(["K0"]), listed(["K0", "K1"]), listed(["K0", "K1", "M"])
    ('K0', 'K0 and K1', 'K0, K1 and M')
    >>> listed("abcdefghijk")
    'a, b, c, d, e, f, g, h and 3 more'
    """
    every = list(names)
    more = [f"{len(every) - most} more"] if len(every) > most else []
    *first, last = [*every[:most], *more] or [""]
    return f"{', '.join(first)} and {last}" if first else last


def lines_named(lines: Iterable[int]) -> str:
    """Name lines for a note, at most five of them.

    Examples
    --------
    >>> lines_named([7]), lines_named(range(1, 9))
    ('line 7', 'lines 1, 2, 3, 4, 5, ...')
    """
    numbers = [str(line) for line in dict.fromkeys(lines)]
    more = ["..."] if len(numbers) > 5 else []
    return named("line", numbers[:5] + more)


def were(lines: Sized, what: str) -> str:
    """Count what stands in some lines, before saying what was done to it.

    Examples
    --------
    >>> were([7], "row"), were([7, 8], "row")
    ('1 row was', '2 rows were')
    """
    return f"{counted(len(lines), what)} {'was' if len(lines) == 1 else 'were'}"
