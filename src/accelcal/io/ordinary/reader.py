"""Ordinary tables, many at once: the long form with commas, decimal points and nothing missing.

Whatever is ordinary is read here as the general reader (`tables`) reads it, to the last bit.
Whatever is not, be it wrong or only rare, is left to the general reader, which has the words for
it. So nothing here refuses a table; the question is only who reads it.
"""

from __future__ import annotations

import gzip
import re
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache, lru_cache, partial
from hashlib import sha256
from typing import Any, NamedTuple

from accelcal.errors import InputError
from accelcal.frozen_mapping import FrozenMapping
from accelcal.io.columns import CONSTANTS
from accelcal.io.declarations import declarations, notes_of_serial
from accelcal.io.engines import BulkEngineGivesUp
from accelcal.io.files.text import SourceText
from accelcal.io.layout.header_lines import Declared, declare, notes_of_keys, table_key
from accelcal.io.layout.output_columns import Written, unit_of_outputs, units_written
from accelcal.io.layout.parts import read_layout
from accelcal.io.ordinary.cell_blocks import (
    CellBlock,
    cells_of_arrow,
    is_plain,
    parse_cells,
    read_engine,
)
from accelcal.io.ordinary.rows import Group, Plain, Rules, records_of
from accelcal.io.words.headings import Heading
from accelcal.io.words.vocabulary import KEYS, LABELS, TIME_UNITS, UNITS_OF, has_unit
from accelcal.record import TumbleRecord
from accelcal.units import canonical_unit, is_same_unit

_ORDINARY = frozenset(
    {"temperature", "position", "angle", "stroke", "output", "time", "std", "count"}
).union(LABELS.difference({"direction", "lot"}))
_NUMERIC = frozenset(KEYS).difference({"serial", "date"})
_OF_RECORD = frozenset(KEYS).difference({"delta0"})
_KEY = re.compile(r"# [A-Za-z][A-Za-z0-9_]*")
_HEAD = re.compile(rb"(?:#[^\n]*+\n)*+[^#\n][^\n]*+\n")
_SERIAL = "# serial: "
_ONE_VALUE = re.compile(r"[^;\t,]*")  # of a header line that holds no other declaration
_BOM = b"\xef\xbb\xbf"


class Content(NamedTuple):
    """A table, or a part of one, in memory."""

    name: str  # name of the file, for the records
    data: bytes
    # lines that are left out below the headings, where this is a part of the file; its SHA-256 is
    # then not known
    skipped: int | None = None
    file: bytes | None = None  # the file itself, where `data` holds its rows in another form


def read_ordinary(
    tables: Iterable[Content], overrides: Mapping[str, Any], engine: str | None = None
) -> list[tuple[TumbleRecord, ...] | None]:
    r"""Read the ordinary ones among some tables.

    Each is taken only when the one before has been looked at. Returns for each what `read_tables`
    does, or None where `read_tables` must read it. The engine is ``"pyarrow"`` or ``"pandas"``; by
    default pyarrow where it is installed.

    Examples
    --------
    >>> text = b"# unit: mA\ntemperature,position,stroke,output\n20,1,1,1.3\n20,4,1,-0.9\n"
    >>> read_ordinary([Content("a.csv", text), Content("b.csv", b"temperature;output")], {})
    [(<TumbleRecord 'a.csv': 2 readings, 1 run, 2 positions>,), None]
    """
    chosen = read_engine(engine)
    read: list[tuple[TumbleRecord, ...] | None] = []
    heads = _Heads(overrides)
    alike: dict[Rules, list[tuple[int, Plain]]] = {}
    for index, content in enumerate(tables):
        read.append(None)
        found = heads.plain(content)
        if found is not None:
            alike.setdefault(found[0], []).append((index, found[1]))
    for rules, members in alike.items():
        for part, cells in _parsed([plain for _, plain in members], rules.roles, chosen):
            records = records_of(Group(rules, [members[i][1] for i in part], cells))
            for i, own in zip(part, records, strict=True):
                read[members[i][0]] = own
    return read


