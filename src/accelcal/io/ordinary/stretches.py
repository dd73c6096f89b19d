"""Rows of many ordinary tables in stretches, and which of these repeat the one before.

Tests of one plan differ in their readings, and in little else: what stretches have in common with
the one before them is judged once, and kept once.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Ints, Mask


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
