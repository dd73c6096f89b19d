"""Readings that are given twice: each would count as one more that tells the same."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from accelcal.arrays import Places
from accelcal.errors import InputError
from accelcal.numerics.grouping import cells
from accelcal.record import TumbleRecord, naming

_FEWEST = 8
"""Readings below which some that agree in all digits may do so by chance."""


def refuse_copies(record: TumbleRecord) -> None:
    """Refuse a record whose readings stand there several times, as each would count as a replicate.

    All that share position, stroke, run and temperature then agree to the last digit, and those of
    other strokes do not, or there are none. Those of a coarse step are no copies: of one position
    they agree from stroke to stroke too, with the next one in the same direction or, with one
    stroke each way, the one back.
    """
    position, every = (record.run, record.mounting, np.round(record.angle, 6)), record.output
    first = _first_of_each(cells(*position, record.stroke, np.nan_to_num(record.temperature)))
    copies = int(np.sum(first != np.arange(first.size)))
    if copies < _FEWEST or np.any(every != every[first]):
        return
    for direction in (record.stroke % 2, 0 * record.stroke):  # back may differ by a play
        before = _first_of_each(cells(*position, direction))
        anew = np.flatnonzero((first == np.arange(first.size)) & (before != first))
        if anew.size:
            break
    if 2 * np.sum(every[anew] == every[before[anew]]) <= anew.size:
        told = "repeat one of the same position, stroke and run to the last digit"
        with naming(record):
            raise InputError(
                f"{copies} of {len(record)} readings {told}, and tell nothing of the noise; give"
                " each reading once"
            )


def _first_of_each(cell: Places) -> Places:
    """Place of the first reading of the cell of each reading."""
    return np.unique(cell, return_index=True)[1][cell]


def refuse_twice(records: Iterable[TumbleRecord]) -> None:
    """Refuse the same readings twice, as a file and its copy, where each adds to what is told."""
    seen: dict[tuple[str | None, bytes], TumbleRecord] = {}
    for record in records:
        key = record.serial, record.output.tobytes()
        if key in seen and seen[key] == record:
            problem = f"the same readings as {seen[key].source}"
            raise InputError(f"{record.source}: {problem}; give each table once")
        seen[key] = record
