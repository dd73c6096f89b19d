"""Header lines ``# key: value``: what they declare, above a table of any kind."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

from accelcal.arguments.kinds import shown
from accelcal.errors import TableError
from accelcal.io.words.headings import name_and_unit, split_unit
from accelcal.io.words.vocabulary import KEYS, KINDS_OF, UNITS_OF, canonical_key, is_unit_of
from accelcal.units import UNITS, is_output_unit, size_of

KeyOf = Callable[[str], str | None]
"""Tells what a key without its unit declares; None where it is not known."""

PAIR = re.compile(r"((?:[^:=(\[]|[(\[][^)\]]*[)\]])+|[^:=]+)[:=](.*)")
"""Key and value with a sign between them."""
_ONE_CELL = re.compile(r"(?:[^,;\t(\[]|[(\[][^)\]]*[)\]])+|[^,;\t]+")
BEGINS_PAIR = re.compile(r"[^\W\d_][^:=]*(?:=|:(?![0-9])|(?<!\s[0-9])(?<!\s[0-9]{2}):)")
"""A key with its sign, which is not the colon of a time, as in ``at 12:30``."""
_COMMENT = re.compile(r"#|%[\s%\w]")  # % alone is a unit
_NUMBER = re.compile(r"[+-]?[.,]?[0-9]")
_WITHOUT_UNIT = frozenset(KEYS).difference(KINDS_OF, ("resolution", "std", "clamping"))
_SHORTEST = 6  # letters of a key below which one that is nearly alike means something else
_ALIKE = 0.85  # least likeness of two keys, of difflib; one wrong letter of seven
_OF_VOLTMETER = re.compile(r"\bbits?$|(?:½|[.,]5|1/2)\W*(?:digits?|stell\w*)$", re.IGNORECASE)
_IN_BITS = "resolution_in_bits"
_UNCERTAINTY = re.compile(
    "uncertaint|unsicherheit|incertitude|неопредел|incertidumbre|incertezz?a"
    "|niepewno|nejistot|onzekerheid"
)
_UNCERTAINTIES = [key for key in KEYS if key.endswith("uncertainty")]
_NAMES = [name for names in KEYS.values() for name in names if len(name) >= _SHORTEST]


TESTED = re.compile(
    r"(?:acc[ée]l[ée]rom[eè]t\w+|beschleunigungs(?:messer|aufnehmer|sensor|geber)s?|акселерометр\w*"
    r"|[du]ut|(?:device|unit|equipment|instrument) under test|test item"
    r"|prüflings?|изделие|加速度计|被测件)"
    r"(?:[ -](?:under test|type?|mod[eè]le?|modell|тип))?",
    re.IGNORECASE,
)
"""A name of the accelerometer, or of its type."""


def table_key(text: str) -> str | None:
    """Name of what a key of a table declares; ``DUT S/N`` is the serial number as well.

    Examples
    --------
    >>> table_key("Accelerometer S/N"), table_key("DMM S/N"), table_key("T0")
    ('serial', None, 'reference_temperature')
    """
    key = canonical_key(text)
    places = [at for at, sign in enumerate(text) if sign in " _"] if key is None else []
    pairs = [(text[:at], text[at + 1 :]) for at in places]
    pairs += [pair[::-1] for pair in pairs]
    own = any(TESTED.fullmatch(name) and canonical_key(rest) == "serial" for name, rest in pairs)
    return "serial" if own else key


class Declared(NamedTuple):
    """Value of a header line ``# key: value``, and its place; of line 0 is what a caller gave."""

    value: str
    line: int
    source: str

    def refuse(self, problem: str, remedy: str) -> TableError:
        """Make the error of the header line."""
        return TableError(problem, remedy, source=self.source, line=self.line or None)


def declare(declared: dict[str, Declared], key: str, new: Declared) -> None:
    """Take up a header line; one that says something else than the one before is refused.

    A resolution in bits, or in halves of digits, is that of a voltmeter, and not a step of outputs.
    """
    if key == "resolution" and _OF_VOLTMETER.search(new.value):
        key = _IN_BITS
    old = declared.setdefault(key, new)
    if old.value != new.value:
        problem = f"{key} is {shown(new.value)}, but {shown(old.value)} in line {old.line}"
        other = "; that of an instrument is called by its name, as DMM S/N"
        raise new.refuse(problem, f"declare each key once{other if key == 'serial' else ''}")


def keys_and_values(line: str, key_of: KeyOf = table_key) -> list[tuple[str, str]] | None:
    """Take what a header line declares.

    The pairs are those of `header_line`, with an empty key for a text that declares nothing; None
    where the line has no ``#``. There are none in a line ``sep=;``, as Excel tells the separator.

    Examples
    --------
    >>> keys_and_values('"# serial: X1; T0, degC: 20";;'), keys_and_values("20;1;1.35")
    ([('serial', 'X1'), ('reference_temperature', '20 degC')], None)
    """
    text = uncommented(line)
    if text is None:
        return [] if unquoted(line).casefold().startswith("sep=") else None
    parts = declarations_in(text, key_of) if text else []
    pairs = [(part, header_line(part, key_of)) for part in parts]
    return [pair if pair[0] else ("", part) for part, pair in pairs]


