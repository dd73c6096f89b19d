"""From the readings of a table to records: one for each serial number."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from accelcal.arguments.kinds import shown
from accelcal.arrays import Array, Ints, Mask
from accelcal.dates import date_of
from accelcal.errors import TableError, located
from accelcal.io.declarations import Declarations
from accelcal.io.layout.parts import Layout
from accelcal.io.readings import Readings, notes_of_pace
from accelcal.io.runs import runs_of
from accelcal.io.values.markers import notes_of_lone, refuse_constant
from accelcal.io.values.times import notes_of_order
from accelcal.io.words.vocabulary import COLUMNS, is_missing
from accelcal.plural import lines_named, were
from accelcal.record import TumbleRecord
from accelcal.serials import notes_of_alike

_NEEDED = ("output", "angle", "temperature", "stroke", "mounting", "position")
_OPTIONAL = ("clamping", "std", "count", "line")

_NEAR = 3
"""Most rows from a reading to a second one of it; further down in the stroke it is a return."""

_CHANGES = "the output changes with the angle"

_AVERAGE = "average the samples of a reading: write their mean, with columns std and n"


def records_of(
    layout: Layout, readings: Readings, declared: Declarations, common: dict[str, Any]
) -> Iterator[TumbleRecord]:
    """Make the records of a table.

    One for each serial number, in the order of the file. `common` is what all have in common, by
    the names of `TumbleRecord`. Raises TableError if one of them has no output, or outputs that are
    all the same.
    """
    serials = _serials(layout, readings, common["serial"])
    common |= {"notes": (*common["notes"], *notes_of_alike(readings.serials))}
    for serial, chosen in zip(serials, readings.of_each_serial(), strict=True):
        if chosen.output.size == 0:
            problem = f"serial {shown(str(serial))} has no output that is not missing"
            remedy = "write its outputs or delete its rows"
            raise TableError(problem, remedy, source=layout.source, line=int(chosen.missing[0]))
        yield _record(chosen, declared, common | {"serial": serial})


def _serials(layout: Layout, readings: Readings, declared: str | None) -> tuple[str | None, ...]:
    names = readings.serials
    if not names or declared is None or names == (declared,):
        return names or (declared,)
    problem = f"serial {shown(', '.join(names))} in the table, but {shown(declared)} declared"
    raise layout.refuse(problem, "leave the column or the declaration out")


def _record(readings: Readings, declared: Declarations, common: dict[str, Any]) -> TumbleRecord:
    runs = runs_of(readings, declared.runs)
    kept = _without_repeats(readings, runs.index)
    notes = [*common["notes"], *runs.notes]
    if readings.missing.size:
        notes.append(_left_out(readings.missing, "missing reading"))
    if not kept.all():
        notes.append(_left_out(readings.line[~kept], "repeated reading"))
    readings = readings.select(kept)
    notes += (*notes_of_pace(readings.time), *notes_of_order(readings.time, readings.line))
    notes += notes_of_lone(readings.temperature, runs.index[kept], readings.line, runs.labels)
    if len(readings.output) > 1:
        refuse_constant(readings.output, readings.source, readings.line, _CHANGES)
    time, start = _seconds(readings.time, common["date"])
    day = None if common["date"] else readings.day
    days: list[str] = [] if day is None else np.unique(day).astype(str).tolist()
    if len(days) > 1:
        notes.append(f"the readings are of {len(days)} days: the test counts as of {days[0]}")
    values = (
        common
        | {"date": days[0] if days else common["date"]}
        | {name: getattr(readings, name) for name in (*_NEEDED, *_OPTIONAL)}
    )
    lot, more = lot_of_column(readings.lot, declared.metadata)
    values |= {"notes": (*notes, *more), "metadata": {**declared.metadata, **lot, **start}}
    values |= {"run": runs.index[kept], "run_labels": runs.labels, "time": time}
    return located(lambda: TumbleRecord(**values), source=common["source"])


def _left_out(lines: Ints, what: str) -> str:
    return f"{were(lines, what)} left out ({lines_named(lines)})"


def _seconds(time: NDArray[Any] | None, date: str | None) -> tuple[Array | None, dict[str, str]]:
    """Times in seconds, and the start where the table gives dates."""
    if time is None or time.dtype.kind == "f":
        return time, {}
    start = time[0]
    if time.dtype.kind == "m":
        day = date_of(date or "")
        start = None if day is None else np.datetime64(day.date()) + start
    since = (time - time[0]) / np.timedelta64(1, "s")
    return since, {} if start is None else {"start": str(start)}


# -- lots -----------------------------------------------------------------------------------------

_LOT = frozenset(COLUMNS["lot"])


def declared_lot(metadata: Mapping[str, str]) -> str | None:
    """Lot that a header line names.

    Examples
    --------
    >>> declared_lot({"operator": "Meyer", "Los": "7"})
    '7'
    """
    for key, text in metadata.items():  # a generator would take twice the time of a record
        if key.casefold() in _LOT:
            return text
    return None


def lot_of_column(
    lots: NDArray[np.str_] | None, metadata: Mapping[str, str]
) -> tuple[dict[str, str], list[str]]:
    """Metadata with the lot of one unit, and what is set aside.

    The lots are those of its readings. There is none where the column names
    none, or several. A sentence tells of several, and of another one than is declared.

    Examples
    --------
    >>> lot_of_column(np.array(["7", "", "7"]), {})
    ({'lot': '7'}, [])
    """
    names = [] if lots is None else sorted({lot for lot in lots.tolist() if not is_missing(lot)})
    declared = declared_lot(metadata)
    if names in ([], [declared]):
        return {}, []
    if len(names) > 1:
        several = shown(", ".join(names))
        return {}, [f"the column of lots names several for one unit, {several}, and was set aside"]
    if declared is not None:
        return {}, [f"the lot is {declared}, as declared, in place of {names[0]} in the column"]
    return {"lot": names[0]}, []


# -- repeats ---------------------------------------------------------------------------------------


def _without_repeats(readings: Readings, run: Ints) -> Mask:
    """Leave out the readings that repeat one with the same output.

    Returns a mask of those that are kept, of one accelerometer; `run` is that of each, shape (n,).
    Raises TableError if one is repeated with another output.
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
    level = readings.temperature[second]
    warmth = "unknown temperature" if np.isnan(level) else f"{level:g} degC"
    problem = (
        f"{where}, stroke {readings.stroke[first]} at {warmth} has"
        f" output {float(readings.output[second])!r}, but {float(readings.output[first])!r}"
        f" in line {readings.line[first]}"
    )
    remedy = _AVERAGE if sampled else _remedy(readings, first, second, further)
    return readings.refuse(second, problem, remedy)


def _remedy(readings: Readings, first: int, second: int, further: str) -> str:
    one_stroke = (readings.stroke[first:second] == readings.stroke[first]).all()
    if one_stroke and second > first + _NEAR:
        return f"write the return to it as {further}"
    if readings.run is not None:
        return "delete one, or give each visit to a temperature its own label in the column run"
    return "delete one, number the strokes, or tell the runs apart by a column run"
