"""What a sheet without a table tells of the test, such as its serial, date or operator."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set

from accelcal.arguments.kinds import shown
from accelcal.errors import TableError
from accelcal.io.files.text import SourceText
from accelcal.io.layout.header_lines import TESTED, Declared, is_any_unit
from accelcal.io.layout.rows_above import (
    INSTRUMENT,
    MODEL,
    SIGNS,
    declarations_above,
    label,
    names_instrument,
    note_of_instrument,
)
from accelcal.io.words.vocabulary import COLUMNS, KEYS, is_missing
from accelcal.plural import listed

_OF_THE_TEST = {*KEYS}.difference(COLUMNS, ("runs", "serials")) | {"serial", "unit", "date"}
"""Keys that are not of single rows or columns of the table."""

_MOST_LINES = 200
_LONGEST = 40  # letters of a name; what is longer is a sentence


def with_facts(
    declared: Mapping[str, Declared], source: SourceText, roles: Set[str | None]
) -> tuple[dict[str, Declared], list[str]]:
    """Add what the sheets beside a table tell, with notes of doubts; facts of its own win.

    Words with a meaning are found as in a form above the headings; of other rows those count that
    have two cells, name and value. A sheet that tells something in two ways counts for nothing,
    and so does what two sheets tell otherwise. The serial is that of the only table: of several
    each may be a unit.
    """
    own: dict[str, Declared] = {}
    notes: list[str] = []
    known = {*declared, *roles}
    is_one_of_several = source.name.endswith(f"#{source.sheet}")
    unused = is_one_of_several and not known & {"serial", "serials"}
    if "serials" in known or is_one_of_several:
        known.add("serial")
    for sheet in source.beside:
        try:
            told, doubts = _facts(sheet)
        except TableError as error:
            why = f"{error.problem}; {error.remedy}"
            notes.append(f"facts of the sheet {shown(sheet.sheet)} were set aside: {why}")
            continue
        facts = {key: fact for key, fact in told.items() if key not in known}
        if unused and "serial" in told:
            notes.append(_unused_serial(told["serial"].value, sheet.sheet))
        if "serial" not in known:
            notes += [f"sheet {shown(sheet.sheet)}: {doubt}" for doubt in doubts]
        for key, fact in facts.items():
            if own.setdefault(key, fact).value != fact.value and key in KEYS:
                notes.append(_otherwise(key, own[key], fact))
                known.add(key)
    return {**declared} | {key: fact for key, fact in own.items() if key not in known}, notes


def notes_of_facts(beside: Sequence[SourceText], declared: Mapping[str, Declared]) -> Iterator[str]:
    """Say which of the facts that are used the sheets beside a table tell."""
    for sheet in beside:
        if facts := [key for key, own in declared.items() if own.source == sheet.name]:
            yield f"{listed(facts)}: told by the sheet {shown(sheet.sheet)}"


def _unused_serial(serial: str, sheet: str) -> str:
    return (
        f"serial {shown(serial)} of the sheet {shown(sheet)} is not taken for that of the tables,"
        " each of which may be of another unit; --serial gives one to all"
    )


def _otherwise(key: str, one: Declared, other: Declared) -> str:
    """Note of two sheets that tell a fact otherwise."""
    told = f"{shown(one.value)} in {one.source}, but {shown(other.value)} in {other.source}"
    return f"{key} is {told}: neither is used; write it above the table"


def _facts(sheet: SourceText) -> tuple[dict[str, Declared], list[str]]:
    """Facts of a sheet, and what is to be told of its serial."""
    lines = enumerate(sheet.text.split("\n")[:_MOST_LINES], 1)
    filled = [(number, line) for number, line in lines if _is_fact(_cells(line))]
    told, notes = declarations_above(filled, sheet.name, "\t", ())
    own = {key: fact for key, fact in told.items() if key in _OF_THE_TEST or key not in KEYS}
    facts = {**dict(_named(filled, sheet.name)), **own}
    kept = {key: fact for key, fact in facts.items() if _is_told(key, fact.value)}
    if "serial" in kept and _is_of_instrument(kept["serial"].line, dict(filled), sheet.sheet):
        notes = [note_of_instrument(kept.pop("serial").value)]
    elif "serial" in facts and "serial" not in kept:
        notes = []
    return kept, [note for note in notes if note.startswith("serial")]


def _is_of_instrument(line: int, rows: Mapping[int, str], sheet: str) -> bool:
    """Whether a serial may be that of an instrument.

    The name of the sheet says so, a row of its block above it that is no key, or the one below, as
    its model.
    """
    below = rows.get(line + 1, "").strip()
    near = [below] if MODEL.match(below) else []
    while line in rows:
        if TESTED.search(rows[line]):
            return False
        cells = _cells(rows[line])
        near += [] if label(cells[0])[0] else [" ".join(cells)]
        line -= 1
    return bool(INSTRUMENT.search(sheet)) or any(map(names_instrument, near))


def _is_fact(cells: list[str]) -> bool:
    """Whether a row may tell a name and its value, perhaps with a unit; a list of more does not."""
    return 0 < len(cells) < 3 or (len(cells) == 3 and is_any_unit(cells[2]))


def _is_told(key: str, value: str) -> bool:
    """Whether a value tells something; a serial without a digit is rather the head of a list."""
    return not is_missing(value) and (key != "serial" or any(map(str.isdecimal, value)))


def _named(lines: list[tuple[int, str]], source: str) -> Iterator[tuple[str, Declared]]:
    """Rows of a name, which is no key, and its value."""
    for number, line in lines:
        cells = _cells(line)
        if len(cells) == 2 and cells[0][0].isalpha() and len(cells[0]) <= _LONGEST:
            name = cells[0].rstrip(" :=")
            if not label(name)[0]:
                yield name, Declared(cells[1], number, source)


def _cells(line: str) -> list[str]:
    return [cell for cell in map(str.strip, line.split("\t")) if cell not in ("", *SIGNS)]
