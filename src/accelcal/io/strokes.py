"""Numbers of strokes, from a column of them alone or with one of directions."""

from __future__ import annotations

import numpy as np

from accelcal.arguments.kinds import shown
from accelcal.arrays import Array, Ints, Mask
from accelcal.io.layout.directions import are_cycles
from accelcal.io.layout.header_lines import Declared
from accelcal.io.layout.parts import Layout
from accelcal.io.layout.separators import split_line
from accelcal.io.values.cells import Column, labels, whole_numbers
from accelcal.io.words.headings import Heading
from accelcal.io.words.vocabulary import BACK, FORWARD, with_hyphen

_ASIDE = "column direction does not tell forward from back and was set aside"
_COUNTED = "strokes were counted by the column direction, odd ones forward and even ones back"
_FEW = 0.25
"""Part of the readings against the direction of their stroke that may still be mistakes."""

_FEWEST_STEPS = 3
"""Steps of the head in each direction that tell which it is."""


def with_cycles(layout: Layout) -> Layout:
    """Take a column of cycles for the strokes, where only directions stand beside it."""
    headings = _with_words(layout)
    roles = {heading.role for heading in headings}
    if not roles & {"direction", "directions"} or roles & {"stroke", "strokes"}:
        return layout
    headings = tuple(
        own._replace(role="stroke") if are_cycles(own.text) else own for own in headings
    )
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


def strokes_by_direction(
    column: Column, number: Ints, row: Ints, angle: Array, *, cycles: bool = False
) -> tuple[Ints, tuple[str, ...]]:
    """Count strokes by number and direction: odd ones go forward and even ones back.

    The column has the direction of each row; of each reading there are the number of its stroke, or
    of its cycle of one stroke forward and one back, its row, and its head angle [deg]. Numbers that
    are called cycles do not tell the strokes. Notes say how these were counted, where not as the
    numbers have them, or that the column was set aside. Raises TableError where a direction has no
    known name, or few readings are against that of their stroke.
    """
    of_row, names = labels(column)
    is_back = np.array([_is_back(with_hyphen(name.casefold())) for name in names])
    label, even = of_row[row], number % 2 == 0
    if not cycles and _tell_what_numbers_tell(is_back, label, even):
        return number, ()
    told: tuple[str, ...] = ()
    if np.isnan(is_back).all():
        within = (np.diff(number) == 0) & (np.diff(label) != 0)
        two_ways = len(names) == 2 and within.any()
        if not cycles and not two_ways:  # words of something else, as heating
            return number, (_ASIDE,)
        if two_ways and not np.isnan(ways := _ways(label, angle)).any():
            is_back = ways
            forward, back = (shown(names[i]) for i in np.argsort(ways))
            told = (f"direction {forward} is forward and {back} back, as the angles show",)
    known = ~np.isnan(is_back)[of_row]
    remedy = "write forward or back, or number the strokes"
    column.check(known, "{} is neither forward nor back", remedy)
    back = is_back[label] == 1.0
    against: Mask = back != even
    if not cycles and against.mean() < _FEW:
        right = np.ones(of_row.size, dtype=bool)
        right[row[against]] = False
        remedy = "odd strokes go forward and even ones back, so correct one of both"
        column.check(right, "{} contradicts the number of the stroke", remedy)
    strokes = np.where(back, 2 * number, 2 * number - 1)
    return strokes, (*told, f"{_COUNTED}, up to {strokes.max()}")


def _ways(label: Ints, angle: Array) -> Array:
    """1 for a word with which most angles fall from row to row, 0 where they rise, else NaN."""
    step, same = np.sign(np.diff(angle)), np.diff(label) == 0
    ways = np.array([np.sum(step[same & (label[1:] == own)]) for own in (0, 1)])
    count = np.array([np.sum(same & (label[1:] == own)) for own in (0, 1)])
    are_ways = np.all((2 * abs(ways) > count) & (count >= _FEWEST_STEPS)) and ways.prod() < 0
    return np.where(are_ways, ways < 0, np.nan)


def _is_back(word: str) -> float:
    """1 for a word that means back, 0 for forward, NaN for one that is not known."""
    return 0.0 if word in FORWARD else 1.0 if word in BACK else np.nan


def _tell_what_numbers_tell(is_back: Array, label: Ints, even: Mask) -> bool:
    """Whether odd strokes have one direction and even ones another, whatever its name."""
    evens = np.bincount(label, even, minlength=is_back.size)
    whole = np.bincount(label, minlength=is_back.size)
    if not np.isnan(is_back[whole > 0]).any():
        return bool(np.array_equal(evens, np.where(whole > 0, is_back, 0.0) * whole))
    odd, both = (whole > 0) & (evens == 0), (evens > 0) & (evens < whole)
    return not both.any() and odd.sum() <= 1 and (evens > 0).sum() <= 1


def strokes_of_rows(column: Column) -> Ints:
    """Return the number of the stroke in each row.

    Raises TableError at the first cell that is no whole number from 1.
    """
    stroke = whole_numbers(column, "strokes count from 1, odd ones go forward and even ones back")
    column.check(stroke > 0, "{} is missing", "write the stroke in every row")
    return stroke
