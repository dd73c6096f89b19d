"""Headings of a pivot table, whose columns of labels are named in the row below its numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from accelcal.io.layout.heading_rows import are_headings, read_headings, tell_places
from accelcal.io.words.headings import Heading, read_heading
from accelcal.io.words.vocabulary import COLUMNS, UNITS_OF

_NUMBERED: Mapping[str | None, str] = MappingProxyType(
    {
        "stroke": "stroke {}",
        "position": "position {}",
        "angle": "{} {}",
        "temperature": "T={} {}",
        "serial": "S/N {}",
    }
)
"""What numbers side by side stand for -> the heading of one, with its unit."""


def named_below(above: Sequence[str], row: Sequence[str]) -> tuple[Heading, ...] | None:
    """Join a row of numbers, before which stands what they are, and the names below it.

    None where the rows are no such headings.

    Examples
    --------
    >>> rows = ["stroke", "", "1", "2"], ["temperature", "position"]
    >>> [(cell.role, cell.of) for cell in named_below(*rows)][1:]
    [('position', None), ('strokes', 1), ('strokes', 2)]
    >>> named_below(["T [K]", "293.15", "333.15"], ["position"])[1][0::3]
    ('T [K] 293.15', '293.15 K')
    """
    names = [cell for cell in row if cell]
    told = [cell for cell in above[: len(names)] if cell]
    if len(told) != 1 or [*row[: len(names)]] != names:
        return None
    numbers = above[len(names) :]
    headings = numbered_by(told[0], numbers)
    if not headings or not COLUMNS.keys() >= {read_heading(name).role for name in names}:
        return None
    cells = read_headings([*names, *headings])
    if not (tell_places(cells) and are_headings(cells)):
        return None
    texts = [*names, *(f"{told[0]} {own}" for own in numbers)]
    return tuple(own._replace(text=text) for own, text in zip(cells, texts, strict=True))


def numbered_by(name: str, numbers: Sequence[str]) -> list[str]:
    """Headings that numbers side by side are, by the name before them; none by another name.

    Examples
    --------
    >>> numbered_by("Temp [K]", ["293.15", ""]), numbered_by("Table", ["1"])
    (['T=293.15 K', ''], [])
    """
    what = read_heading(name)
    form, unit = _NUMBERED.get(what.role), what.unit or UNITS_OF.get(what.role or "", ("",))[0]
    return [form.format(own, unit) if own else "" for own in numbers] if form else []
