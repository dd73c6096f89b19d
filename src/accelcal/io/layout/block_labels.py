"""What stands above blocks of columns: the temperature or serial of each, and shared names."""

from __future__ import annotations

from collections.abc import Sequence

from accelcal.io.layout.heading_rows import read_headings
from accelcal.io.layout.pivot_names import numbered_by
from accelcal.io.words.headings import Heading, read_heading
from accelcal.io.words.vocabulary import COLUMNS


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
    told = texts if not names else numbered_by(names[0], texts) if len(names) == 1 else []
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
