"""Lines of a report: safe to show, filled to the width of a terminal, aligned in columns."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from textwrap import wrap

from accelcal.escapes import visible

WIDTH = 100
"""Characters of the longest line."""


class Row(str):
    """A line of a table that keeps its cells; the first one may be a heading."""

    cells: tuple[str, ...]
    is_heading: bool


class Report(str):
    """A text that keeps its lines, those of tables as each a `Row`."""

    __slots__ = ("lines",)
    lines: tuple[str, ...]


def visible_lines(lines: Iterable[str]) -> Report:
    r"""Join the lines of a report, each with escapes as of `visible`, whatever names stand in them.

    Examples
    --------
    >>> visible_lines(["serial AL\n15", "K1"])
    'serial AL\\n15\nK1'
    """
    kept = tuple(lines)
    found = Report("\n".join(map(visible, kept)))
    found.lines = kept
    return found


def sections(*parts: Iterable[str]) -> Report:
    r"""Join the parts of a report, of visible lines each, by empty lines; empty parts are left out.

    Examples
    --------
    >>> sections(["AL-15", "162 readings"], [], ["K1"])
    'AL-15\n162 readings\n\nK1'
    """
    filled = [part for part in map(list, parts) if part]
    return visible_lines([line for part in filled for line in ("", *part)][1:])


def sentence(text: str) -> str:
    """Begin a text with a capital letter, and leave the others as they are.

    Examples
    --------
    >>> sentence("drift of the foundation, as DIN says")
    'Drift of the foundation, as DIN says'
    """
    return text[:1].upper() + text[1:]


def unit_of(serial: str | None, source: str) -> str:
    """Name a unit by its serial number, where it has one, and its input.

    Examples
    --------
    >>> unit_of("AL-15", "al15.csv"), unit_of(None, "al15.csv")
    ('serial AL-15, al15.csv', 'al15.csv')
    """
    return f"serial {serial}, {source}" if serial else source


def hanging(sentence: str, indent: str = "") -> list[str]:
    """Fill lines, those after the first two characters deeper.

    Examples
    --------
    >>> [len(line) for line in hanging("drift " * 30)], hanging("drift " * 30)[1][:9]
    ([95, 85], '  drift d')
    """
    return wrap(sentence, WIDTH, initial_indent=indent, subsequent_indent=indent + "  ")


def wrapped(sentence: str, lead: str = "") -> list[str]:
    """Fill lines, those after the first as deep as the words behind the lead."""
    return wrap(sentence, WIDTH, initial_indent=lead, subsequent_indent=" " * len(lead))


def aligned(
    rows: Sequence[Sequence[str]],
    right: Collection[int],
    indent: str = "",
    *,
    headed: bool = True,
) -> Iterator[Row]:
    r"""Align cells in columns; in the columns `right`, cells stand at the right.

    The first row is a heading where `headed`.

    Examples
    --------
    >>> print(*aligned([("bias", "3.3"), ("k", "12")], right={1}), sep="\n")
    bias  3.3
    k      12
    """
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    for row in rows:
        cells = (
            cell.rjust(width) if i in right else cell.ljust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        line = Row(indent + "  ".join(cells).rstrip())
        line.cells, line.is_heading = tuple(row), headed and row is rows[0]
        yield line


def notes(said: Sequence[str]) -> Iterator[str]:
    """List notes under their heading; nothing without any."""
    if said:
        yield "Notes"
    for note in said:
        yield from wrapped(note, "  - ")
