"""Directions of the strokes in headings: their words, and the numbers beside them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from accelcal.io.words.headings import name_and_unit, read_heading
from accelcal.io.words.vocabulary import BACK, CYCLES, FORWARD
from accelcal.units import is_output_unit

_WORDS = re.compile(r"[^\W\d_]+|[0-9]{1,6}")
_COUNTERS = ("no", "nr")
"""Words before a number that say nothing else."""
_STROKES = {**dict.fromkeys(FORWARD, 1), **dict.fromkeys(BACK, 2)}
"""Word of a direction -> the stroke that it is, of two."""
_DIRECTIONS = frozenset(word for word in _STROKES if word.isalpha() and len(word) > 1)


def are_cycles(heading: str) -> bool:
    """Whether a heading says that its column counts cycles of two strokes."""
    return heading.casefold() in CYCLES


class Way(NamedTuple):
    """Direction of an output, 1 forward and 2 back, and the number beside it, 0 without."""

    number: int
    stroke: int
    unit: str | None
    counted: bool  # beside a word that tells what the number counts


def strokes_of(ways: Sequence[Way]) -> dict[tuple[int, int], int]:
    """Stroke of each number and direction: one of two, of its cycle, or that of the number.

    Numbers without a word count from 1; others may be temperatures or serials.
    """
    pairs = {way[:2] for way in ways}
    numbers = {number for number, _ in pairs}
    if len(pairs) < len(ways) or (0 in numbers and len(numbers) > 1):
        return {}
    if max(numbers, default=0) > len(numbers) and not all(way.counted for way in ways):
        return {}
    left = {(number, way) for number in numbers for way in (1, 2)} - pairs
    if not left or (len(numbers) > 1 and left == {(max(numbers), 2)}):
        return {(number, way): max(2 * number - 2, 0) + way for number, way in pairs}
    are_strokes = all(number and number % 2 == way % 2 for number, way in pairs)
    return {(number, way): number for number, way in pairs} if are_strokes else {}


def tells_direction(text: str) -> bool:
    """Tell whether a text has the word of a direction."""
    return not _DIRECTIONS.isdisjoint(_WORDS.findall(text.casefold()))


def way_of(text: str) -> Way | None:
    """Direction that a heading of outputs tells, if it tells one."""
    if not tells_direction(text):
        return None
    name, unit = name_and_unit(text, is_output_unit)
    words = [word for word in _WORDS.findall(name.casefold()) if word not in _COUNTERS]
    told = [_STROKES[word] for word in words if word in _DIRECTIONS]
    numbers = [int(word) for word in words if word.isdecimal()]
    if len(told) != 1 or len(numbers) > 1 or len(words) > len(told + numbers) + 1:
        return None
    beside = {word for word in words if word not in _DIRECTIONS and not word.isdecimal()}
    roles = {read_heading(word).role for word in beside.difference(CYCLES)}
    if not roles <= {"stroke", "output"}:
        return None
    counted = "stroke" in roles or not beside.isdisjoint(CYCLES)
    return Way(next(iter(numbers), 0), told[0], unit or None, counted)
