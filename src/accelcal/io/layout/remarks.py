"""Rows that are no readings: means and other summaries, and remarks below the table."""

from __future__ import annotations

import re

from accelcal.io.layout.header_lines import refuse_declaration
from accelcal.io.layout.parts import Layout
from accelcal.io.layout.separators import split_line
from accelcal.io.words.signs import is_missing
from accelcal.io.words.vocabulary import COLUMNS
from accelcal.io.words.wording import lines_named, were

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

_KEY = ("temperature", "position", "angle", "stroke")
_REMARK = re.compile(r"[^\W\d_].*(?:[:=]|[^\W\d_]\s).*|\*.*")
"""A text of several words, or with a colon; a word alone may be a row that is cut short."""


def without_remarks(layout: Layout) -> Layout:
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
    told = [cell for own, cell in zip(layout.headings, cells, strict=False) if own.role in _KEY]
    if is_called:  # a reading of a run that is called so has the whole key
        return not told or any(is_missing(cell) or cell == first for cell in told)
    others = [cell for cell in told if not is_missing(cell)]
    is_word = re.match(r"[^\W\d_]", first) is not None and not is_missing(first)
    return is_word and len(told) > max(len(others), 1) and {*others} <= {first} and any(cells[1:])
