"""Wide tables that lie on their side: a row for each stroke, called so, below the positions."""

from __future__ import annotations

from collections.abc import Sequence

from accelcal.io.files.csv_text import in_quotes
from accelcal.io.layout.parts import Layout, split_line
from accelcal.io.words.vocabulary import Heading, read_heading

_SIDE = ("position", "angle")


def with_strokes_in_rows(layout: Layout) -> Layout:
    r"""Take the first cells of the rows for strokes, where they or the angles are called so.

    Examples
    --------
    >>> from accelcal.io.layout.parts import read_layout
    >>> from accelcal.io.files.text import SourceText
    >>> text = "Position;1;2;3\nStroke 1;1,35;0,95;0,01\nStroke 2;1,36;0,96;0,01\n"
    >>> layout = with_strokes_in_rows(read_layout(SourceText("a.csv", text, "utf-8")))
    >>> [heading.text for heading in layout.headings], layout.rows[1]
    (['stroke', '1', '2', '3'], '"2";"1,36";"0,96";"0,01"')
    """
    side, *others = layout.headings
    mark = layout.separator
    if side.role not in _SIDE or not others or mark is None:
        return layout
    across = [_across(side.role, heading) for heading in others]
    first = read_heading(split_line(layout.rows[0], mark)[0])
    named = not first.text[:1].isdigit() or all(own.role == "angles" for own in others)
    if first.role != "strokes" or not named or None in across:
        return layout
    table = [split_line(row, mark) for row in layout.rows]
    strokes = [_stroke(row) for row in table]
    if None in strokes:
        return layout
    rows = zip(strokes, table, strict=True)
    return layout._replace(
        headings=(Heading("stroke", "stroke"), *filter(None, across)),
        rows=[mark.join(map(in_quotes, [str(own), *row[1:]])) for own, row in rows],
    )


def _across(side: str, heading: Heading) -> Heading | None:
    """Heading of a column by its number, or None where it is something else."""
    if side == "position":
        return heading if heading.role == "strokes" and heading.text[:1].isdigit() else None
    angle = read_heading(f"{heading.text.rstrip('°')} deg")
    return angle._replace(text=heading.text) if angle.role == "angles" else None


def _stroke(row: Sequence[str]) -> float | str | None:
    heading = read_heading(row[0])
    return heading.of if heading.role == "strokes" else None
