"""Which rows hold the headings of a table."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest

from accelcal.io.vocabulary import ACROSS, Heading, is_unit_of, read_heading

_CORE = {"temperature", "position", "angle", "stroke", "output"}
_NONE = read_heading("")


def are_headings(cells: Sequence[Heading]) -> bool:
    """Tell whether a row holds headings.

    Examples
    --------
    >>> are_headings([read_heading(cell) for cell in ("T", "k", "1", "2")])
    True
    >>> are_headings([read_heading(cell) for cell in ("temperature", "20")])
    False
    """
    roles = {cell.role for cell in cells if cell.role and cell.role != "date"}
    numbered = [cell for cell in cells if cell.role in ACROSS]
    if len(numbered) > 2 and all(cell.text[0].isalpha() for cell in numbered):
        return True  # "Pos. 1, Pos. 2, Pos. 3" alone, all else declared above or missing
    if len(numbered) == 1 and not numbered[0].text[0].isalpha():
        roles.difference_update(ACROSS)  # "temperature; 20" is no row of headings
    roles -= {role for role, name in ACROSS.items() if name in roles and name != "stroke"}
    return len(roles) >= 2 and bool(roles & _CORE)


def numbers_alone(cells: Sequence[Heading]) -> bool:
    """Tell whether headings number outputs and say nothing else, as a row above others may."""
    return all(cell.role in ACROSS or not cell.text for cell in cells)


def joined(top: Sequence[Heading], own: Sequence[Heading]) -> tuple[Heading, ...]:
    """Headings in two rows: the upper one numbers the outputs where the lower one does not.

    Examples
    --------
    >>> top, own = (",,Pos. 1,Pos. 2".split(","), "T,k,Y [mA],Y [mA]".split(","))
    >>> [cell.text for cell in joined([*map(read_heading, top)], [*map(read_heading, own)])]
    ['T', 'k', 'Pos. 1 [mA]', 'Pos. 2 [mA]']
    """
    outputs = [cell.role for cell in own if cell.role in ("output", *ACROSS)]
    if len(outputs) == 1 or not {*outputs} <= {"output"}:
        return tuple(own)
    return tuple(_numbered(*pair) for pair in zip_longest(top, own, fillvalue=_NONE))


def _numbered(above: Heading, cell: Heading) -> Heading:
    """A heading that says no more than that an output is below, by its number above."""
    bare = cell.text.strip("[] ()")
    unit = bare if cell.role is None and is_unit_of("output", bare) else cell.unit
    if not above.role or not (cell.role == "output" or bare in ("", unit)):
        return cell
    if unit and above.unit:
        return above if unit == above.unit else cell  # which contradict each other
    return read_heading(f"{above.text} [{unit}]") if unit else above
