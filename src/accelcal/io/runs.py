"""Runs, the visits to a temperature: as the column run names them, or told from the rows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array, Ints, Mask
from accelcal.errors import TableError
from accelcal.head_angles import head_positions, nominal_angles
from accelcal.io.readings import Readings
from accelcal.numerics.grouping import distinct, grouped
from accelcal.plural import counted, lines_named, listed

LEVEL_GAP = 2.0
"""Gap between sorted temperatures that separates two levels, and the widest level [degC]."""

_NARROW_GAP = 1.0
"""The same where levels lie so close that the wider gap would join them [degC]."""

_MOST_DIGITS = 9
"""Digits of the number of a run; longer ones are codes, or dates."""


@dataclass(frozen=True, slots=True)
class Runs:
    """The runs of a table."""

    index: Ints  # run of each reading, shape (n,)
    labels: tuple[str, ...]  # in the order in which they were made as far as the table tells
    notes: tuple[str, ...] = ()  # what was told from the rows, and what they do not tell


def runs_of(readings: Readings, declared: tuple[str, ...]) -> Runs:
    """Tell the runs of a table.

    The readings are of one accelerometer. `declared` names the runs in their order where a header
    line tells them. Raises TableError if the temperatures make no levels, or a run is not among the
    declared ones.

    Without a column run, a level of temperature is one run. It is two where the rows prove that it
    was met twice: other temperatures lie between them in time, or in the file and then the strokes
    go on counting or the same reading comes again with another output. Each mounting is a run of
    its own, as a unit that is mounted anew is launched anew. A reading without temperature counts
    to the level of the rows around it where it completes a stroke of theirs, or is of a whole
    stroke between two of these. With a column run, the runs are in the order of their times where
    these tell one after the other, else in that of their numbers or rows (`order_of_runs`).
    """
    if readings.run is None:
        told: tuple[str, ...] = ()
        if np.isnan(readings.temperature).any():
            level = _split_at(readings.temperature, LEVEL_GAP)
            readings, told = with_levels_around(readings, level)
        levels = _levels(readings)
        levels = replace(levels, notes=(*told, *levels.notes))
        levels = levels if declared else _of_mountings(levels, readings.mounting)
        runs, order = _visits(readings, levels)
    else:
        runs = Runs(readings.run, readings.run_labels)
        order = order_of_runs(readings.run, readings.run_labels, readings.time)
        runs = runs if declared else replace(runs, notes=_reordered(runs, order))
    return _in_order(runs, declared or _by_appearance(runs, order), readings)


def order_of_runs(run: Ints, labels: tuple[str, ...], time: Array | None) -> Ints:
    """Order of readings: of their times [s] where these tell one run after the other.

    Else that of the numbers of the runs where these are counted, or as given.

    Examples
    --------
    >>> run = np.array([0, 0, 1, 1])
    >>> order_of_runs(run, ("a", "b"), np.array([9.0, 8.0, 1.0, 2.0])).tolist()
    [2, 3, 1, 0]
    >>> order_of_runs(run, ("2", "1"), np.array([0.0, 1.0, 0.0, 1.0])).tolist()
    [2, 3, 0, 1]
    >>> order_of_runs(run, ("b", "a"), None).tolist()
    [0, 1, 2, 3]
    """
    if time is not None:
        order = np.argsort(time, kind="stable")
        is_next, is_tied = np.diff(run[order]) != 0, np.diff(time[order]) == 0
        if is_next.sum() < distinct(run).size and not (is_next & is_tied).any():
            return order
    if are_counted(labels):
        return np.argsort(np.array(labels, dtype=int)[run], kind="stable")
    return np.arange(run.size)


def are_counted(labels: tuple[str, ...]) -> bool:
    """Tell whether labels are numbers that count on from some whole one, in any order.

    Examples
    --------
    >>> are_counted(("4", "1", "3", "2")), are_counted(("20", "80")), are_counted(("a",))
    (True, False, False)
    """
    if not all(label.isdecimal() and len(label) <= _MOST_DIGITS for label in labels):
        return False
    numbers = sorted(map(int, labels))
    return numbers == list(range(numbers[0], numbers[0] + len(numbers)))


def _reordered(runs: Runs, order: Ints) -> tuple[str, ...]:
    """Say where the runs are in another order than their rows."""
    names, rows = _by_appearance(runs, order), _by_appearance(runs, np.arange(order.size))
    if names == rows:
        return ()
    numbers = _by_appearance(runs, order_of_runs(runs.index, runs.labels, None))
    what = "numbers" if names == numbers else "times"
    return (f"the runs are in the order of their {what}, not of the rows: {listed(names)}",)


def _by_appearance(runs: Runs, order: Ints) -> tuple[str, ...]:
    found, first = np.unique(runs.index[order], return_index=True)
    return tuple(runs.labels[i] for i in found[np.argsort(first)].tolist())


def _in_order(runs: Runs, order: tuple[str, ...], readings: Readings) -> Runs:
    place = {label: index for index, label in enumerate(order)}
    new = np.array([place.get(label, -1) for label in runs.labels])[runs.index]
    if (new < 0).any():
        at = int(np.argmin(new))
        problem = f"run {runs.labels[runs.index[at]]!r} is not among the declared runs"
        raise readings.refuse(at, problem, "add it to the line '# runs: ...'")
    return Runs(new, order, runs.notes)


# -- levels ----------------------------------------------------------------------------------------


def _levels(readings: Readings) -> Runs:
    """Levels of temperature, split where the sorted temperatures leave a gap."""
    temperature = readings.temperature
    level = _split_at(temperature, LEVEL_GAP)
    wide = _spans(temperature, level) > LEVEL_GAP
    if not wide.any():
        return Runs(level, _labels(temperature, level, 0))
    joined = wide[level]
    finer = np.where(joined, level.size + _split_at(temperature, _NARROW_GAP), level)
    level = np.unique(finer, return_inverse=True)[1].astype(np.int64)
    wide = _spans(temperature, level) > LEVEL_GAP
    if wide.any():
        raise _no_level(readings, level == np.argmax(wide))
    labels = _labels(temperature, level, 1)
    close = ", ".join(labels[i] for i in distinct(level[joined]).tolist())
    note = f"levels {close} degC lie close together and were taken as a run each"
    return Runs(level, labels, (note,))


def _split_at(temperature: Array, gap: float) -> Ints:
    order = np.argsort(temperature, kind="stable")  # unknown ones, NaN, come last
    ordered = temperature[order]
    jump = (np.diff(ordered) > gap) | (np.isnan(ordered[1:]) & ~np.isnan(ordered[:-1]))
    level = np.empty(temperature.size, dtype=np.int64)
    level[order] = np.concatenate([[0], np.cumsum(jump)])
    return level


def _spans(temperature: Array, level: Ints) -> Array:
    """Highest minus lowest temperature of each level; NaN of the unknown ones."""
    order = np.lexsort((temperature, level))
    last = np.cumsum(np.bincount(level)) - 1
    first = np.concatenate([[0], last[:-1] + 1])
    span: Array = temperature[order][last] - temperature[order][first]
    return span


def _labels(temperature: Array, level: Ints, digits: int) -> tuple[str, ...]:
    means = np.bincount(level, weights=temperature) / np.bincount(level)
    labels = [f"{round(mean, digits) + 0.0:g}" for mean in means.tolist()]  # no minus zero
    return tuple("unknown" if label == "nan" else label for label in labels)


def _of_mountings(levels: Runs, mounting: NDArray[np.str_]) -> Runs:
    """Levels at which the unit was mounted in several ways, split by the mountings."""
    sides, side = np.unique(mounting, return_inverse=True)
    pairs, index = np.unique(levels.index * sides.size + side.reshape(-1), return_inverse=True)
    level, place = np.divmod(pairs, sides.size)
    several = np.bincount(level)[level] > 1
    names = [
        f"{levels.labels[r]} {sides[i]}" if split else levels.labels[r]
        for r, i, split in zip(level.tolist(), place.tolist(), several.tolist(), strict=True)
    ]
    return replace(levels, index=index.reshape(-1).astype(np.int64), labels=tuple(names))


def _no_level(readings: Readings, level: Mask) -> TableError:
    low = readings.temperature[level].min()
    high = int(np.argmax(level & (readings.temperature > low + LEVEL_GAP)))
    problem = (
        f"temperature {readings.temperature[high]:g} joins the level that starts at {low:g} degC,"
        f" more than {LEVEL_GAP:g} degC away"
    )
    return readings.refuse(high, problem, "tell the runs apart by a column run")


# -- visits ----------------------------------------------------------------------------------------


class _Segments(NamedTuple):
    """Stretches of rows of one level, in an order that may be that of measuring."""

    order: Ints  # of the readings
    of_row: Ints  # segment of each reading, in this order
    level: Ints  # level of each segment
    places: Ints  # number of different head positions in each

    def rows(self, segment: int) -> Ints:
        """Readings of one segment."""
        start, end = np.searchsorted(self.of_row, [segment, segment + 1])
        return self.order[start:end]

    @property
    def repeated(self) -> Mask:
        """Whether the level of a segment has others."""
        return np.bincount(self.level)[self.level] > 1

    @property
    def whole(self) -> Mask:
        """Whether all segments of its level hold two head positions or more."""
        poor = np.bincount(self.level, weights=self.places < 2)
        return np.asarray(poor[self.level] == 0)


def _visits(readings: Readings, levels: Runs) -> tuple[Runs, Ints]:
    """Levels split by their visits, and the order of measuring."""
    rows = np.arange(readings.output.size)
    if len(levels.labels) == 1:
        return levels, rows
    readings = replace(readings, angle=nominal_angles(readings.angle))
    unknown = np.isnan(readings.temperature)
    known = np.flatnonzero(~unknown)
    by_time = _segments_in_time(readings, levels.index, known)
    found = by_time or _segments(readings, levels.index, known)
    visit, open_levels = np.zeros(found.level.size, dtype=np.int64), []
    for level in distinct(found.level[found.repeated]).tolist():
        at = np.flatnonzero(found.level == level)
        if found.whole[at[0]]:
            visit[at] = range(at.size) if by_time else _proved(readings, found, at)
        if not visit[at].any() and not _only_repeated(readings, found, at):
            open_levels.append(levels.labels[level])
    runs = _renamed(levels, found, visit, readings)
    order = np.concatenate([found.order, rows[unknown]]) if by_time else rows
    return replace(runs, notes=(*runs.notes, *_open(open_levels))), order


def _segments(readings: Readings, level: Ints, order: Ints) -> _Segments:
    rows = level[order]
    of_row = np.cumsum(np.concatenate([[0], rows[1:] != rows[:-1]])[: rows.size]).astype(np.int64)
    first = np.unique(of_row, return_index=True)[1]
    angle = head_positions(readings.angle[order])
    places = np.bincount(_first_of_different_pairs(of_row, angle))
    return _Segments(order, of_row, rows[first], places)


def _first_of_different_pairs(first: Ints, second: NDArray[Any]) -> Ints:
    different, place, _ = grouped(second)
    return distinct(first * different.size + place) // different.size


def _segments_in_time(readings: Readings, level: Ints, known: Ints) -> _Segments | None:
    """Segments in the order of time; None where the times do not tell it.

    Times that count from zero in each run anew mix the levels: they coincide, or tear them into
    single readings.
    """
    if readings.time is None:
        return None
    order = known[np.argsort(readings.time[known], kind="stable")]
    time, rows = readings.time[order], level[order]
    if ((time[1:] == time[:-1]) & (rows[1:] != rows[:-1])).any():
        return None
    found = _segments(readings, level, order)
    return found if found.whole[found.repeated].all() else None


def _proved(readings: Readings, found: _Segments, segments: Ints) -> list[int]:
    """Visit of each segment of one level, a new one where its readings prove it."""
    by_stroke = _sorted_by_stroke(readings, found)
    visits, visit = [], 0
    so_far: dict[Any, float] = {}
    for segment in segments.tolist():
        now = _outputs(readings, found.rows(segment))
        again = any(so_far[key] != now[key] for key in so_far.keys() & now.keys())
        if again or (not by_stroke and _counts_on(so_far, now)):
            visit, so_far = visit + 1, {}
        so_far |= now
        visits.append(visit)
    return visits


def _outputs(readings: Readings, rows: Ints) -> dict[Any, float]:
    """Output by mounting, stroke and head angle."""
    fields = (readings.mounting, readings.stroke, readings.angle, readings.output)
    columns = [field[rows].tolist() for field in fields]
    return {(side, k, angle): y for side, k, angle, y in zip(*columns, strict=True)}


def _only_repeated(readings: Readings, found: _Segments, segments: Ints) -> bool:
    """Tell whether the later segments hold nothing but readings of the first, again."""
    first, *later = (_outputs(readings, found.rows(i)).items() for i in segments.tolist())
    return all(segment <= first for segment in later)


def _counts_on(before: dict[Any, float], now: dict[Any, float]) -> bool:
    """Tell whether the strokes of a mounting go on counting, or begin anew below the former."""
    for side in {key[0] for key in before} & {key[0] for key in now}:
        former = {key[1] for key in before if key[0] == side}
        new = {key[1] for key in now if key[0] == side}
        if min(new) > max(former) or max(new) < min(former):
            return True
    return False


def _sorted_by_stroke(readings: Readings, found: _Segments) -> bool:
    """Tell whether the rows may have been sorted by a stroke that several levels have."""
    stroke = readings.stroke[found.order]
    of_levels = _first_of_different_pairs(stroke, found.level[found.of_row])
    shared = distinct(of_levels).size < of_levels.size
    steps = np.diff(stroke)
    return bool(shared and ((steps >= 0).all() or (steps <= 0).all()))


def _renamed(levels: Runs, found: _Segments, visit: Ints, readings: Readings) -> Runs:
    """Runs by level and visit; later visits get a number behind their name."""
    if not visit.any():
        return levels
    number = np.zeros(levels.index.size, dtype=np.int64)
    number[found.order] = visit[found.of_row]
    pairs, index = np.unique(np.stack([levels.index, number], axis=1), axis=0, return_inverse=True)
    index = np.asarray(index, dtype=np.int64).reshape(-1)
    names = [levels.labels[level] + (f" ({n + 1})" if n else "") for level, n in pairs.tolist()]
    again = np.flatnonzero(pairs[:, 1] > 0).tolist()
    starts = [int(readings.line[index == i].min()) for i in again]
    made = ", ".join(f"'{names[i]}'" for i in again)
    note = f"a temperature was met again ({lines_named(starts)}): a new run there, {made}"
    if len(np.unique(pairs[again, 0])) == len(levels.labels) > 1:  # as where units are stacked
        note += "; if that is another accelerometer, name it in a column serial"
    return Runs(index, tuple(names), (*levels.notes, note))


def _open(labels: list[str]) -> list[str]:
    if not labels:
        return []
    return [
        f"other temperatures stand between the rows of level {', '.join(labels)} degC, which were"
        " taken as one run; if it was met again, name each visit in a column run"
    ]


_JOINED = "taken to the level of the rows around"
_APART = "taken as a run apart: write the temperature, or name the run in a column run"


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
        f"temperature missing in {counted(int(own.sum()), 'reading')}, {said}"
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
