"""Units that stand in a row of their own, below the headings."""

from __future__ import annotations

from accelcal.io.cells import MISSING
from accelcal.io.layout import Layout, split_line
from accelcal.io.vocabulary import Heading, is_unit_of, read_heading

_NO_UNIT = MISSING | {"1"}
_WORDED = (None, "date", "time")  # columns below which any words may stand, such as hh:mm:ss


def with_units_below(layout: Layout) -> Layout:
    r"""Take a first row that holds units, and no reading, into the headings.

    Parameters
    ----------
    layout : Layout
        A table.

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
    cells = split_line(layout.rows[0], layout.separator)
    missing = len(layout.headings) - len(cells)
    if len(layout.rows) < 2 or any(cells[len(layout.headings) :]):
        return layout
    units = [cell.strip("[] ()") for cell in (*cells, *[""] * missing)]
    pairs = list(zip(layout.headings, units, strict=False))
    if not all(_may_be_unit(*pair) for pair in pairs) or not any(_is_unit(*pair) for pair in pairs):
        return layout
    return layout._replace(
        headings=tuple(_with_unit(*pair) for pair in pairs),
        rows=layout.rows[1:],
        lines=layout.lines[1:],
        notes=(*layout.notes, f"the units stand below the headings (line {layout.lines[0]})"),
    )


def _is_unit(heading: Heading, cell: str) -> bool:
    if cell.casefold() in _NO_UNIT or heading.role is None:
        return False
    return is_unit_of(heading.role, cell) and heading.unit in (None, cell)


def _may_be_unit(heading: Heading, cell: str) -> bool:
    worded = heading.role in _WORDED and not any(map(str.isdigit, cell))
    is_merged = cell == heading.text  # one cell over both rows
    return is_merged or worded or cell.casefold() in _NO_UNIT or _is_unit(heading, cell)


def _with_unit(heading: Heading, cell: str) -> Heading:
    is_told = heading.role is None and cell.casefold() not in _NO_UNIT
    if heading.unit or not (is_told or _is_unit(heading, cell)):
        return heading
    return read_heading(f"{heading.text} [{cell}]")
