"""What a page is made of; the templates know these parts and nothing of calibrations."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

Tone = Literal["plain", "good", "warn", "bad"]


class _Part:
    """A part of a section."""

    __slots__ = ()

    @property
    def kind(self) -> str:
        """What a template knows it by: its class in small letters."""
        return type(self).__name__.lower()


@dataclass(frozen=True, slots=True)
class Paragraph(_Part):
    """Some sentences."""

    text: str


@dataclass(frozen=True, slots=True)
class Bullets(_Part):
    """A list."""

    items: Sequence[str]


@dataclass(frozen=True, slots=True)
class Note(_Part):
    """Something that must not be overlooked."""

    tone: Tone  # how serious it is
    title: str
    items: Sequence[str]


@dataclass(frozen=True, slots=True)
class Table(_Part):
    """A table; the first cell of each row is its heading."""

    caption: str
    headings: Sequence[str]
    rows: Sequence[Sequence[str]]
    numeric: Collection[int] = ()  # columns of numbers, which stand at the right
    tones: dict[str, Tone] = field(default_factory=dict)  # marks of cells with such a text
    folded: bool = False  # away on a screen until asked for


@dataclass(frozen=True, slots=True)
class Figure(_Part):
    """A picture, drawn when a page asks for it."""

    caption: str  # what it shows
    alternative: str  # what a reader who does not see it must know
    # draws it for ``"light"`` or for ``"dark"`` paper: SVG without a prologue, with ids of its own
    svg: Callable[[str], str]
    wide: bool = False  # whether it takes the whole width


@dataclass(frozen=True, slots=True)
class Gallery(_Part):
    """Pictures, and the tables that belong to them, side by side where there is room."""

    parts: Sequence[Figure | Table]


@dataclass(frozen=True, slots=True)
class Facts(_Part):
    """Names and what they are."""

    items: Sequence[tuple[str, str]]


Block = Paragraph | Bullets | Note | Table | Figure | Gallery | Facts


@dataclass(frozen=True, slots=True)
class Highlight:
    """A number that a reader looks for first."""

    name: str
    value: str  # with its unit
    detail: str  # its uncertainty


@dataclass(frozen=True, slots=True)
class Section:
    """A part under a heading."""

    title: str
    blocks: Sequence[Block]


@dataclass(frozen=True, slots=True)
class Chapter:
    """The report of one result."""

    sort: str  # what it is, such as "Calibration"
    title: str  # whose
    subtitle: str  # when, from what
    tone: Tone  # how it came out
    outcome: str  # the same in a word or two
    lede: str  # the result in a sentence
    highlights: Sequence[Highlight]  # the numbers that matter most
    sections: Sequence[Section]


@dataclass(frozen=True, slots=True)
class Page:
    """A page of one report or of several."""

    title: str
    chapters: Sequence[Chapter]
    software: str


def narrowed(table: Table, most: int) -> list[Table]:
    """Split a table that is too wide for paper; its first column stands in each part.

    Examples
    --------
    >>> wide = Table("means", ("deg", "a", "b", "c"), [("0", "1", "2", "3")])
    >>> [(part.caption, part.rows) for part in narrowed(wide, 2)]
    [('means, a to b', [('0', '1', '2')]), ('means, c to c', [('0', '3')])]
    >>> narrowed(wide, 3) == [wide]
    True
    """
    count = len(table.headings) - 1
    if count <= most:
        return [table]
    return [
        replace(
            table,
            caption=f"{table.caption}, {table.headings[i + 1]} to {table.headings[last]}",
            headings=(table.headings[0], *table.headings[i + 1 : last + 1]),
            rows=[(row[0], *row[i + 1 : last + 1]) for row in table.rows],
        )
        for i in range(0, count, most)
        for last in [min(i + most, count)]
    ]
