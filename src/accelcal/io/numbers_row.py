"""A row below the headings that numbers the outputs under one heading, taken into the headings."""

from __future__ import annotations

from collections.abc import Iterator

from accelcal.io.layout import Layout, split_line
from accelcal.io.units_row import headings_with_units, with_row_in_headings
from accelcal.io.vocabulary import ACROSS, Heading, read_heading


def with_numbers_below(layout: Layout) -> Layout:
    r"""Take a first row that numbers the outputs, and holds no reading, into the headings.

    Returns
    -------
    Layout
        The table without such a row, with a note; the same where it has none.

    Examples
    --------
    >>> from accelcal.io.layout import read_layout
    >>> from accelcal.io.text import SourceText
    >>> text = "T;J;Y [mA];;\n;;1;2;3\n20;1;1.35;1.35;1.35"
    >>> layout = read_layout(SourceText("a.csv", text, "utf-8", compressed=False))
    >>> [heading.text for heading in with_numbers_below(layout).headings]
    ['T', 'J', '1 [mA]', '2 [mA]', '3 [mA]']
    """
    *names, last = layout.headings
    cells = [read_heading(cell) for cell in split_line(layout.rows[0], layout.separator)]
    while cells and not cells[-1].text:
        cells.pop()
    beside, numbers = cells[: len(names)], cells[len(names) :]
    if last.role != "output" or len(layout.rows) < 2 or not _number_outputs(names, numbers):
        return layout
    if any(map(str.isdigit, "".join(cell.text for cell in beside))):
        return layout
    unit = f" [{last.unit}]" if last.unit else ""
    numbered = (read_heading(cell.text + (unit if not cell.unit else "")) for cell in numbers)
    headings = (*_with_units(names, beside), *numbered)
    return with_row_in_headings(layout, headings, f"line {layout.lines[0]} numbers the outputs")


def _number_outputs(names: list[Heading], numbers: list[Heading]) -> bool:
    """Whether the row tells one thing of several outputs, which no other column tells."""
    kinds = {cell.role for cell in numbers}
    told = {ACROSS.get(str(kind)) for kind in kinds}
    return len(numbers) > 1 and len(kinds) == 1 and not told & {None, *(n.role for n in names)}


def _with_units(names: list[Heading], cells: list[Heading]) -> Iterator[Heading]:
    for name, cell in zip(names, cells, strict=True):
        yield from headings_with_units([name], [cell.text]) or [name]
