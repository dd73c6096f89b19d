"""A row of units below the headings of a table."""

from __future__ import annotations

from accelcal.io.layout.parts import Layout, split_line
from accelcal.io.layout.unit_rows import headings_with_units

UNITS_BELOW = "the units stand below the headings (line {})"


def with_units_below(layout: Layout) -> Layout:
    r"""Take a first row that holds units, and no reading, into the headings.

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
