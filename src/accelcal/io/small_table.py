"""Small tables with headings of their own: a triad's attitudes, the certificate of a head."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from accelcal.arguments.kinds import shown
from accelcal.errors import TableError
from accelcal.io.columns import notes_of_unused, places_of
from accelcal.io.engines import columns_by_split, decimal_mark
from accelcal.io.files.text import SourceText, refuse_document
from accelcal.io.layout.header_lines import Declared, KeyOf, declare, keys_and_values, unquoted
from accelcal.io.layout.parts import Layout
from accelcal.io.layout.separators import Line, Recognise, split_headings
from accelcal.io.values.cells import Column
from accelcal.io.words.vocabulary import canonical_key
from accelcal.plural import lines_named


class SmallTable(NamedTuple):
    """A table by what its columns hold."""

    layout: Layout  # header lines, headings and rows
    columns: Mapping[str, Column]  # columns by role


def small_table(
    given: SourceText,
    recognise: Recognise,
    needed: Sequence[str],
    remedy: str,
    key_of: KeyOf = canonical_key,
) -> SmallTable:
    """Take a small table out of a text.

    `recognise` tells the meaning of a heading, and `key_of` that of a key; roles that are needed
    must be there. The remedy tells what the headings should be. Raises TableError if there are no
    headings or rows, a column is missing or there twice, a key is declared twice with different
    values, or a row is too long or too short.
    """
    refuse_document(given.text, given.name)
    declared, aside, table = _header_lines(given, key_of)
    if not table:
        problem = "header lines, but no table" if given.text.strip() else "the file is empty"
        raise TableError(problem, remedy, source=given.name)
    told = [f"comments were set aside ({lines_named(aside)})"] if aside else []
    layout = _with_headings(table, given.name, recognise, remedy)
    layout = layout._replace(declared=declared).noting(*told)
    places = places_of(layout, needed, remedy)
    split = columns_by_split(layout, sorted(places.values()), 1 + max(places.values(), default=0))
    cells = [str(cell) for column in split.values() for cell in column.cells]
    decimal = decimal_mark(" ".join(cells), layout.separator)
    return SmallTable(layout, {r: split[i]._replace(decimal=decimal) for r, i in places.items()})


def _header_lines(
    given: SourceText, key_of: KeyOf
) -> tuple[dict[str, Declared], list[int], list[Line]]:
    """What is declared, the lines of comments, and the lines of the table with their numbers."""
    declared: dict[str, Declared] = {}
    aside: list[int] = []
    table: list[Line] = []
    for number, line in enumerate(given.text.split("\n"), 1):
        pairs = keys_and_values(line, key_of)
        if pairs is None and unquoted(line):
            table.append((number, line))
        for key, value in pairs or ():
            if key_of(key):
                declare(declared, key, Declared(value, number, given.name))
            elif not key:
                aside.append(number)
    return declared, aside, table


def _with_headings(table: list[Line], name: str, recognise: Recognise, remedy: str) -> Layout:
    (start, text), *rows = table
    headings, separator = split_headings(text.strip(), recognise)
    written, lines = [row for _, row in rows], [line for line, _ in rows]
    layout = Layout(name, {}, headings, start, separator, written, lines, ())
    known = {heading.role for heading in headings if heading.role}
    if not known:
        raise layout.refuse(f"no column headings in {shown(text.strip())}", remedy)
    if not rows:
        raise layout.refuse("column headings but no rows", "add the rows")
    return layout.noting(*notes_of_unused(layout, known))
