"""Small tables with headings of their own: a triad's attitudes, the certificate of a head."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import NamedTuple

from accelcal.errors import TableError
from accelcal.io.cells import Column
from accelcal.io.engines import columns_by_split
from accelcal.io.layout import Declared, Layout, split_line
from accelcal.io.text import SourceText, refuse_document
from accelcal.io.vocabulary import Heading, canonical_key, split_unit
from accelcal.io.wording import listed, shown

Recognise = Callable[[str], Heading]
"""Meaning of a heading; a role None for a column that is not used."""


class SmallTable(NamedTuple):
    """A table by what its columns hold.

    Attributes
    ----------
    source : str
        Name of the file.
    declared : mapping of str to Declared
        Header lines by canonical key, or by the key as written, in small letters.
    columns : mapping of str to Column
        Columns by role.
    headings_line : int
        Line of the headings.
    notes : tuple of str
        What was set aside.
    """

    source: str
    declared: Mapping[str, Declared]
    columns: Mapping[str, Column]
    headings_line: int
    notes: tuple[str, ...]

    def refuse(self, problem: str, remedy: str) -> TableError:
        """Make the error of the headings."""
        return TableError(problem, remedy, source=self.source, line=self.headings_line)


def small_table(
    given: SourceText, recognise: Recognise, needed: Sequence[str], remedy: str
) -> SmallTable:
    """Take a small table out of a text.

    Parameters
    ----------
    given : SourceText
        The text.
    recognise : callable
        What tells the meaning of a heading.
    needed : sequence of str
        Roles that must be there.
    remedy : str
        What the headings should be.

    Returns
    -------
    SmallTable
        Its columns.

    Raises
    ------
    TableError
        If there are no headings or rows, a column is missing or there twice, or a row is too long
        or too short.
    """
    refuse_document(given.text, given.name)
    layout = _layout(given.text.split("\n"), given.name, recognise, remedy)
    places = places_of(layout, needed, remedy)
    split = columns_by_split(layout, sorted(places.values()), 1 + max(places.values(), default=0))
    text = "".join(layout.rows)
    decimal = "," if layout.separator != "," and text.count(",") > text.count(".") else "."
    return SmallTable(
        source=layout.source,
        declared=layout.declared,
        columns={role: split[i]._replace(decimal=decimal) for role, i in places.items()},
        headings_line=layout.headings_line,
        notes=layout.notes,
    )


def places_of(
    layout: Layout, needed: Sequence[str], remedy: str, among: Collection[str] | None = None
) -> dict[str, int]:
    """Index of the column of each role.

    Parameters
    ----------
    layout : Layout
        The table.
    needed : sequence of str
        Roles that must be there.
    remedy : str
        What the headings should be.
    among : collection of str, optional
        Roles that count; all of them without it.

    Returns
    -------
    dict of str to int
        Role -> index.

    Raises
    ------
    TableError
        If one of them is missing, or a role is there twice.
    """
    found: dict[str, int] = {}
    for index, heading in enumerate(layout.headings):
        if heading.role in found:
            problem = f"two columns mean {heading.role}, the second is {shown(heading.text)}"
            raise layout.refuse(problem, "keep one and rename the other")
        if heading.role and (among is None or heading.role in among):
            found[heading.role] = index
    for role in needed:
        if role not in found:
            have = ", ".join(heading.text for heading in layout.headings)
            raise layout.refuse(f"no column {role} among {shown(have)}", remedy)
    return found


def _layout(lines: list[str], name: str, recognise: Recognise, remedy: str) -> Layout:
    declared: dict[str, Declared] = {}
    aside: list[int] = []
    table = []
    for number, line in enumerate(lines, 1):
        bare = line.strip(' \t,;"')
        if bare.startswith("#"):
            key, colon, value = bare.lstrip("# ").partition(":")
            if colon:
                own, unit = split_unit(key.strip())
                written = f"{value.strip()} {unit}".strip()
                declared[canonical_key(own) or own.casefold()] = Declared(written, number, name)
            else:
                aside.append(number)
        elif bare:
            table.append((number, line))
    if not table:
        problem = "header lines, but no table" if declared else "the file is empty"
        raise TableError(problem, remedy, source=name)
    start, text = table.pop(0)
    separator = max((mark for mark in "\t;,"), key=text.count)
    mark = separator if separator in text else None
    headings = tuple(recognise(cell) for cell in split_line(text.strip(), mark))
    if not any(heading.role for heading in headings):
        problem = f"no column headings in {shown(text.strip())}"
        raise TableError(problem, remedy, source=name, line=start)
    if not table:
        raise TableError("column headings but no rows", "add the rows", source=name, line=start)
    unused = [shown(heading.text) for heading in headings if not heading.role]
    notes = [f"column {text} is not known and was set aside" for text in unused]
    notes += [f"comments were set aside ({listed(aside)})"] if aside else []
    rows, numbers = [row for _, row in table], [number for number, _ in table]
    return Layout(name, declared, headings, start, mark, rows, numbers, tuple(notes))
