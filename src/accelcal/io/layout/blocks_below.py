"""Tables below each other in one text: the same headings, below what tells them apart."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from accelcal.io.files.text import SourceText
from accelcal.io.layout.found_headings import headings_of
from accelcal.io.layout.header_lines import keys_and_values
from accelcal.io.layout.rearranged import is_called_summary
from accelcal.io.layout.rows_above import said_in_row
from accelcal.io.layout.separators import split_line
from accelcal.io.words.headings import read_heading
from accelcal.io.words.vocabulary import ACROSS, KEYS, begins_number

_APART = frozenset({"serial", "temperature", "run", "stroke", "mounting", "clamping"})
"""What may be declared of a block alone."""

_START = 1 << 16
"""Characters in which the first headings stand."""

_BLANK = " \t,;|"
_BEGINS_READING = "0123456789+-.#"
"""How lines of readings and header lines begin, or none, but not headings."""


def blocks_of(source: SourceText) -> tuple[SourceText, ...]:
    r"""Take a text apart where its headings stand again below what is declared of their rows.

    Each block stands in its own lines, and is read like a sheet. A temperature or serial alone
    above its headings becomes a header line. What else the lines above the first block declare
    holds for those that do not declare it. The text stays as it is where nothing is declared of a
    later block, or only such a one has a serial.

    Examples
    --------
    >>> text = "20 °C\nJ,Y1,Y2\n1,1.3,1.3\n\n60 °C\nJ,Y1,Y2\n1,1.4,1.4\n"
    >>> blocks_of(SourceText("", text, ""))[1].text
    '\n\n\n\n# temperature: 60\nJ,Y1,Y2\n1,1.4,1.4\n'
    """
    lines = source.text.split("\n")
    words = [line for line in lines if line[:1] not in _BEGINS_READING]
    if len({*words}) == len(words):  # as of nearly all tables, whose headings need not be found
        return (source,)
    found = headings_of(source.text[:_START].split("\n"))
    if found is None:
        return (source,)
    headings = lines[found.lines[-1] - 1].rstrip(_BLANK)
    places = [place for place, line in enumerate(lines) if line.rstrip(_BLANK) == headings]
    if len(places) < 2:
        return (source,)
    spans = pairwise([-1, *places])
    starts, told = zip(*(_above(lines, *span, found.separator) for span in spans), strict=True)
    first, others = told[0], told[1:]
    if not all(own & _APART and "serial" not in own - first for own in others):
        return (source,)
    ends = (*starts[1:], len(lines))
    of_all = [(line, _keys(line, found.separator)) for line in lines[: places[0]]]
    return source._replace(text="\n".join(lines[: ends[0]])), *(
        source._replace(text="\n".join([*_shared(of_all, own, start), *lines[start:end]]))
        for own, start, end in zip(others, starts[1:], ends[1:], strict=True)
    )


def _shared(of_all: list[tuple[str, set[str]]], own: set[str], size: int) -> Iterator[str]:
    """Lines above a block: those of the first that hold for it too, else empty ones."""
    for line, keys in of_all:
        yield line if keys and keys <= KEYS.keys() - _APART - own else ""
    yield from [""] * (size - len(of_all))


def _above(
    lines: list[str], others: int, headings: int, separator: str | None
) -> tuple[int, set[str]]:
    """First line of what stands between others or readings and headings, and what it declares.

    A temperature or serial alone is written as a header line.
    """
    start, keys = headings, set[str]()
    while start > others + 1 and not _is_reading(lines[start - 1], separator):
        start -= 1
        alone = read_heading(lines[start].strip(_BLANK))
        if alone.role in ("temperatures", "serials") and not alone.unit:
            of = alone.of if isinstance(alone.of, str) else f"{alone.of:g}"
            lines[start] = f"# {ACROSS[alone.role]}: {of}"
        keys |= _keys(lines[start], separator)
    return start, keys


def _keys(line: str, separator: str | None) -> set[str]:
    """What a line declares."""
    return {own[0] for own in keys_and_values(line) or said_in_row(line, separator)}


def _is_reading(line: str, separator: str | None) -> bool:
    """Tell whether a row may be one of readings or of their summary: most cells are numbers."""
    cells = list(filter(None, split_line(line, separator)))
    return is_called_summary(line) or 2 * sum(map(begins_number, cells)) > max(len(cells), 2)
