"""What stands above a stream of samples: header lines and column headings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from accelcal.errors import TableError
from accelcal.io.cells import MISSING
from accelcal.io.layout import split_line
from accelcal.io.output_unit import unit_of_outputs
from accelcal.io.text import refuse_document
from accelcal.io.vocabulary import Heading, canonical_key, has_unit, read_heading, split_unit
from accelcal.io.wording import shown

__all__ = ["SampleHeadings", "in_metres", "read_sample_headings"]

ROLES = ("output", "temperature", "time", "a_p", "a_o")
"""What a column may hold."""

_LOCAL_G = ("g", "g_local")
_TWO_UNITS = "units {} and {} for one output; name one unit"
_JSON_LINES = 5
"""Lines in which a document says what it is."""

_REMEDY = "name the columns in the first row: output, and temperature where it is known"


@dataclass(frozen=True, slots=True)
class SampleHeadings:
    """Header lines and column headings of a stream.

    Attributes
    ----------
    source : str
        Name of the file.
    declared : mapping of str to str
        Header lines by canonical key.
    cells : tuple of Heading
        One entry a column; a role None where it is not used.
    separator : str or None
        Separator of the columns; None for runs of blanks.
    columns : mapping of str to int
        Index of the column of each role.
    units : mapping of str to str
        Unit of each role, where a heading or header line gives it.
    line : int
        Line of the first sample.
    row : str
        The first row of samples, where it had to be read to know that it is one.
    """

    source: str
    declared: Mapping[str, str]
    cells: tuple[Heading, ...]
    separator: str | None
    columns: Mapping[str, int]
    units: Mapping[str, str]
    line: int
    row: str = ""

    @property
    def numeric(self) -> dict[str, int]:
        """Index of the columns that hold numbers."""
        return {role: index for role, index in self.columns.items() if role != "time"}

    @property
    def temperature(self) -> float | None:
        """Temperature that a header line declares for all samples [degC]."""
        text = self.declared.get("temperature", "").removesuffix("degC").strip()
        if text.casefold() in MISSING:
            return None
        try:
            return float(text)
        except ValueError:
            problem, remedy = f"temperature is {shown(text)}", "give it as a number in degC"
            raise TableError(problem, remedy, source=self.source) from None


def read_sample_headings(readline: Callable[[], str], source: str) -> SampleHeadings:
    """Read a stream up to its first sample.

    Parameters
    ----------
    readline : callable
        Gives the next line, an empty text at the end.
    source : str
        Name of the file, for messages.

    Returns
    -------
    SampleHeadings
        Header lines and headings. They may stand in a comment, as numpy.savetxt writes them.

    Raises
    ------
    TableError
        If there is no column ``output``, or the headings contradict each other.
    """
    declared: dict[str, str] = {}
    commented = ""
    line = 0
    while row := readline():
        line += 1
        bare = row.strip(' \t\r\n"')
        if bare.startswith("#"):
            commented = bare.lstrip("# ")
            declared |= _declaration(commented.rstrip(' \t,;"'))
        elif bare.strip(",;") and not bare.casefold().startswith("sep="):  # as Excel has it
            break
    else:
        raise TableError("no samples", _REMEDY, source=source)
    braces = bare.startswith(("{", "["))
    below = [readline() for _ in range(_JSON_LINES)] if braces else []
    refuse_document("".join([bare, *below]), source)
    above = "output" not in _roles(bare) and "output" in _roles(commented)
    headings, separator = _split_headings(commented if above else bare)
    columns = _columns(headings, source, line)
    units = _units(headings, declared, source, line)
    line, row = (line, row) if above else (line + 1, "")
    return SampleHeadings(source, declared, headings, separator, columns, units, line, row)


def _declaration(text: str) -> dict[str, str]:
    key, _, value = text.partition(":")
    name, unit = split_unit(key.strip())
    known = canonical_key(name)
    return {known: f"{value.strip()} {unit}".strip()} if known and value else {}


def _split_headings(line: str) -> tuple[tuple[Heading, ...], str | None]:
    """Headings, split by the separator that gives the most known ones."""
    options: list[str | None] = [mark for mark in ("\t", ";", ",") if mark in line]
    if not options and _heading(line).role:
        return (_heading(line),), ","
    options = options or [None]
    split = {mark: tuple(map(_heading, split_line(line, mark))) for mark in options}
    best = max(options, key=lambda mark: sum(cell.role is not None for cell in split[mark]))
    return split[best], best


def _roles(line: str) -> set[str | None]:
    return {heading.role for heading in _split_headings(line)[0]} if line else set()


def _heading(text: str) -> Heading:
    name, unit = split_unit(text.strip())
    known = read_heading(text)
    role = name.casefold() if name.casefold() in ("a_p", "a_o") else known.role
    return Heading(text, role if role in (*ROLES, "serial") else None, known.unit or unit or None)


def _columns(headings: Sequence[Heading], name: str, line: int) -> dict[str, int]:
    columns: dict[str, int] = {}
    for index, (text, role, *_) in enumerate(headings):
        if role in columns:
            problem = (
                f"columns {shown(headings[columns[role]].text)} and {shown(text)} mean the same"
            )
            raise TableError(problem, "keep one and rename the other", source=name, line=line)
        if role == "serial":
            problem, remedy = "a column serial", "give the samples of one accelerometer a file"
            raise TableError(problem, remedy, source=name, line=line)
        if role:
            columns[role] = index
    if "output" not in columns:
        have = ", ".join(heading.text for heading in headings)
        problem = f"no column output among {shown(have)}"
        raise TableError(problem, _REMEDY, source=name, line=line)
    return columns


def _units(
    headings: Sequence[Heading], declared: Mapping[str, str], name: str, line: int
) -> dict[str, str]:
    units = {heading.role: heading.unit for heading in headings if heading.role and heading.unit}
    for role, unit in units.items():
        if remedy := _unit_to_give(role, unit):
            raise TableError(f"{role} in {unit}", f"give it in {remedy}", source=name, line=line)
    written = [(unit, line) for unit in (units.get("output"), declared.get("unit")) if unit]
    found = unit_of_outputs(written, None, name, _TWO_UNITS).name
    return {**units, "output": found} if found else units


def _unit_to_give(role: str, unit: str) -> str:
    """Unit that a column has to have; empty where its own will do."""
    if role == "temperature":
        return "" if has_unit("temperature", unit) else "degC"
    if role in ("a_p", "a_o"):
        return "" if unit in _LOCAL_G or in_metres(unit) else "g or m/s^2"
    return ""


def in_metres(unit: str) -> bool:
    """Tell whether the unit of an acceleration is m/s^2.

    Parameters
    ----------
    unit : str
        The unit as written.

    Returns
    -------
    bool
        True for all spellings of it.

    Examples
    --------
    >>> in_metres("m/s2"), in_metres("mg")
    (True, False)
    """
    return has_unit("local_gravity", unit)
