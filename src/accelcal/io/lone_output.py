"""The one column that can only be the outputs, whatever it is called."""

from __future__ import annotations

from accelcal.arguments.kinds import shown
from accelcal.io.heading_rows import lone_output
from accelcal.io.layout import Layout
from accelcal.io.vocabulary import Heading


def with_lone_output(layout: Layout) -> Layout:
    r"""Take a column for the outputs, where no heading says so and only one can be.

    Parameters
    ----------
    layout : Layout
        The table.

    Returns
    -------
    Layout
        With the column that alone of the unknown ones has a unit of outputs, or else is called a
        current, a voltage, a frequency or a mean; and a note of it. The same where there are
        outputs, or no such column, or several.

    Examples
    --------
    >>> from accelcal.io.layout import read_layout
    >>> from accelcal.io.text import SourceText
    >>> text = "Temperatur;Stellung;Hub;Strom in mA;Raum\n20;1;1;1,35;7"
    >>> layout = read_layout(SourceText("a.csv", text, "utf-8", compressed=False))
    >>> [heading[1:3] for heading in with_lone_output(layout).headings[3:]]
    [('output', 'mA'), (None, None)]
    """
    found = lone_output(layout.headings)
    if found is None:
        return layout
    heading = layout.headings[found.place]
    taken = Heading(heading.text, "output", found.unit)
    note = f"column {shown(heading.text)} is taken for the outputs, by its {found.why}"
    headings = (*layout.headings[: found.place], taken, *layout.headings[found.place + 1 :])
    return layout._replace(headings=headings, notes=(*layout.notes, note))
