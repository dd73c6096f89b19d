"""What a sheet without a table tells of the test, such as its serial, date or operator."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Set

from accelcal.arguments.kinds import shown
from accelcal.errors import TableError
from accelcal.io.files.text import SourceText
from accelcal.io.layout.header_lines import Declared
from accelcal.io.layout.rows_above import declarations_above, label
from accelcal.io.words.vocabulary import COLUMNS, KEYS

_OF_THE_TEST = {*KEYS}.difference(COLUMNS, ("runs", "serials")) | {"serial", "unit", "date"}
"""Keys that are not of single rows or columns of the table."""

_MOST_LINES = 200
_LONGEST = 40  # letters of a name; what is longer is a sentence


def with_facts(
    declared: Mapping[str, Declared], source: SourceText, roles: Set[str | None]
) -> tuple[dict[str, Declared], list[str]]:
    r"""Add the facts that the sheets beside a table tell, with notes; those of its own win.

    Words with a meaning are found as in a form above the headings; of other rows those count that
    have two cells, name and value. A sheet that tells something twice counts for nothing. The
    serial is that of the only table: of several each may be a unit.

    Examples
    --------
    >>> info = SourceText("a.xlsx#Info", "Serial\tA-7\nOperator\tMia\n", "workbook", sheet="Info")
    >>> found, notes = with_facts({}, SourceText("a.xlsx", "", "workbook", beside=(info,)), set())
    >>> found["serial"].value, found["Operator"].value, notes
    ('A-7', 'Mia', ["Operator, serial: told by the sheet 'Info'"])
    """
    found, notes = dict(declared), []
    known = {*declared, *roles}
    if "serials" in known or source.name.endswith(f"#{source.sheet}"):  # one of several tables
        known.add("serial")
    for sheet in source.beside:
        try:
            told, doubts = _facts(sheet)
        except TableError as error:
            notes.append(f"facts of the sheet {shown(sheet.sheet)} were set aside: {error.problem}")
            continue
        facts = {key: own for key, own in told.items() if key not in known}
        if facts:
            notes.append(f"{', '.join(facts)}: told by the sheet {shown(sheet.sheet)}")
        if "serial" not in known:
            notes += [f"sheet {shown(sheet.sheet)}: {doubt}" for doubt in doubts]
        known |= facts.keys()
        found |= facts
    return found, notes


def _facts(sheet: SourceText) -> tuple[dict[str, Declared], list[str]]:
    """Facts of a sheet, and what is to be told of its serial."""
    lines = enumerate(sheet.text.split("\n")[:_MOST_LINES], 1)
    filled = [(number, line) for number, line in lines if line.strip()]
    told, notes = declarations_above(filled, sheet.name, "\t", ())
    own = {key: fact for key, fact in told.items() if key in _OF_THE_TEST or key not in KEYS}
    doubts = [note for note in notes if note.startswith("serial")]
    return {**dict(_named(filled, sheet.name)), **own}, doubts


def _named(lines: list[tuple[int, str]], source: str) -> Iterator[tuple[str, Declared]]:
    """Rows of a name, which is no key, and its value."""
    for number, line in lines:
        cells = [cell.strip() for cell in line.split("\t") if cell.strip()]
        if len(cells) == 2 and cells[0][0].isalpha() and len(cells[0]) <= _LONGEST:
            name = cells[0].rstrip(" :=")
            if not label(name)[0]:
                yield name, Declared(cells[1], number, source)
