"""Headings of columns: what they mean, by the words of tables, and their units."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

from accelcal.arguments.axes import AXES, axis_named
from accelcal.io.words.vocabulary import (
    BACK,
    COLUMNS,
    FORWARD,
    LONGEST,
    has_unit,
    is_unit_of,
    plain_name,
    with_hyphen,
)
from accelcal.units import degrees_in, is_same_unit

_ROLES = {name: role for role, names in COLUMNS.items() for name in names}
_BRACKET = re.compile(r"(.*?)\s*[\[(（]\s*([^\])）]*?)\s*[\])）]")
_BEFORE_UNIT = re.compile(r"\s*[/,]\s*|\s(?:in|en|в)\s+|((?:[_ ](?:in|en|в))?[_ ])")
"""What stands between a name and its unit; a blank alone in the group."""
_NEXT_WORD = re.compile(r"(?<=[a-z]{2})(?=[A-Z][a-z])")  # of names in a program, as StrokeNo
_NUMBER_BEHIND = r"(?:(?:no|nr|№|n°)_)?([0-9]{1,6})"
_STROKES = (
    re.compile(rf"(?:y|output|reading|{'|'.join(COLUMNS['stroke'])})?[_=]?{_NUMBER_BEHIND}"),
    re.compile(r"y_?\{?j,?([0-9]{1,6})\}?(?:\^\{?t\}?)?"),  # Y_JK^T, as the paper has it
)
_POSITIONS = re.compile(rf"(?:p|{'|'.join(COLUMNS['position'])})_?{_NUMBER_BEHIND}")
_SERIAL = re.compile(  # and a label with a digit, which a serial port does not have
    r"(?:(?:output|y)[ _])?(?:s/?n|serial(?:[ _](?:no|nr|number))?)(?:[ _.:#]+|(?=[0-9]))"
    r"([^\s,;]*[0-9][^\s,;]*)",
    re.IGNORECASE,
)
_MEASURED = re.compile(r"(T *= *)?([-\u2212\u2013]?[0-9]+(?:[.,][0-9]+)?) *(.*)")
_OTHERWISE = re.compile(r"[0-9]{1,2} *K|[^°]*[0-9] *F", re.IGNORECASE)
"""A number with a letter that may be of a stroke, or of the direction forward."""
_CORNERS = (("position", "stroke"), ("angle", "stroke"), ("stroke", "position"))
_COUNTED = re.compile(
    r"(?:no|nr|№|n°|номер|numéro|número|numero)_(?:d[ei]_)?(?P<behind>.+)|(?P<before>.+)_(?:no|nr|№|n°|number|#)"
)


class Heading(NamedTuple):
    """Meaning of a column heading."""

    text: str  # as written
    # one of `COLUMNS`, one of `ACROSS` for an output of a wide table, None if unknown
    role: str | None
    unit: str | None = None  # unit given in the heading, as written
    # stroke, direction, position, angle [deg], temperature [degC; else a text with its unit] or
    # serial of an output of a wide table
    of: float | str | None = None


def read_heading(text: str) -> Heading:
    """Understand a column heading.

    Examples
    --------
    >>> read_heading("Output_mA")[1:3], read_heading("T")[1], read_heading("t [s]")[1]
    (('output', 'mA'), 'temperature', 'time')
    >>> read_heading("Y3")[3], read_heading("45 deg")[1:], read_heading("position (deg)").role
    (3, ('angles', None, 45.0), 'angle')
    >>> read_heading("S/N A-0123 [mA]")[1:]
    ('serials', 'mA', 'A-0123')
    """
    text = " ".join(text.split())
    if len(text) > LONGEST:
        return Heading(text, None)
    name, unit = split_unit(text)
    known = _known(text, name, unit or None)
    if name != text or known.role not in (None, "serials"):
        return known
    behind = (_known(text, *pair) for pair in _with_units_behind(text))
    return next((own for own in behind if own.role and is_unit_of(own.role, own.unit or "")), known)


def split_unit(key: str) -> tuple[str, str]:
    """Split a header key such as ``T0 [degC]`` into its name and unit.

    The unit is empty where there is none.

    Examples
    --------
    >>> split_unit("T0 [degC]"), split_unit("date")
    (('T0', 'degC'), ('date', ''))
    """
    match = _BRACKET.fullmatch(key) if len(key) <= LONGEST else None
    return (match[1], match[2]) if match else (key, "")


def name_and_unit(
    text: str, is_unit: Callable[[str], bool], *, behind_blanks: bool = True
) -> tuple[str, str]:
    """Split a name from its unit, in brackets or behind a comma, a slash, ``in`` or a blank.

    `is_unit` is not asked of one in brackets. The unit is empty where there is none; it stands
    behind a blank or ``_`` alone only where `behind_blanks` says so.

    Examples
    --------
    >>> from accelcal.units import is_output_unit
    >>> [name_and_unit(f"Strom{unit}", is_output_unit) for unit in (" in mA", "_A", ", K", "[K]")]
    [('Strom', 'mA'), ('Strom', 'A'), ('Strom, K', ''), ('Strom', 'K')]
    """
    name, unit = split_unit(text.strip())
    behind = [] if unit else _with_units_behind(name, behind_blanks)
    return next((pair for pair in behind if is_unit(pair[1])), (name.strip(), unit))


def _with_units_behind(text: str, behind_blanks: bool = True) -> Iterator[tuple[str, str]]:
    """Ways to split a text into a name and what may be its unit, the longest unit first.

    MATLAB writes ``_`` for a bracket, also for the last one.
    """
    text = text.rstrip("_")
    for mark in _BEFORE_UNIT.finditer(text[:LONGEST]):
        name, unit = text[: mark.start()], text[mark.end() :]
        if name and unit and (behind_blanks or mark[1] is None):
            yield name, unit


def _known(text: str, name: str, unit: str | None) -> Heading:
    folded = plain_name(name)
    if folded == "t":
        return Heading(text, _temperature_or_time(name, unit), unit)
    role = _role(folded) or _role(plain_name(_NEXT_WORD.sub("_", name)))
    if role and not (role == "lot" and unit):  # an electric charge has a unit
        in_degrees = role == "position" and unit and has_unit("angle", unit)
        return Heading(text, "angle" if in_degrees else role, unit)
    if name.strip("-+") != name:  # of a direction, or a number that counts nothing
        return _measured(text, name, unit)
    for role, forms in (("strokes", _STROKES), ("positions", (_POSITIONS,))):
        if found := next(filter(None, (form.fullmatch(folded) for form in forms)), None):
            return Heading(text, role, unit, int(found[1]))
    found = _SERIAL.fullmatch(name)
    if found and found[1].rpartition("_")[2].casefold() not in _ROLES:  # as sn_1_std has it
        return Heading(text, "serials", unit, found[1])
    return _measured(text, name, unit)


def _measured(text: str, name: str, unit: str | None) -> Heading:
    """Meaning of a heading such as ``45 deg``, ``20 degC`` or ``T=20``."""
    found = _MEASURED.fullmatch(name.strip())
    own = found[3].strip() if found else ""
    if found and (has_unit("temperature", own) or (found[1] and not own)):
        return _temperature(text, found, unit)
    if not found or found[1] or not has_unit("angle", own):
        return Heading(text, None)
    return Heading(text, "angles", unit, float(_number(found)) * degrees_in(own))


def _temperature(text: str, found: re.Match[str], unit: str | None) -> Heading:
    """Meaning of a temperature, kept as it is written where it is not in degC."""
    number, own = _number(found), found[3].strip()
    if not own or is_same_unit(own, "degC"):
        return Heading(text, "temperatures", unit, float(number))
    if not found[1] and _OTHERWISE.fullmatch(found[0]):
        return Heading(text, None)
    return Heading(text, "temperatures", unit, f"{number} {own}")


def _number(found: re.Match[str]) -> str:
    return with_hyphen(found[2].replace(",", "."))


def _role(folded: str) -> str | None:
    """Role of a name, alone, beside its symbol as ``position_j``, or counted as ``stroke_no``.

    A number of readings counts them; it is not what was read.
    """
    counted = _COUNTED.fullmatch(folded)
    name = (counted["behind"] or counted["before"]) if counted else ""
    if _ROLES.get(name) in ("position", "stroke", "run"):
        folded = name
    if "\\" in folded:  # what rows and columns stand for, as the corner of a matrix tells it
        rows, _, columns = (_ROLES.get(part.strip("_")) for part in folded.partition("\\"))
        return rows if (rows, columns) in _CORNERS else None
    if folded in _ROLES:
        return _ROLES[folded]
    if _are_directions({*folded.split("_")}):
        return "direction"
    first, *others = folded.split("_")
    role = _ROLES.get(first)
    symbols = {"t"} if role in ("temperature", "time") else set()
    return role if all(_ROLES.get(word) == role or word in symbols for word in others) else None


def _are_directions(words: set[str]) -> bool:
    """Whether words are of both directions, as in Hin/Rück; R_1 is of something else."""
    return words <= FORWARD | BACK and all(
        any(map(str.isalpha, words & way)) for way in (FORWARD, BACK)
    )


def _temperature_or_time(name: str, unit: str | None) -> str:
    told = (role for role in ("time", "temperature") if unit and is_unit_of(role, unit))
    return next(told, "temperature" if name == "T" else "time")


def hint_of_triad(names: Iterable[str]) -> str:
    """Name the command for three accelerometers, where columns are called as theirs.

    Examples
    --------
    >>> hint_of_triad(["ax_g", "ay_g", "az_g"]), hint_of_triad(["T", "J", "Y"])
    ('; three accelerometers in one block go to accelcal triad', '')
    """
    is_triad = {axis_named(name.strip(' "')).axis for name in names} >= {*AXES}
    return "; three accelerometers in one block go to accelcal triad" * is_triad
