"""Readings without temperature in a table whose rows tell the runs: to which level they belong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from accelcal.arrays import Ints, Mask
from accelcal.head_angles import nominal_angles
from accelcal.io.readings import Readings
from accelcal.io.words.wording import lines_named
from accelcal.plural import counted

_JOINED = (
    "counts to the level of the rows around it",
    "count to the level of the rows around them",
)
_APART = (
    "is a run of its own: write it, or name its run in a column run",
    "are a run of their own: write it, or name their run in a column run",
)


def with_levels_around(readings: Readings, level: Ints) -> tuple[Readings, tuple[str, ...]]:
    """Give readings without temperature that of the rows around them, to tell the levels by.

    The readings are all of one accelerometer, each with its level by its temperature. Those stay
    unknown that stand between two levels, are of no stroke of the rows around them nor of one
    between two of these, or come again in them. Notes say what the rows tell, and what not.
    """
    unknown = np.isnan(readings.temperature)
    if unknown.all():
        return readings, ()
    rows, known = np.flatnonzero(unknown), np.flatnonzero(~unknown)
    stretch = np.concatenate([[0], np.cumsum(np.diff(level[known]) != 0)])
    after = np.searchsorted(known, rows)
    before, after = np.maximum(after - 1, 0), np.minimum(after, known.size - 1)
    of_row = np.empty(unknown.size, dtype=np.int64)
    of_row[known] = stretch
    of_row[rows] = np.where(stretch[before] == stretch[after], stretch[before], -1)
    joined = unknown & _of_their_strokes(readings, of_row, unknown)
    temperature = readings.temperature.copy()
    temperature[rows] = np.where(joined[rows], temperature[known[before]], np.nan)
    told = {_JOINED: joined, _APART: unknown & ~joined}
    notes = (
        f"{counted(int(own.sum()), 'reading')} without temperature {said[int(own.sum() > 1)]}"
        f" ({lines_named(readings.line[own])})"
        for said, own in told.items()
        if own.any()
    )
    return replace(readings, temperature=temperature), tuple(notes)


def _of_their_strokes(readings: Readings, of_row: Ints, unknown: Mask) -> Mask:
    """Readings of strokes that the rows have, or the neighbours of which; none comes again."""
    fields = (of_row, readings.mounting, readings.stroke, nominal_angles(readings.angle))
    keys = list(zip(*(field.tolist() for field in fields), strict=True))
    known = {key for key, own in zip(keys, unknown.tolist(), strict=True) if not own}
    strokes = {key[:3] for key in known}
    again = {keys[i][0] for i in np.flatnonzero(unknown).tolist() if keys[i] in known}
    between = {(row, side, k + 1) for row, side, k in strokes if (row, side, k + 2) in strokes}
    return np.array([key[:3] in strokes | between and key[0] not in again for key in keys])
