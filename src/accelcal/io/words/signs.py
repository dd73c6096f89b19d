"""Signs in a table: the minus sign, what stands for a missing value, the sides of a mounting."""

from __future__ import annotations

MISSING = frozenset(
    {"", "-", "--", "---", "?", "na", "n/a", "n.a.", "nan", "null", "none", "unknown", "missing"}
    | {"#n/a", "#nv", "#n/d", "#н/д", "#n/d!", "#n/b"}  # of Excel
    | {"k.a.", "—", "–", "\\n"}  # the last one of databases
    | {f"{sign}{name}" for sign in ("-", "") for name in ("nan(ind)", "1.#ind", "1.#qnan")}
)
"""Cells that stand for a missing value, in lower case."""


def is_missing(cell: str) -> bool:
    """Tell whether a cell stands for a missing value."""
    return cell.casefold() in MISSING


def with_hyphen(text: str) -> str:
    """Write the minus sign as programs do, where a text has that of typesetting, or a dash.

    Examples
    --------
    >>> with_hyphen("\N{MINUS SIGN}40"), with_hyphen("\N{EN DASH}40")
    ('-40', '-40')
    """
    return text.replace("\N{MINUS SIGN}", "-").replace("\N{EN DASH}", "-")


def begins_number(cell: str) -> bool:
    """Tell whether a cell begins as a number does."""
    return cell.lstrip("+-\N{MINUS SIGN}\N{EN DASH}.,")[:1].isdecimal()


def mounting_written(name: str) -> str:
    """Tell which of `accelcal.geometry.MOUNTINGS` a name in a table means, if it is one.

    Examples
    --------
    >>> mounting_written("O"), mounting_written("P-")
    ('o+', 'p-')
    """
    name = with_hyphen(name.casefold())
    return name + "+" if name in ("o", "p") else name
