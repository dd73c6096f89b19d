"""Records that lack readings of a plan, each its own: what they share, so that one stack has them.

A gap is a reading of infinite scatter. So records that have readings at the same angles and in the
same strokes can be solved together, each with weights of its own.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from accelcal.arrays import Labels, Mask, Places
from accelcal.estimate.head import MANY_POSITIONS
from accelcal.estimate.trend import FEW, powers_of
from accelcal.numerics.grouping import grouped
from accelcal.record import TumbleRecord

_MOST_READINGS = 150
"""Room for readings of a table in one direction beyond which it is long enough to be quick alone.

It is that of all strokes at all angles, as together the records may have readings all over it.
"""


def beside_gaps(record: TumbleRecord) -> Hashable:
    """Tell what records must share that differ by gaps; None where one is to be alone.

    Those share the angles and directions, and the strokes, in which each table has readings. Alone
    are those with weights, with temperatures that move, or with few readings: their noise may come
    from elsewhere, which then has to be found for each by itself.
    """
    declared = (record.std, record.count, record.clamping)
    if any(each is not None for each in declared):
        return None
    table = list(zip(record.run.tolist(), record.mounting.tolist(), strict=True))
    stroke, angle = record.stroke.tolist(), record.angle.tolist()
    heat = np.nan_to_num(record.temperature, nan=-np.inf).tolist()
    cells = frozenset(zip(table, angle, (record.stroke % 2).tolist(), strict=True))
    strokes = frozenset(zip(table, stroke, strict=True))
    readings, at_once = Counter(table), set(zip(table, stroke, angle, strict=True))
    free = readings - Counter(own for own, *_ in cells)
    turns = Counter(own for own, _ in strokes)
    ways = Counter((own, number % 2) for own, number in strokes)
    places = Counter((own, way) for own, _, way in cells)
    good = (
        max(number * ways[one] for one, number in places.items()) <= _MOST_READINGS
        and len(set(angle)) <= MANY_POSITIONS
        and len(at_once) == len(record)
        and len(set(zip(table, heat, strict=True))) == len(readings)
        and all(free[own] >= _least_free(number) for own, number in turns.items())
    )
    return (cells, strokes) if good else None


def _least_free(strokes: int) -> int:
    """Readings that a table has to have beyond one a cell: for the noise beside a drift."""
    powers = powers_of(strokes)
    return FEW + (powers + 2 if powers else 0)


def without_gaps(records: Sequence[TumbleRecord]) -> tuple[TumbleRecord, Places, Mask]:
    """Return a record with all n readings that any has, and which of its own each has there.

    Its outputs and temperatures are those of one of them. Of each record come the places of its
    readings, shape (R, n), at gaps that of another one at the same angle and in the same direction,
    and where they are its own, shape (R, n).
    """
    keys = [key for record in records for key in _readings(record)]
    one = {key: at for at, key in enumerate(keys)}  # for each, one that has it
    order = sorted(one)
    number = {key: at for at, key in enumerate(order)}
    size = list(map(len, records))
    row, start = np.repeat(np.arange(len(size)), size), np.repeat(np.cumsum(size) - size, size)
    source = np.full((len(size), len(order)), -1)
    source[row, list(map(number.__getitem__, keys))] = np.arange(len(keys)) - start
    there, chosen = source >= 0, list(map(one.__getitem__, order))
    same = Labels.of([(*table, stroke % 2, angle) for *table, stroke, angle in order]).code
    for _, alike in grouped(same).alike:
        own = source[:, alike]
        source[:, alike] = np.where(own >= 0, own, own.max(axis=2, keepdims=True))
    names = ("output", "angle", "temperature", "stroke", "run", "mounting", "position")
    arrays: dict[str, Any] = {
        name: np.concatenate([getattr(record, name) for record in records])[chosen]
        for name in names
    }
    return replace(records[0], time=None, line=None, **arrays), source, there


def _readings(record: TumbleRecord) -> Iterator[tuple[int, str, int, float]]:
    arrays = record.run, record.mounting, record.stroke, record.angle
    return zip(*(each.tolist() for each in arrays), strict=True)