def header_line(text: str, key_of: KeyOf = table_key) -> tuple[str, str]:
    """Split a header line into its key and value.

    The key is what `key_of` tells, else as written, and empty where the line is no declaration. The
    value has the unit of a known key behind it.

    Examples
    --------
    >>> header_line("T0 in degC: 20"), header_line("Operator = Mia"), header_line("made by hand")
    (('reference_temperature', '20 degC'), ('Operator', 'Mia'), ('', ''))
    """
    match = PAIR.fullmatch(text)
    if match is None:
        return "", ""
    written, value = (part.strip() for part in match.groups())
    known, unit = key_and_unit(written, key_of)
    if known == "serial" and unit:  # of what
        return (known if TESTED.fullmatch(unit) else written), value
    if known:
        return known, f"{value} {unit}".strip()
    return (written, value) if _ONE_CELL.fullmatch(written) else ("", "")


def refuse_declaration(text: str, source: str, line: int) -> None:
    """Refuse a text among the rows, or below them, that declares something."""
    if header_line(text)[0] in KEYS:
        problem = f"header line {shown(text)} inside the table"
        remedy = "write it above the headings; one table a file, or a column serial"
        raise TableError(problem, remedy, source=source, line=line)


def key_and_unit(text: str, key_of: KeyOf = table_key) -> tuple[str, str]:
    """Split a key from its unit, in brackets or behind a comma, a slash or ``in``.

    Each is empty where there is none.

    Examples
    --------
    >>> key_and_unit("T0 [degC]"), key_and_unit("Temperature, °C"), key_and_unit("Run in h")
    (('reference_temperature', 'degC'), ('temperature', '°C'), ('', ''))
    """
    if known := key_of(text):
        return known, ""
    name, unit = name_and_unit(text, is_any_unit, behind_blanks=False)
    key = key_of(name) or ""
    in_brackets = split_unit(text)[1] == unit
    return (key, unit) if in_brackets or key not in _WITHOUT_UNIT else ("", "")


def is_any_unit(text: str) -> bool:
    """Tell whether a text is a unit of outputs or of what can be declared, right or wrong."""
    if is_output_unit(text) or size_of(text, *UNITS) is not None:
        return True
    return text.casefold() in ("bit", "bits") or any(is_unit_of(own, text) for own in UNITS_OF)


def declarations_in(text: str, key_of: KeyOf = table_key) -> list[str]:
    """Take the declarations of a header line apart, as of ``serial=X1; unit=mA``.

    The line stays as it is where it holds one, whose value may have such signs.

    Examples
    --------
    >>> declarations_in("serial=X1; made: 1980"), declarations_in("note: warm; unit: by eye")
    (['serial=X1', 'made: 1980'], ['note: warm; unit: by eye'])
    """
    for mark in "\t;,":
        parts = [part.strip() for part in text.split(mark)] if mark in text else []
        are_pairs = parts and all(map(BEGINS_PAIR.match, parts))
        if are_pairs and key_of(header_line(parts[0], key_of)[0]):
            return [own for part in parts for own in declarations_in(part, key_of)]
    return [text]


def unquoted(line: str) -> str:
    """Take blank fields off a line, and the quotes in which Excel saves one with a comma.

    A quote at its end alone is kept, as it is the unit of seconds of arc.

    Examples
    --------
    >>> unquoted('"# comment: first, second";;'), unquoted('# head_uncertainty: 2"')
    ('# comment: first, second', '# head_uncertainty: 2"')
    """
    bare = line.strip(" \t,;|")
    if bare.startswith('"') and bare.endswith('"'):
        bare = bare[1:-1].replace('""', '"')
    return bare


def uncommented(line: str) -> str | None:
    """Text of a line that begins with ``#``, or ``%`` as of MATLAB, None for any other line."""
    bare = unquoted(line)
    return bare.lstrip("#%").strip() if _COMMENT.match(bare) else None


def notes_of_keys(declared: Mapping[str, Declared]) -> Iterator[str]:
    """Say which header lines are kept as metadata, but may be meant to declare something.

    They nearly have a key that does, or tell an uncertainty.

    Examples
    --------
    >>> list(notes_of_keys({"head_uncertainity": Declared("2e-5", 3, "a.csv")}))
    ["header line 'head_uncertainity' declares nothing: the key may be meant as head_uncertainty"]
    """
    if _IN_BITS in declared:
        in_bits = declared[_IN_BITS].value
        yield f"a resolution of {in_bits} is no step of the output and was set aside"
    for key, written in declared.items():
        if key in KEYS or not _NUMBER.match(written.value):
            continue
        from difflib import get_close_matches  # few files have such a key

        folded = re.sub(r"[\W_]+", "_", key).strip("_").casefold()
        near = get_close_matches(folded, _NAMES, n=2, cutoff=_ALIKE)
        if near or _UNCERTAINTY.search(folded):
            meant = f"the key may be meant as {' or '.join(near or _UNCERTAINTIES)}"
            yield f"header line {key!r} declares nothing: {meant}"
