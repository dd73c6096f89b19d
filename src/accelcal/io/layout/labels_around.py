"""What stands around headings: names of a pivot table below its numbers, labels above blocks."""

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
    headings = _numbered_by(told[0], numbers)
    if not headings or not COLUMNS.keys() >= {read_heading(name).role for name in names}:
        return None
    cells = read_headings([*names, *headings])
    if not (tell_places(cells) and are_headings(cells)):
        return None
    texts = [*names, *(f"{told[0]} {own}" for own in numbers)]
    return tuple(own._replace(text=text) for own, text in zip(cells, texts, strict=True))


def _numbered_by(name: str, numbers: Sequence[str]) -> list[str]:
    """Headings that numbers side by side are, by the name before them; none by another name.

    Examples
    --------
    >>> _numbered_by("Temp [K]", ["293.15", ""]), _numbered_by("Table", ["1"])
    (['T=293.15 K', ''], [])
    """
    what = read_heading(name)
    form, unit = _NUMBERED.get(what.role), what.unit or UNITS_OF.get(what.role or "", ("",))[0]
    return [form.format(own, unit) if own else "" for own in numbers] if form else []


def labels_of_blocks(row: Sequence[str], lead: int, width: int) -> tuple[Heading, ...]:
    """What a row above blocks of columns tells of each: its temperature or serial; else nothing.

    The first `lead` columns belong to all blocks. A cell may stand in each column of its block, and
    numbers may have their name before them.

    Examples
    --------
    >>> [own.of for own in labels_of_blocks(["20 °C", "", "", "60 °C"], 0, 3)]
    [20.0, 60.0]
    >>> [own[0::3] for own in labels_of_blocks(["T [K]", "293.15", "", "333.15", ""], 1, 2)]
    [('293.15', '293.15 K'), ('333.15', '333.15 K')]
    """
    names, cells = [cell for cell in row[:lead] if cell], row[lead:]
    own = [
        "" if place % width and cell == cells[place - place % width] else cell
        for place, cell in enumerate(cells)
    ]
    starts = [place for place, cell in enumerate(own) if cell]
    texts = [own[place] for place in starts]
    told = texts if not names else _numbered_by(names[0], texts) if len(names) == 1 else []
    labels = [read_heading(cell) for cell in told]
    is_apart = len(starts) > 1 and starts[0] < width
    is_apart = is_apart and starts == [*range(starts[0], len(starts) * width, width)]
    if not is_apart or {own.role for own in labels} not in ({"temperatures"}, {"serials"}):
        return ()
    return tuple(own._replace(text=text) for own, text in zip(labels, texts, strict=True))


def with_merged_names(texts: Sequence[str], above: Sequence[str]) -> tuple[Heading, ...]:
    """Headings whose first ones stand in the row above, as cells merged over both do; else nothing.

    Examples
    --------
    >>> [cell.role for cell in with_merged_names(["", "Y1", "Y2", "Y1", "Y2"], ["J"])][:2]
    ['position', 'strokes']
    """
    size = len(above)
    known = all(read_heading(cell).role in COLUMNS for cell in above)
    return (
        read_headings([*above, *texts[size:]]) if size and known and not any(texts[:size]) else ()
    )
