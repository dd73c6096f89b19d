"""A row of units below the headings of a table."""

from __future__ import annotations

from collections.abc import Sequence

from accelcal.io.layout.parts import Layout, split_line
from accelcal.io.words.signs import MISSING
from accelcal.io.words.vocabulary import Heading, is_unit_of, read_heading
from accelcal.units import canonical_unit, size_of

_NO_UNIT = MISSING | {"1"}
_WORDED = (None, "date", "time")  # columns below which any words may stand, such as hh:mm:ss
UNITS_BELOW = "the units stand below the headings (line {})"


def with_units_below(layout: Layout) -> Layout:
    r"""Take a first row that holds units, and no reading, into the headings.

    Returns
    -------
    Layout
        The table without such a row, with a note of it; the same where it has none.

    Examples
    --------
    >>> from accelcal.io.layout.parts import read_layout
    >>> from accelcal.io.files.text import SourceText
    >>> text = "T;J;Y [mA];;\n;;1;2;3\ndegC;-;mA;mA;mA\n20;1;1.35;1.35;1.35"
    >>> layout = with_units_below(read_layout(SourceText("a.csv", text, "utf-8")))
    >>> [heading.text for heading in layout.headings], layout.rows
    (['T [degC]', 'J', '1 [mA]', '2 [mA]', '3 [mA]'], ['20;1;1.35;1.35;1.35'])
    """
    row = split_line(layout.rows[0], layout.separator)
    headings = headings_with_units(layout.headings, row) if len(layout.rows) > 1 else None
    if headings is None:
        return layout
    return layout._replace(
        headings=headings,
        rows=layout.rows[1:],
        lines=layout.lines[1:],
        notes=(*layout.notes, UNITS_BELOW.format(layout.lines[0])),
    )


def headings_with_units(
    headings: Sequence[Heading], row: Sequence[str]
) -> tuple[Heading, ...] | None:
    """Join headings and the units below them.

    Parameters
    ----------
    headings : sequence of Heading
        One entry a column.
    row : sequence of str
        Cells of the row below.

    Returns
    -------
    tuple of Heading or None
        The headings with their units; None where the row holds something else.
    """
    if any(row[len(headings) :]):
        return None
    missing = len(headings) - len(row)
    units = [cell.strip("[] ()") for cell in (*row, *[""] * missing)]
    pairs = list(zip(headings, units, strict=False))
    if not all(_may_be_unit(*pair) for pair in pairs) or not any(_is_unit(*pair) for pair in pairs):
        return None
    return tuple(_with_unit(*pair) for pair in pairs)


def _is_unit(heading: Heading, cell: str) -> bool:
    if cell.casefold() in _NO_UNIT or heading.role is None:
        return False
    units = {_by_size(unit) for unit in (heading.unit, cell) if unit is not None}
    return is_unit_of(heading.role, cell) and len(units) == 1


def _by_size(unit: str) -> str | float:
    """A unit in whatever way it is written."""
    return size_of(unit, "temperature", "angle", "time") or canonical_unit(unit)


def _may_be_unit(heading: Heading, cell: str) -> bool:
    is_other = heading.unit and is_unit_of(heading.role or "", cell)
    worded = heading.role in _WORDED and not (any(map(str.isdigit, cell)) or is_other)
    is_merged = cell == heading.text  # one cell over both rows
    return is_merged or worded or cell.casefold() in _NO_UNIT or _is_unit(heading, cell)


def _with_unit(heading: Heading, cell: str) -> Heading:
    is_told = heading.role is None and cell.casefold() not in _NO_UNIT
    if heading.unit or not (is_told or _is_unit(heading, cell)):
        return heading
    return read_heading(f"{heading.text} [{cell}]")
