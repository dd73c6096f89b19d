"""What the end of the name of a file says of its form."""

from __future__ import annotations

from collections.abc import Iterable
from os import PathLike

from accelcal.arguments.kinds import path_text
from accelcal.errors import InputError


def ending_of(path: str | PathLike[str], endings: Iterable[str], remedy: str = "choose one") -> str:
    """Tell the end of the name of a file, capitals or not.

    Examples
    --------
    >>> ending_of("budget.SVG", [".png", ".svg"])
    '.svg'
    """
    endings = tuple(endings)
    name = path_text(path, f"name a file that ends in {', '.join(endings)}")
    for ending in endings:
        if name.casefold().endswith(ending):
            return ending
    told = name or repr(name)
    raise InputError(f"{told}: the name ends in none of {', '.join(endings)}; {remedy}")
