"""One table whose headings stand several times: blocks side by side, or below each other."""

from __future__ import annotations

from collections.abc import Sequence

from accelcal.io.files.csv_text import in_quotes
from accelcal.io.layout.heading_rows import block_width
from accelcal.io.layout.parts import Layout, split_line
from accelcal.io.layout.unit_rows import headings_with_units
from accelcal.io.words.vocabulary import ACROSS, Heading
from accelcal.io.words.wording import lines_named, were

_KEY = frozenset(
    {"serial", "run", "temperature", "mounting", "clamping", "stroke", "direction"}
    | {"position", "angle", "minutes", "seconds"}
)
"""Roles of the columns that tell which reading it is."""

_PLACES = frozenset({"position", "angle", "stroke"})


def without_repeated_headings(layout: Layout) -> Layout:
    r"""Leave out the rows that repeat the headings, where the blocks tell their readings apart.

    The table stays as it is where it would have a reading twice.

    Examples
    --------
    >>> from accelcal.io.layout.parts import read_layout
    >>> from accelcal.io.files.text import SourceText
    >>> text = "T,J,Y1,Y2\n20,1,1.35,1.35\nT,J,Y1,Y2\n60,1,1.36,1.36\n"
    >>> without_repeated_headings(read_layout(SourceText("a.csv", text, "utf-8"))).rows
    ['20,1,1.35,1.35', '60,1,1.36,1.36']
    """
    texts = [heading.text for heading in layout.headings]
    first = next(filter(None, texts))
    repeated = [
        place
        for place, row in enumerate(layout.rows)
        if first in row and _cells(row, layout, len(texts)) == texts
    ]
    if not repeated:
        return layout
    if headings_with_units(layout.headings, _cells(layout.rows[0], layout, len(texts))):
        below = [place + 1 for place in repeated]
        repeated += [place for place in below if layout.rows[place : place + 1] == layout.rows[:1]]
    left = sorted(set(range(len(layout.rows))).difference(repeated))
    lines = [layout.lines[place] for place in sorted(repeated)]
    note = f"{were(lines, 'row')} of headings again, and left out ({lines_named(lines)})"
    return _if_told_apart(layout, layout.some(left)._replace(notes=(*layout.notes, note)))


def with_blocks_below(layout: Layout) -> Layout:
    r"""Put blocks of the same columns that stand side by side below each other.

    A temperature or serial that stands above each of them becomes a column. The table stays as it
    is where it would have a reading twice.

    Examples
    --------
    >>> from accelcal.io.layout.parts import read_layout
    >>> from accelcal.io.files.text import SourceText
    >>> text = "T,J,Y1,Y2,,T,J,Y1,Y2\n20,1,1.35,1.35,,60,1,1.36,1.36\n"
    >>> with_blocks_below(read_layout(SourceText("a.csv", text, "utf-8"))).rows
    ['"20","1","1.35","1.35"', '"60","1","1.36","1.36"']
    """
    texts = [heading.text for heading in layout.headings]
    width = block_width(texts)
    labels = layout.labels
    label = [Heading(own.text, ACROSS[own.role or ""]) for own in labels[:1]]
    used = width - (texts[width - 1 : width] == [""])
    headings = (*layout.headings[:used], *label)
    if not _PLACES & {heading.role for heading in headings}:
        return layout
    count = -(-len(texts) // width)
    table = [_cells(row, layout, count * width) for row in layout.rows]
    gaps = range(width - 1, count * width, width) if used < width else ()
    if any(any(row[count * width :]) or any(row[place] for place in gaps) for row in table):
        return layout
    blocks = [
        ([*row[start : start + used], *_told(labels[start // width :][:1])], line)
        for start in range(0, count * width, width)
        for row, line in zip(table, layout.lines, strict=True)
        if any(row[start : start + width])
    ]
    mark = layout.separator or " "
    return _if_told_apart(
        layout,
        layout._replace(
            headings=headings,
            rows=[mark.join(map(in_quotes, cells)) for cells, _ in blocks],
            lines=[line for _, line in blocks],
            notes=(*layout.notes, f"{count} blocks side by side are read as one table"),
        ),
    )


def _told(labels: Sequence[Heading]) -> list[str]:
    """Cell of what stands above a block."""
    return [own.of if isinstance(own.of, str) else f"{own.of:g}" for own in labels]


def _if_told_apart(before: Layout, after: Layout) -> Layout:
    """The table made anew if no two rows of it are of one reading, else as it was."""
    size = len(after.headings)
    key = [place for place, own in enumerate(after.headings) if own.role in _KEY]
    rows = [_cells(row, after, size) for row in after.rows]
    told = {tuple(row[place] for place in key) for row in rows}
    return after if len(told) == len(rows) else before


def _cells(row: str, layout: Layout, size: int) -> list[str]:
    """Cells of a row, at least as many as there are columns."""
    cells = split_line(row, layout.separator)
    while len(cells) > size and not cells[-1]:
        cells.pop()
    return cells + [""] * (size - len(cells))