def read_arrow(
    name: str, table: Any, skipped: int, overrides: Mapping[str, Any]
) -> tuple[TumbleRecord, ...] | None:
    """Read an ordinary Arrow table as `read_ordinary` reads the text of its rows.

    It is a part of a table with a row or more; `skipped` counts the rows of the file above it. None
    where the text of the rows must be read.
    """
    head = (",".join(table.column_names) + "\n").encode()
    found = _Heads(overrides).plain(Content(name, head + b"\n", skipped))
    if found is None:
        return None
    rules, plain = found
    try:
        cells = cells_of_arrow(table, rules.roles, LABELS)
    except BulkEngineGivesUp:
        return None
    return records_of(Group(rules, [plain._replace(rows=table.num_rows)], cells))[0]


def ordinary_head(data: bytes) -> tuple[bytes, tuple[str, ...]] | None:
    """Find the header lines and headings of an ordinary table.

    The data are the beginning of its file, with a row or more. Returns its first bytes to the end
    of the headings, and what the columns hold; None where they are out of the ordinary.
    """
    split = _split(data)
    understood = None if split is None else _Heads({}).understood(split[0])
    if split is None or understood is None:
        return None
    end = 0
    for _ in range(split[0].count("\n")):
        end = data.index(b"\n", end) + 1
    return data[:end], understood[0].rules.roles


def _parsed(
    tables: Sequence[Plain], roles: Sequence[str], engine: str
) -> Iterator[tuple[list[int], CellBlock]]:
    """Parse tables together; where that fails, without the odd ones, and then by halves."""
    waiting = [list(range(len(tables)))]
    while waiting:
        part = waiting.pop()
        body = b"".join([tables[i].body for i in part])
        try:
            cells = parse_cells(body, roles, LABELS, engine)
        except BulkEngineGivesUp:
            even = [i for i in part if is_plain(tables[i].body, roles, LABELS)]
            half = len(part) // 2
            smaller = [part[half:], part[:half]] if len(even) == len(part) > 1 else [even]
            waiting += [some for some in smaller if 0 < len(some) < len(part)]
        else:
            yield part, cells


class _Shared(NamedTuple):
    """What tables share: headings and numbers in header lines, or all of these but the serial."""

    rules: Rules
    fields: Mapping[str, Any]  # of the record
    metadata: Mapping[str, str]  # of the numbers: those in other words than the header line


class _Heads:
    """Header lines and headings; what comes again is read once."""

    def __init__(self, overrides: Mapping[str, Any]) -> None:
        self._serial = overrides.get("serial")
        self._numbers = cache(partial(_numbers, overrides=overrides))
        self._shared = cache(self._read)

    def plain(self, content: Content) -> tuple[Rules, Plain] | None:
        """Take a table apart; None where it is out of the ordinary."""
        split = _split(content.data)
        understood = None if split is None else self.understood(split[0])
        if split is None or understood is None:
            return None
        shared, declared = understood
        serial = self._serial or declared
        if serial is not None and "serial" in shared.rules.roles:
            return None  # two may be declared
        name, data, skipped, file = content
        own = {
            "serial": serial,
            "notes": (*shared.fields["notes"], *notes_of_serial(serial, declared)),
            "metadata": shared.metadata,
            "source": name,
            # of many files: OpenSSL, which `sha256_of` may do without, is worth its loading
            "sha256": sha256(file or data).hexdigest() if skipped is None else None,
        }
        head, body = split
        line = head.count("\n") + 1 + (skipped or 0)
        return shared.rules, Plain(body, body.count(b"\n"), line, shared.fields, own)

    def understood(self, head: str) -> tuple[_Shared, str | None] | None:
        """What the general reader makes of header lines and headings, and the serial in them."""
        before, found, after = head.partition(_SERIAL)
        serial, _, below = after.partition("\n")
        if not found or not (before or "\n").endswith("\n") or not _is_plain(serial):
            shared = self._shared(head)
            return None if shared is None else (shared, shared.fields["serial"])
        shared = self._shared(before + below)
        return None if shared is None or shared.fields["serial"] is not None else (shared, serial)

    def _read(self, head: str) -> _Shared | None:
        """Read all of a head; None where it is out of the ordinary."""
        *lines, heading, _ = head.split("\n")
        declared = dict(map(_declaration, lines))
        if "" in declared or len(declared) != len(lines):
            return None
        numeric = tuple([item for item in declared.items() if item[0] in _NUMERIC])
        numbers = self._numbers(heading, numeric)
        if numbers is None:
            return None
        own = {"serial": declared.get("serial"), "date": declared.get("date")}
        worded = {**declared, **numbers.metadata}
        # all tables with the same header lines share it, as nobody can change it
        metadata = FrozenMapping({key: worded[key] for key in declared if key not in _OF_RECORD})
        return numbers._replace(fields={**numbers.fields, **own}, metadata=metadata)


