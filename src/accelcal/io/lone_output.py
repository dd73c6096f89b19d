"""The one column that can only be the outputs, whatever it is called."""

from __future__ import annotations

import re

from accelcal.arguments.kinds import shown
from accelcal.io.layout import Layout
from accelcal.io.vocabulary import ACROSS, Heading
from accelcal.units import is_output_unit

_MEASURED = frozenset(
    {
        *("current", "voltage", "frequency", "mean", "average"),
        *("strom", "spannung", "frequenz", "mittelwert"),
        *("courant", "tension", "fréquence", "moyenne"),
        *("ток", "напряжение", "частота", "среднее"),
    }
)
"""What is measured, or how: of one such column without a unit the readings are."""

_UNIT = re.compile(r"\D*?[\s\[(,/_]+(?:in\s+)?([^\s\[\](),_]+)\s*[\])]?")
"""A name without a digit, which that of one accelerometer of several may have, and a unit."""


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
    if any(heading.role in ("output", *ACROSS) for heading in layout.headings):
        return layout
    unknown = [i for i, heading in enumerate(layout.headings) if heading.role is None]
    by_unit = [i for i in unknown if _unit_of(layout.headings[i])]
    by_name = [i for i in unknown if layout.headings[i].text.strip().casefold() in _MEASURED]
    for found, why in ((by_unit, "unit"), (by_name, "name")):
        if len(found) == 1:
            return _taken(layout, found[0], why)
        if found:
            break
    return layout


def _unit_of(heading: Heading) -> str | None:
    found = _UNIT.fullmatch(heading.text)
    return found[1] if found and is_output_unit(found[1]) else None


def _taken(layout: Layout, place: int, why: str) -> Layout:
    heading = layout.headings[place]
    taken = Heading(heading.text, "output", _unit_of(heading))
    note = f"column {shown(heading.text)} is taken for the outputs, by its {why}"
    headings = (*layout.headings[:place], taken, *layout.headings[place + 1 :])
    return layout._replace(headings=headings, notes=(*layout.notes, note))
