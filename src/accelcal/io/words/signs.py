"""Signs in a table: the minus sign, and the sides of a mounting."""

from __future__ import annotations


def with_hyphen(text: str) -> str:
    """Write the minus sign as programs do, where a text has that of typesetting, or a dash.

    Examples
    --------
    >>> with_hyphen("\N{MINUS SIGN}40"), with_hyphen("\N{EN DASH}40")
    ('-40', '-40')
    """
    return text.replace("\N{MINUS SIGN}", "-").replace("\N{EN DASH}", "-")


def mounting_written(name: str) -> str:
    """Tell which of `accelcal.geometry.MOUNTINGS` a name in a table means, if it is one.

    Examples
    --------
    >>> mounting_written("O"), mounting_written("P-")
    ('o+', 'p-')
    """
    name = with_hyphen(name.casefold())
    return name + "+" if name in ("o", "p") else name
