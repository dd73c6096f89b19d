"""The column of units of a stream: one unit for all samples, known before the first of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from accelcal.arrays import Ints
from accelcal.io.layout.output_unit import Written, names_unit
from accelcal.io.layout.separators import split_line
from accelcal.io.values.cells import Column
from accelcal.units import canonical_unit

_MOST_ROWS = 1000
"""Rows that are looked through for the first unit."""

_REMEDY = "write all outputs in one unit, or samples that differ into a file of their own"


def first_unit(
    row: str, line: int, readline: Callable[[], str], place: int, separator: str | None
) -> tuple[Written | None, str]:
    """Look for the unit that a column of units has first.

    The first row may be read already, and `place` is the index of the column. Returns the rows that
    were read as well; no unit where none of them has one.
    """
    rows = [row or readline()]
    while rows[-1] and len(rows) <= _MOST_ROWS:
        unit = _cell(rows[-1], separator, place)
        if names_unit(unit):
            return Written(unit, line + len(rows) - 1), "".join(rows)
        rows.append(readline())
    return None, "".join(rows)


def refuse_other_units(cells: Sequence[str], lines: Ints, unit: str | None, source: str) -> None:
    """Refuse samples that a column of units gives another unit than the others."""
    others = {cell for cell in {*cells} if names_unit(cell) and canonical_unit(cell) != unit}
    if others:
        at = next(i for i, cell in enumerate(cells) if cell in others)
        above = f"after samples in {unit}" if unit else "after samples without one"
        column = Column("unit", "unit", None, cells, lines, source)
        raise column.refuse(at, f"{{}} {above}", _REMEDY)


def _cell(row: str, separator: str | None, place: int) -> str:
    bare = row.rstrip("\r\n")
    cells = [] if bare.lstrip(' \t"').startswith("#") else split_line(bare, separator)
    return cells[place] if place < len(cells) else ""
