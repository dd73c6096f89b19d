"""Units of columns in a row of their own, below the headings or above them."""

from __future__ import annotations

from collections.abc import Sequence

from accelcal.io.words.headings import Heading, read_heading, split_unit
from accelcal.io.words.signs import MISSING
from accelcal.io.words.vocabulary import is_unit_of
from accelcal.units import is_same_unit

_NO_UNIT = MISSING | {"1"}
_WORDED = (None, "date", "time")  # columns whose units may be any words, such as hh:mm:ss
UNITS_ABOVE = "the units stand above the headings (line {})"
UNITS_BELOW = "the units stand below the headings (line {})"


def headings_with_units(
    headings: Sequence[Heading], row: Sequence[str]
) -> tuple[Heading, ...] | None:
    """Join headings and their units.

    None where the row, which is below or above them, holds something else.
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
    is_told = heading.unit is None or is_same_unit(heading.unit, cell)
    return is_told and is_unit_of(heading.role, cell)


def _may_be_unit(heading: Heading, cell: str) -> bool:
    told = heading.unit or split_unit(heading.text)[1]
    roles = [heading.role] if heading.role else ["temperature", "output"]
    is_other = told and any(is_unit_of(role, cell) and is_unit_of(role, told) for role in roles)
    is_other = is_other and not is_same_unit(told, cell)
    worded = heading.role in _WORDED and not (any(map(str.isdigit, cell)) or is_other)
    is_merged = cell == heading.text  # one cell over both rows
    return is_merged or worded or cell.casefold() in _NO_UNIT or _is_unit(heading, cell)


def _with_unit(heading: Heading, cell: str) -> Heading:
    text = f"{heading.text} [{cell}]"
    if heading.unit is None and _is_unit(heading, cell):
        return heading._replace(text=text, unit=cell)
    is_told = heading.role is None and cell.casefold() not in _NO_UNIT
    return read_heading(text) if is_told and not heading.unit else heading
