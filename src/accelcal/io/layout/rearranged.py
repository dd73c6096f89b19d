"""Tables brought into one form: headings stand once, with units, and every row has readings."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from itertools import pairwise

from accelcal.arguments.kinds import shown
from accelcal.io.files.csv_text import in_quotes
from accelcal.io.layout.header_lines import Declared, refuse_declaration
from accelcal.io.layout.heading_rows import blocks_of_columns
from accelcal.io.layout.output_headings import are_cycles
from accelcal.io.layout.parts import NO_READINGS, Layout
from accelcal.io.layout.separators import UNITS_BELOW, headings_with_units, split_line
from accelcal.io.words.headings import Heading, read_heading, split_unit
from accelcal.io.words.vocabulary import (
    ACROSS,
    COLUMNS,
    LABELS,
    begins_number,
    is_missing,
    is_unit_of,
)
from accelcal.plural import lines_named, were

_KEY = frozenset(
    {"serial", "run", "temperature", "mounting", "clamping", "stroke", "direction"}
    | {"position", "angle", "minutes", "seconds"}
)
"""Roles of the columns that tell which reading it is."""

_LABELS = _KEY.difference(("minutes", "seconds")).union(("lot", "date"))
"""Roles of columns whose cells may hold for rows below them."""

_PLACES = frozenset({"position", "angle", "stroke"})

_RULE = "-=_+:|,;\t "
"""Signs of a line between headings and rows."""

_SIDE = ("position", "angle")


def rearranged(layout: Layout) -> Layout:
    """Bring a table into the form in which each row has readings, and all that tells of them.

    Raises TableError if no row is left, or one below the readings declares something.
    """
    layout = _without_repeated_headings(_without_remarks(_with_row_names(layout)))
    layout = _with_blocks_below(_without_words_below(with_units_below(layout)))
    return _with_cycles(_with_merged_cells(_with_strokes_in_rows(layout)))


def with_units_below(layout: Layout) -> Layout:
    """Take a first row of units, as ``degC;-;mA``, that holds no reading, into the headings."""
    row = split_line(layout.rows[0], layout.separator)
    headings = headings_with_units(layout.headings, row) if len(layout.rows) > 1 else None
    if headings is None:
        return layout
    left = layout.some(range(1, len(layout.rows)))._replace(headings=headings)
    return left.noting(UNITS_BELOW.format(layout.lines[0]))


def _with_row_names(layout: Layout) -> Layout:
    """Give the names of rows, in quotes and without a heading as R writes them, an empty one."""
    size, mark = len(layout.headings) + 1, layout.separator
    if not all(row[:1] == '"' for row in layout.rows):
        return layout
    table = [split_line(row, mark) for row in layout.rows]
    names = {cells[0] for cells in table if len(cells) == size and cells[-1] != ""}
    if len(names) < len(table):  # each row has one of its own
        return layout
    return layout._replace(headings=(Heading("", None), *layout.headings))


def _without_words_below(layout: Layout) -> Layout:
    """Set aside rows of words or dashes between the headings and the first row with a number."""
    places = range(len(layout.rows))
    count = next((place for place in places if not _are_words(layout, place)), 0)
    if not count:
        return layout
    note = f"text below the headings was set aside ({lines_named(layout.lines[:count])})"
    return layout.some(range(count, len(layout.rows))).noting(note)


def _are_words(layout: Layout, place: int) -> bool:
    """Whether a row has words that are no reading, nor units or labels of the rows below."""
    row = layout.rows[place]
    if not row.strip(_RULE):
        return True
    if row.count('"') % 2:
        return False  # a cell goes on in the next line
    cells = split_line(row, layout.separator)
    words = [cell for cell in cells if cell.strip(_RULE)]
    pairs = zip(layout.headings, cells, strict=False)
    known = [(own.role, cell) for own, cell in pairs if own.role]
    roles = {role for role, cell in known if cell.strip(_RULE)}
    return not (
        any(map(is_missing, words))
        or any(map(begins_number, words))
        or all(any(map(str.isdecimal, cell)) for cell in words)  # as T=20;J=1;k=1;Y=1.35
        or (roles and roles <= LABELS)
        or any(is_unit_of(role, part) for role, cell in known for part in split_unit(cell))
    )


def _without_repeated_headings(layout: Layout) -> Layout:
    """Leave out the rows that repeat the headings, where the blocks tell their readings apart.

    The table stays as it is where it would have a reading twice.
    """
    texts = [heading.text for heading in layout.headings]
    first = next(filter(None, texts))
    may_be = [place for place, row in enumerate(layout.rows) if first in row]
    repeated = [own for own in may_be if _cells(layout.rows[own], layout, len(texts)) == texts]
    if not repeated:
        return layout
    if headings_with_units(layout.headings, _cells(layout.rows[0], layout, len(texts))):
        below = [place + 1 for place in repeated]
        repeated += [place for place in below if layout.rows[place : place + 1] == layout.rows[:1]]
    left = sorted(set(range(len(layout.rows))).difference(repeated))
    if not left:
        raise layout.refuse(*NO_READINGS)
    lines = [layout.lines[place] for place in sorted(repeated)]
    note = f"{were(lines, 'row')} of headings again, and left out ({lines_named(lines)})"
    return _if_told_apart(layout, layout.some(left).noting(note))


def _with_blocks_below(layout: Layout) -> Layout:
    """Put blocks of the same columns that stand side by side below each other.

    A temperature or serial that stands above each of them becomes a column. The table stays as it
    is where it would have a reading twice.
    """
    lead, width = blocks_of_columns([heading.text for heading in layout.headings])
    labels = layout.labels
    if lead and not labels:
        return layout
    columns = layout.headings[lead:]
    label = [Heading(own.text, ACROSS[own.role or ""]) for own in labels[:1]]
    used = width - (width > 0 and columns[width - 1].text == "")
    headings = (*layout.headings[: lead + used], *label)
    if not width or not _PLACES & {heading.role for heading in headings}:
        return layout
    count = -(-len(columns) // width)
    end = lead + count * width
    table = [_cells(row, layout, end) for row in layout.rows]
    starts = range(lead, end, width)
    gaps = [start + used for start in starts] if used < width else []
    if any(any(row[end:]) or any(row[place] for place in gaps) for row in table):
        return layout
    blocks = [
        ([*row[:lead], *row[start : start + used], *_told(labels[block : block + 1])], line)
        for block, start in enumerate(starts)
        for row, line in zip(table, layout.lines, strict=True)
        if any(row[start : start + width])
    ]
    return _if_told_apart(
        layout,
        layout._replace(
            headings=headings,
            rows=_joined((cells for cells, _ in blocks), layout.separator or " "),
            lines=[line for _, line in blocks],
        ).noting(f"{count} blocks side by side are read as one table"),
    )


def _told(labels: Sequence[Heading]) -> list[str]:
    """Cell of what stands above a block, with the decimal mark that it has there."""
    if not labels or labels[0].role == "serials":
        return [str(own.of) for own in labels]
    (own,) = labels
    number = own.of if isinstance(own.of, str) else f"{own.of:.12g}"
    return [number.replace(".", "," if "," in own.text else ".")]


def _if_told_apart(before: Layout, after: Layout) -> Layout:
    """The table made anew if no two rows of it are of one reading, else as it was."""
    size = len(after.headings)
    key = [place for place, own in enumerate(after.headings) if own.role in _KEY]
    rows = [_cells(row, after, size) for row in after.rows]
    told = {tuple(row[place] for place in key) for row in rows}
    return after if len(told) == len(rows) else before


def _cells(row: str, layout: Layout, size: int) -> list[str]:
    """Cells of a row, at least as many as there are columns."""
    cells = split_line(row, layout.separator)
    while len(cells) > size and not cells[-1]:
        cells.pop()
    return cells + [""] * (size - len(cells))


def _with_merged_cells(layout: Layout) -> Layout:
    """Repeat the cells of columns where empty ones stand below each."""
    columns = [place for place, own in enumerate(layout.headings) if own.role in _LABELS]
    head = [split_line(row, layout.separator) for row in layout.rows[:2]]
    if layout.separator is None or not any(_stands_once(head, place) for place in columns):
        return layout  # as nearly all
    table = [split_line(row, layout.separator) for row in layout.rows]
    merged = [
        place
        for place in columns  # where a few cells are missing, most are filled
        if _stands_once(table, place) and 2 * sum(bool(row[place]) for row in table) < len(table)
    ]
    if not merged:
        return layout
    for above, row in pairwise(table):
        for place in merged:
            row[place] = row[place] or above[place]
    names = shown(", ".join(layout.headings[place].text for place in merged))
    note = f"empty cells of {names} count as the one above them"
    rows = _joined(table, layout.separator)
    return layout._replace(rows=rows).noting(note)


def _stands_once(table: list[list[str]], place: int) -> bool:
    """Whether the first cell of a column is filled, and an empty one stands below each that is."""
    if any(len(row) <= place for row in table):
        return False
    filled = [bool(row[place]) for row in table]
    return filled[0] and not any(above and below for above, below in pairwise([*filled, True]))


def _with_strokes_in_rows(layout: Layout) -> Layout:
    """Take the first cells of the rows for strokes, where they are called so, as ``Stroke 1``."""
    side, *others = layout.headings
    mark = layout.separator
    if side.role not in _SIDE or not others or mark is None:
        return layout
    across = [_across(side.role, heading) for heading in others]
    first = read_heading(split_line(layout.rows[0], mark)[0])
    named = not first.text[:1].isdigit() or all(own.role == "angles" for own in others)
    if first.role != "strokes" or not named or None in across:
        return layout
    table = [split_line(row, mark) for row in layout.rows]
    strokes = [_stroke(row) for row in table]
    if None in strokes:
        return layout
    rows = ([str(own), *row[1:]] for own, row in zip(strokes, table, strict=True))
    headings = (Heading("stroke", "stroke"), *filter(None, across))
    return layout._replace(headings=headings, rows=_joined(rows, mark))


def _across(side: str, heading: Heading) -> Heading | None:
    """Heading of a column by its number or angle, or None where it is something else."""
    if heading.role == "angles":
        return heading
    if side == "position":
        return heading if heading.role == "strokes" and heading.text[:1].isdigit() else None
    angle = read_heading(f"{heading.text.rstrip('°')} deg")
    return angle._replace(text=heading.text) if angle.role == "angles" else None


def _stroke(row: Sequence[str]) -> float | str | None:
    heading = read_heading(row[0])
    return heading.of if heading.role == "strokes" else None


def _joined(table: Iterable[Sequence[str]], mark: str) -> list[str]:
    """Rows of the cells of a table."""
    return [mark.join(map(in_quotes, cells)) for cells in table]


_SUMMARIES = (
    *("mean", "average", "avg", "median", "max", "maximum", "min", "minimum", "range"),
    *("sum", "total", "rms", "spread", r"max[ .]?[-\u2212\u2013][ ]?min"),
    *("mittelwert", "mittel", "spannweite", "summe"),
    *("moyenne", "médiane", "étendue", "somme"),
    *("średnia", "suma", "průměr", "součet", "gemiddelde", "som"),
    *("среднее", "медиана", "макс", "максимум", "мин", "минимум", "размах", "сумма", "итого"),
    *(name.replace("_", r"[ _.\-]+") for name in COLUMNS["std"]),
)
_WORDS = r'(?=[^\W\d_][^\d\t;,|"]*(?:[\t;,|"]|$))'
"""Before a cell without digits, which few rows of readings begin with."""
_SUMMARY = re.compile(
    rf'[\s;,|"]*{_WORDS}(?:{"|".join(_SUMMARIES)})[ .:]*(?=[\t;,|"]|$)', re.IGNORECASE
)
"""Beginning of a row that sums up others."""

_REMARK = re.compile(r"[^\W\d_].*(?:[:=]|[^\W\d_]\s).*|\*.*")
"""A text of several words, or with a colon; a word alone may be a row that is cut short."""


def _without_remarks(layout: Layout) -> Layout:
    """Set aside rows that are called a mean or another summary, and remarks below the readings."""
    end = len(layout.rows)
    called = {place for place, row in enumerate(layout.rows) if is_called_summary(row)}
    while end > 1 and (
        _is_remark(layout, end - 1) or _is_summary(layout, end - 1, end - 1 in called)
    ):
        end -= 1
    below = range(end, len(layout.rows))
    summaries = [p for p in sorted(called.union(below)) if _is_summary(layout, p, p in called)]
    remarks = sorted(set(below).difference(summaries))
    if len(summaries) + len(remarks) in (0, len(layout.rows)):
        return layout
    kinds = (("summary", summaries), ("remark", remarks))
    told = [(what, [layout.lines[place] for place in own]) for what, own in kinds if own]
    notes = [f"{were(lines, what)} set aside ({lines_named(lines)})" for what, lines in told]
    left = sorted(set(range(len(layout.rows))).difference(summaries, remarks))
    return layout.some(left).noting(*notes)


def is_called_summary(row: str) -> bool:
    """Tell whether a row begins with the name of a summary."""
    return _SUMMARY.match(row) is not None


def _is_remark(layout: Layout, place: int) -> bool:
    cells = list(filter(None, split_line(layout.rows[place], layout.separator)))
    if layout.separator is None:  # a row of words alone is one remark
        cells = [cell for cell in [" ".join(cells)] if not any(map(str.isdecimal, cell))]
    if len(cells) != 1 or not _REMARK.fullmatch(cells[0]):
        return False
    refuse_declaration(cells[0], layout.source, layout.lines[place])
    above = layout.rows[max(place - 1, 0)]
    return cells[0] not in split_line(above, layout.separator)  # or the row is cut short


def _is_summary(layout: Layout, place: int, is_called: bool) -> bool:
    """Whether a row sums up others: by its name, or below all by a word in place of the key."""
    cells = split_line(layout.rows[place], layout.separator)
    first = next(filter(None, cells), "")
    key = {*_PLACES, "temperature"}
    told = [cell for own, cell in zip(layout.headings, cells, strict=False) if own.role in key]
    if is_called:  # a reading of a run that is called so has the whole key
        return not told or any(is_missing(cell) or cell == first for cell in told)
    others = [cell for cell in told if not is_missing(cell)]
    is_word = re.match(r"[^\W\d_]", first) is not None and not is_missing(first)
    return is_word and len(told) > max(len(others), 1) and {*others} <= {first} and any(cells[1:])


# -- cycles --------------------------------------------------------------------------------------


def _with_cycles(layout: Layout) -> Layout:
    """Take a column of cycles for the strokes, where only directions stand beside it."""
    headings = _with_words(layout)
    roles = {heading.role for heading in headings}
    if not roles & {"direction", "directions"} or roles & {"stroke", "strokes"}:
        return layout
    headings = tuple(h._replace(role="stroke") if are_cycles(h.text) else h for h in headings)
    declared = dict(layout.declared)
    if "direction" in roles and not any(own.role == "stroke" for own in headings):
        declared.setdefault("stroke", Declared("1", layout.headings_line, layout.source))
    return layout._replace(headings=headings, declared=declared)


def _with_words(layout: Layout) -> tuple[Heading, ...]:
    """Headings, of which a column of strokes is one of directions where its cells are words."""
    roles = [own.role for own in layout.headings]
    if roles.count("stroke") != 1 or {"direction", "directions"} & {*roles}:
        return layout.headings
    place = roles.index("stroke")
    ends = [split_line(row, layout.separator) for row in (layout.rows[0], layout.rows[-1])]
    if not all(len(row) > place and row[place].isalpha() for row in ends):
        return layout.headings
    own = layout.headings[place]._replace(role="direction")
    return (*layout.headings[:place], own, *layout.headings[place + 1 :])
