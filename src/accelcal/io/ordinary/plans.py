"""Where the readings of ordinary tables were taken: angles, strokes, mountings, runs.

The rules are those of `readings` and `runs`, for many tests at once. A test of which they have
more to say than the plain reading is odd here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arguments.temperatures import outside_tests
from accelcal.arrays import Array, Ints, Mask
from accelcal.geometry import MOUNTINGS
from accelcal.head_angles import angular_distance
from accelcal.io.ordinary.cell_blocks import CellBlock
from accelcal.io.runs import LEVEL_GAP, are_counted
from accelcal.io.values.markers import FARTHEST_ALIKE, FEWEST_OTHERS, LONE
from accelcal.io.values.places import MAXIMUM_ANGLE
from accelcal.io.words.vocabulary import mounting_written
from accelcal.numerics.grouping import distinct, grouped


class Stretches(NamedTuple):
    """Rows in stretches that follow each other."""

    start: Ints  # first row of each stretch
    size: Ints  # number of its rows, one or more

    @classmethod
    def of(cls, size: Ints) -> Stretches:
        """Stretches of some sizes, from the first row on."""
        return cls(np.cumsum(size) - size, size)

    def some(self, places: Ints | Mask) -> Stretches:
        """Return some of the stretches, their rows where they were."""
        return Stretches(self.start[places], self.size[places])

    @property
    def of_row(self) -> Ints:
        """Stretch of each row."""
        return np.repeat(np.arange(self.size.size), self.size)

    def changes(self, values: NDArray[Any]) -> Mask:
        """Mask of the rows whose value is not that of the row before in their stretch."""
        change: Mask = np.concatenate([[True], values[1:] != values[:-1]])
        change[self.start] = True
        return change

    def any(self, rows: Mask) -> Mask:
        """Mask of the stretches with one of the rows of a mask."""
        return np.asarray(np.logical_or.reduceat(rows, self.start))

    def lowest(self, values: NDArray[Any]) -> NDArray[Any]:
        """Smallest value of each stretch."""
        return np.asarray(np.minimum.reduceat(values, self.start))

    def highest(self, values: NDArray[Any]) -> NDArray[Any]:
        """Largest value of each stretch."""
        return np.asarray(np.maximum.reduceat(values, self.start))

    def cut(self, values: NDArray[Any]) -> list[NDArray[Any]]:
        """Values of each stretch, not to be changed."""
        values.setflags(write=False)
        ends = (self.start + self.size).tolist()
        return [values[start:end] for start, end in zip(self.start.tolist(), ends, strict=True)]


class Parts(NamedTuple):
    """The rows of one accelerometer each."""

    rows: Stretches  # their rows
    table: Ints  # table of each part; each table has one or more
    code: Ints  # number of its serial
    again: Mask  # which have a serial that their table had before


def parts_of(serial: Ints | None, tables: Stretches) -> Parts:
    """Divide the rows of tables by their serials.

    `serial` has a number for that of each row, where the tables have such a column. The parts are
    in the order of the rows.
    """
    if serial is None:
        table = np.arange(tables.size.size)
        nothing = np.zeros_like(table)
        return Parts(tables, table, nothing, nothing > 0)
    start = np.flatnonzero(tables.changes(serial))
    table = np.searchsorted(tables.start, start, side="right") - 1
    stretches = Stretches(start, np.diff(start, append=serial.size))
    return Parts(stretches, table, serial[start], met_before(table, serial[start]))


def met_before(group: Ints, code: Ints) -> Mask:
    """Mask of the entries whose group had their code before.

    Examples
    --------
    >>> met_before(np.array([0, 0, 0, 1]), np.array([7, 8, 7, 7])).tolist()
    [False, False, True, False]
    """
    order = np.lexsort((code, group))  # stable
    again = np.zeros(order.size, dtype=bool)
    same = (group[order][1:] == group[order][:-1]) & (code[order][1:] == code[order][:-1])
    again[order[1:][same]] = True
    return again


class Leading(NamedTuple):
    """Stretches that differ from the one before."""

    places: slice | Ints  # their rows among all
    rows: Stretches  # the same rows, one below the other
    of: Ints  # for each stretch of all, which of these it is, or repeats


def leading_of(stretches: Stretches, columns: Sequence[NDArray[Any]]) -> Leading:
    """Find the stretches that differ from the one before.

    Those that have not as many rows as most lead as well. The columns, one entry a row, are what
    they may differ in.

    Examples
    --------
    >>> leading_of(Stretches.of(np.array([2, 2, 2])), [np.array([1, 2, 1, 2, 1, 3])]).of.tolist()
    [0, 0, 1]
    """
    leads = ~_repeats(stretches, columns)
    if leads.all():
        return Leading(slice(None), stretches, np.arange(leads.size))
    places = np.flatnonzero(np.repeat(leads, stretches.size))
    return Leading(places, Stretches.of(stretches.size[leads]), np.cumsum(leads) - 1)


def _repeats(stretches: Stretches, columns: Sequence[NDArray[Any]]) -> Mask:
    """Mask of the stretches that have the usual size and are as the one before."""
    size = stretches.size
    usual = int(np.sort(size)[size.size // 2])
    again: Mask = np.concatenate([[False], (size[1:] == usual) & (size[:-1] == usual)])
    if again.any():
        same = np.zeros(columns[0].size, dtype=bool)
        bits = [c.view(f"i{c.itemsize}") for c in columns]  # in which -0 is not 0
        same[usual:] = np.logical_and.reduce([b[usual:] == b[:-usual] for b in bits])
        again &= np.logical_and.reduceat(same, stretches.start)
    return again


PLANNED = frozenset({"temperature", "stroke", "position", "angle", "run", "mounting"})
"""Columns that tell where a reading was taken, not what it was."""

_MOST = 10_000  # strokes, positions: more are no ordinary test


class Plans(NamedTuple):
    """Where the readings of some tests were taken, as a `TumbleRecord` has it, test after test."""

    temperature: Array
    angle: Array
    stroke: Ints
    position: Ints
    mounting: Ints  # by its place in `MOUNTINGS`
    run: Ints
    run_labels: list[tuple[str, ...]]  # of each test
    odd: Mask  # tests that need the general reader


def read_plans(cells: CellBlock, tests: Stretches, positions: int) -> Plans:
    """Read where the readings of some tests were taken.

    The columns are temperature, stroke, position or angle, and those of run and mounting that there
    are; the tests are the rows of each.
    """
    numbers, odd = without_gaps(cells.numbers)
    temperature, stroke = numbers["temperature"], numbers["stroke"]
    odd |= outside_tests(temperature)
    odd |= ~_is_whole(stroke, _MOST)
    position, angle, misplaced = _places(numbers, positions)
    mounting, unknown = _mounting(cells, stroke.size)
    run, labels, odd_runs = _runs(temperature, cells, tests)
    for role, codes in cells.codes.items():
        odd |= cells.odd_labels(role, codes)
    odd_tests = tests.any(odd | misplaced | unknown) | odd_runs
    if "run" not in cells.codes:  # each mounting is a run of its own then
        odd_tests |= tests.highest(mounting) > tests.lowest(mounting)
    strokes = np.clip(stroke, 1, _MOST).astype(np.int64)  # odd rows may hold anything
    place = position if position.any() else _codes(angle, int(tests.size[0]))
    odd_tests |= _has_twice(tests, run, mounting, strokes, place)
    return Plans(temperature, angle, strokes, position, mounting, run, labels, odd_tests)


def without_gaps(numbers: Mapping[str, Array]) -> tuple[Mapping[str, Array], Mask]:
    """Columns with 1 in the rows where one of them is not finite, and a mask of these rows."""
    odd: Mask = ~np.logical_and.reduce([np.isfinite(values) for values in numbers.values()])
    if odd.any():
        numbers = {role: np.where(odd, 1.0, values) for role, values in numbers.items()}
    return numbers, odd


# -- rows ------------------------------------------------------------------------------------------


def _is_whole(values: Array, most: float) -> Mask:
    return np.asarray((values >= 1.0) & (values <= most) & (values == np.floor(values)))


def _places(numbers: Mapping[str, Array], positions: int) -> tuple[Ints, Array, Any]:
    """Position, head angle, and which rows have none that is ordinary."""
    if "position" not in numbers:
        angle = numbers["angle"]
        return np.zeros(angle.size, dtype=np.int64), angle, np.abs(angle) > MAXIMUM_ANGLE
    odd = ~_is_whole(numbers["position"], min(positions + 1, _MOST))
    position = np.where(odd, 1, numbers["position"]).astype(np.int64)
    nominal = (position - 1) * 360.0 / positions
    if "angle" not in numbers:
        return position, nominal, odd
    angle = numbers["angle"]
    away = angular_distance(angle, nominal) > 180.0 / positions
    return position, angle, odd | away | (np.abs(angle) > MAXIMUM_ANGLE)


def _mounting(cells: CellBlock, size: int) -> tuple[Ints, Any]:
    """Mounting of each row as a place in `MOUNTINGS`, and which rows have none that is known."""
    if "mounting" not in cells.codes:
        return np.zeros(size, dtype=np.int64), False
    names = [mounting_written(name) for name in cells.labels["mounting"]]
    place = np.array([MOUNTINGS.index(name) if name in MOUNTINGS else -1 for name in names])
    of_row = place[cells.codes["mounting"]]
    return np.maximum(of_row, 0), of_row < 0


# -- tests -----------------------------------------------------------------------------------------


def _runs(
    temperature: Array, cells: CellBlock, tests: Stretches
) -> tuple[Ints, list[tuple[str, ...]], Mask]:
    """Runs in the order of the rows, their names, and which tests have one that comes back."""
    if "run" in cells.codes:
        code, odd = cells.codes["run"], np.zeros(tests.size.size, dtype=bool)
    else:
        code, odd = _levels(temperature, tests)
    start = np.flatnonzero(tests.changes(code))
    owner = tests.of_row[start]
    odd[owner[met_before(owner, code[start])]] = True
    runs = Stretches(start, np.diff(start, append=code.size))
    odd[owner[_may_have_lone(temperature, runs)]] = True
    run = runs.of_row
    if "run" in cells.codes:
        labels = [cells.labels["run"][i] for i in code[start].tolist()]
    else:
        labels = _degrees(np.bincount(run, weights=temperature) / np.bincount(run))
    first = np.searchsorted(owner, np.arange(tests.size.size + 1))
    own = [tuple(labels[begin:end]) for begin, end in pairwise(first.tolist())]
    if "run" in cells.codes:
        odd |= _come_unlike_counted(own)
    return run - np.repeat(first[:-1], tests.size), own, odd


def _may_have_lone(temperature: Array, runs: Stretches) -> Mask:
    """Tell which runs may have a temperature far from all others, by how far off their mean is."""
    low, high = runs.lowest(temperature), runs.highest(temperature)
    mean = np.add.reduceat(temperature, runs.start) / runs.size
    least = FEWEST_OTHERS / (FEWEST_OTHERS + 1) * LONE / (LONE + 1.0)
    off = np.maximum(high - mean, mean - low) > least * (high - low) * (1.0 - 1e-9)
    return np.asarray(off & (high - low > FARTHEST_ALIKE) & (runs.size > FEWEST_OTHERS))


def _come_unlike_counted(labels: Sequence[tuple[str, ...]]) -> Mask:
    """Tests whose runs are numbered, but in another order."""
    unlike = {own: are_counted(own) and own != (*sorted(own, key=int),) for own in set(labels)}
    return np.array([unlike[own] for own in labels])


def _levels(temperature: Array, tests: Stretches) -> tuple[Ints, Mask]:
    """Levels of temperature, as `runs` splits them, and which tests have a wide one."""
    odd = np.zeros(tests.size.size, dtype=bool)
    start = np.flatnonzero(tests.changes(temperature))  # stretches of one, to be put in order
    owner, value = tests.of_row[start], temperature[start]
    order = np.lexsort((value, owner))
    ordered = value[order]
    jump = (np.diff(ordered) > LEVEL_GAP) | (owner[1:] > owner[:-1])  # owners are in order
    first = np.concatenate([[0], np.flatnonzero(jump) + 1])
    last = np.append(first[1:], order.size) - 1
    odd[owner[first[ordered[last] - ordered[first] > LEVEL_GAP]]] = True
    level = np.empty(order.size, dtype=np.int64)
    level[order] = np.concatenate([[0], np.cumsum(jump)])
    return np.repeat(level, np.diff(start, append=temperature.size)), odd


def _degrees(means: Array) -> list[str]:
    """Names of runs by their mean temperatures."""
    degrees = (np.rint(means) + 0.0).tolist()  # + 0.0 makes -0 a 0
    label = {degree: f"{degree:g}" for degree in set(degrees)}
    return [label[degree] for degree in degrees]


def _has_twice(tests: Stretches, *codes: Ints) -> Mask:
    """Tests with two rows of the same codes."""
    key, size = tests.of_row, 1
    for code in codes:
        span = int(code.max()) + 1
        key = key * span + code
        size *= span
    odd = np.zeros(tests.size.size, dtype=bool)
    odd[_met_twice(key) // size] = True
    return odd


def _codes(values: Array, few: int) -> Ints:
    """Number the values so that equal ones have one number; all are mostly among the first few."""
    known = distinct(values[:few])
    code = np.minimum(np.searchsorted(known, values), known.size - 1)
    return code if (known[code] == values).all() else grouped(values)[1]


def _met_twice(key: Ints) -> Ints:
    if key.max() < 8 * key.size:  # counting is quicker than sorting
        return np.flatnonzero(np.bincount(key) > 1)
    key = np.sort(key)
    return np.asarray(key[1:][key[1:] == key[:-1]])