@lru_cache(maxsize=1000)
def _declaration(line: str) -> tuple[str, str]:
    """Key, in its canonical form where it has one, and value of a header line; odd: no key."""
    written, _, value = line.partition(": ")
    key = _key(written) if _is_plain(value) else ""
    taken: dict[str, Declared] = {}
    declare(taken, key, Declared(value, 0, ""))
    return "" if any(notes_of_keys(taken)) else key, value


def _is_plain(value: str) -> bool:
    if value == "" or not value.strip() == value == value.strip(",;"):
        return False
    return not (":" in value or "=" in value) or _ONE_VALUE.fullmatch(value) is not None


@lru_cache(maxsize=1000)
def _key(written: str) -> str:
    key = written[2:] if _KEY.fullmatch(written) else ""
    return table_key(key) or key


def _split(content: bytes) -> tuple[str, bytes] | None:
    """Header lines with the headings, and the rows; None where the bytes are not plain text."""
    if content.startswith(b"\x1f\x8b"):
        try:
            content = gzip.decompress(content)
        except (OSError, EOFError, zlib.error):
            return None
    content = content.removeprefix(_BOM)
    if b"\r" in content:
        content = content.replace(b"\r\n", b"\n")
    match = _HEAD.match(content)
    head, body = (match[0], content[match.end() :]) if match else (b"", b"")
    if not body or b"\r" in head or b"\0" in head:
        return None
    try:
        return head.decode("utf-8"), body if body.endswith(b"\n") else body + b"\n"
    except UnicodeDecodeError:
        return None


def _numbers(
    heading: str, numeric: Iterable[tuple[str, str]], overrides: Mapping[str, Any]
) -> _Shared | None:
    """Let the general reader read the headings and numbers of a head."""
    text = "".join(f"# {key}: {value}\n" for key, value in numeric) + heading + "\n1\n"
    try:
        layout = read_layout(SourceText("", text, "utf-8"))
        roles = _roles(layout.headings) if layout.separator == "," else None
        if roles is None or not {"runs", *CONSTANTS}.isdisjoint(layout.declared):
            return None
        written = {heading.role: heading.unit for heading in layout.headings}
        line, own = layout.headings_line, [written.get(role) for role in ("output", "std")]
        units = [*units_written(layout, ()), *(Written(unit, line) for unit in own if unit)]
        unit, notes = unit_of_outputs(units, overrides.get("unit"), "")
        declared = declarations(layout, ".", unit, overrides)
    except InputError:
        return None
    of_output = canonical_unit(written.get("output") or unit or "")
    if canonical_unit(written.get("std") or of_output) != of_output:
        return None
    factor = TIME_UNITS.get((written.get("time") or "s").casefold(), 1.0)
    rules = Rules(roles, declared.record["positions"], factor)
    return _Shared(rules, {**declared.record, "notes": notes}, declared.metadata)


def _roles(headings: Sequence[Heading]) -> tuple[str, ...] | None:
    """What the columns hold; None where one is not known, or one is missing."""
    roles = [heading.role or "" for heading in headings]
    whole = _ORDINARY.issuperset(roles) and len(set(roles)) == len(roles)
    needed = {"temperature", "stroke", "output"}.issubset(roles)
    if not (whole and needed) or {"position", "angle"}.isdisjoint(roles):
        return None
    return tuple(roles) if all(map(_has_its_unit, headings)) else None


def _has_its_unit(heading: Heading) -> bool:
    if heading.unit is None:
        return True
    role = heading.role or ""
    if role in ("temperature", "angle"):
        return is_same_unit(heading.unit, UNITS_OF[role][0])
    return has_unit(role, heading.unit) if role in UNITS_OF else role in ("output", "std")
