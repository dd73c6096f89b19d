"""A row of units below the headings of a table, taken into the headings."""

from __future__ import annotations

from collections.abc import Sequence

from accelcal.io.cells import MISSING
from accelcal.io.layout import Layout, split_line
from accelcal.io.vocabulary import Heading, is_unit_of, read_heading

_NO_UNIT = MISSING | {"1"}
_WORDED = (None, "date", "time")  # columns below which any words may stand, such as hh:mm:ss


def with_units_below(layout: Layout) -> Layout:
    r"""Take a first row that holds units, and no reading, into the headings.

    Returns
    -------
    Layout
        The table without such a row, with a note; the same where it has none.

    Examples
    --------
    >>> from accelcal.io.layout import read_layout
    >>> from accelcal.io.text import SourceText
    >>> text = "T;J;k;Y\ndegC;-;;[mA]\n20;1;1;1.35"
    >>> layout = with_units_below(read_layout(SourceText("a.csv", text, "utf-8", compressed=False)))
    >>> [heading.unit for heading in layout.headings], layout.rows
    (['degC', None, None, 'mA'], ['20;1;1;1.35'])
    """
    told = headings_with_units(layout.headings, split_line(layout.rows[0], layout.separator))
    if len(layout.rows) < 2 or told is None:
        return layout
    return with_row_in_headings(layout, told, UNITS_BELOW.format(layout.lines[0]))


def with_row_in_headings(layout: Layout, headings: Sequence[Heading], note: str) -> Layout:
    """Take the first row of a table away, which is in the headings now, with a note."""
    return layout._replace(
        headings=tuple(headings),
        rows=layout.rows[1:],
        lines=layout.lines[1:],
        notes=(*layout.notes, note),
    )


UNITS_BELOW = "the units stand below the headings (line {})"


def headings_with_units(
    headings: Sequence[Heading], cells: Sequence[str]
) -> tuple[Heading, ...] | None:
    """Join headings and the units below them.

    Parameters
    ----------
    headings : sequence of Heading
        One entry a column.
    cells : sequence of str
        The row below.

    Returns
    -------
    tuple of Heading or None
        The headings with their units; None where the row holds something else.
    """
    if any(cells[len(headings) :]):
        return None
    missing = len(headings) - len(cells)
    units = [cell.strip("[] ()") for cell in (*cells, *[""] * missing)]
    pairs = list(zip(headings, units, strict=False))
    if not all(_may_be_unit(*pair) for pair in pairs) or not any(_is_unit(*pair) for pair in pairs):
        return None
    return tuple(_with_unit(*pair) for pair in pairs)


def _is_unit(heading: Heading, cell: str) -> bool:
    if cell.casefold() in _NO_UNIT or heading.role is None:
        return False
    return is_unit_of(heading.role, cell) and heading.unit in (None, cell)


def _may_be_unit(heading: Heading, cell: str) -> bool:
    worded = heading.role in _WORDED and not any(map(str.isdigit, cell))
    is_merged = cell == heading.text  # one cell over both rows
    return is_merged or worded or cell.casefold() in _NO_UNIT or _is_unit(heading, cell)


def _with_unit(heading: Heading, cell: str) -> Heading:
    if not heading.text:  # of a row above that numbers the outputs alone
        return read_heading(cell)
    is_told = heading.role is None and cell.casefold() not in _NO_UNIT
    if heading.unit or not (is_told or _is_unit(heading, cell)):
        return heading
    return read_heading(f"{heading.text} [{cell}]")
