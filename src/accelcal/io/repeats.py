"""Readings that stand in a table twice, or that were sampled many times."""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Ints, Mask
from accelcal.errors import TableError
from accelcal.io.readings import Readings

_NEAR = 3
"""Most rows from a reading to a second one of it; further down in the stroke it is a return."""

_AVERAGE = "average the samples of a reading: write their mean, with columns std and n"


def without_repeats(readings: Readings, run: Ints) -> Mask:
    """Leave out the readings that repeat one with the same output.

    Returns a mask of those that are kept, of one accelerometer; `run` is that of each, shape (n,).

    Raises
    ------
    TableError
        If one is repeated with another output.
    """
    place = np.where(readings.position > 0, readings.position, readings.angle)
    kind = readings.position > 0
    keys = (readings.stroke, place, kind, readings.mounting, run)
    order = np.lexsort(keys)
    same = np.ones(max(order.size - 1, 0), dtype=bool)
    for key in keys:
        same &= key[order][1:] == key[order][:-1]
    earlier, later = order[:-1][same], order[1:][same]
    clash = readings.output[earlier] != readings.output[later]
    if clash.any():
        at = np.argmin(later[clash])
        in_a_row = np.count_nonzero(later - earlier == 1)
        sampled = in_a_row > 1 and 2 * in_a_row >= order.size
        one, other = int(earlier[clash][at]), int(later[clash][at])
        raise _clash(readings, one, other, sampled=bool(sampled))
    kept = np.ones(order.size, dtype=bool)
    kept[later] = False
    return kept


def _clash(readings: Readings, first: int, second: int, *, sampled: bool) -> TableError:
    where, further = f"angle {readings.angle[first]:g}", f"{readings.angle[first] + 360.0:g}"
    if readings.position[first]:
        where, further = f"position {readings.position[first]}", "the position behind the last"
    problem = (
        f"{where}, stroke {readings.stroke[first]} at {_level(readings.temperature[second])} has"
        f" output {float(readings.output[second])!r}, but {float(readings.output[first])!r}"
        f" in line {readings.line[first]}"
    )
    remedy = _AVERAGE if sampled else _remedy(readings, first, second, further)
    return readings.refuse(second, problem, remedy)


def _level(temperature: float) -> str:
    return "unknown temperature" if np.isnan(temperature) else f"{temperature:g} degC"


def _remedy(readings: Readings, first: int, second: int, further: str) -> str:
    one_stroke = (readings.stroke[first:second] == readings.stroke[first]).all()
    if one_stroke and second > first + _NEAR:
        return f"write the return to it as {further}"
    if readings.run is not None:
        return "delete one, or give each visit to a temperature its own label in the column run"
    return "delete one, or tell the runs apart by a column run"
