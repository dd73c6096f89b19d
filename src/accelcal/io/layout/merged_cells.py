"""Cells that stand once for all rows down to the next one, as merged cells do in exported text."""

from __future__ import annotations

from itertools import pairwise

from accelcal.arguments.kinds import shown
from accelcal.io.files.csv_text import in_quotes
from accelcal.io.layout.parts import Layout, split_line

_LABELS = frozenset(
    {"serial", "run", "temperature", "mounting", "clamping", "stroke", "direction", "position"}
    | {"angle", "lot", "date"}
)
"""Roles of columns whose cells may hold for rows below them."""


def with_merged_cells(layout: Layout) -> Layout:
    r"""Repeat the cells of columns where empty ones stand below each.

    Examples
    --------
    >>> from accelcal.io.layout.parts import read_layout
    >>> from accelcal.io.files.text import SourceText
    >>> text = "T,J,Y1\n20,1,1.35\n,3,0.01\n,5,-1.34\n60,1,1.36\n,3,0.02\n,5,-1.35\n"
    >>> with_merged_cells(read_layout(SourceText("a.csv", text, "utf-8"))).rows[4]
    '"60","3","0.02"'
    """
    columns = [place for place, own in enumerate(layout.headings) if own.role in _LABELS]
    head = [split_line(row, layout.separator) for row in layout.rows[:2]]
    if layout.separator is None or not any(_stands_once(head, place) for place in columns):
        return layout  # as nearly all
    table = [split_line(row, layout.separator) for row in layout.rows]
    merged = [place for place in columns if _stands_once(table, place) and _is_sparse(table, place)]
    if not merged:
        return layout
    for above, row in pairwise(table):
        for place in merged:
            row[place] = row[place] or above[place]
    names = shown(", ".join(layout.headings[place].text for place in merged))
    note = f"empty cells of {names} count as the one above them"
    rows = [layout.separator.join(map(in_quotes, row)) for row in table]
    return layout._replace(rows=rows, notes=(*layout.notes, note))


def _stands_once(table: list[list[str]], place: int) -> bool:
    """Whether the first cell of a column is filled, and an empty one stands below each that is."""
    if any(len(row) <= place for row in table):
        return False
    filled = [bool(row[place]) for row in table]
    return filled[0] and not any(above and below for above, below in pairwise([*filled, True]))


def _is_sparse(table: list[list[str]], place: int) -> bool:
    """Whether most cells are empty: a few that are missing look otherwise."""
    return 2 * sum(bool(row[place]) for row in table) < len(table)
