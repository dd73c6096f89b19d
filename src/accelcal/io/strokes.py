"""Numbers of strokes, from a column of them alone or with one of directions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Ints, Mask
from accelcal.io.cells import Column, labels, whole_numbers
from accelcal.io.signs import with_hyphen

_FORWARD = frozenset(
    {"forward", "forwards", "fwd", "fw", "f", "+", "+1", "1"}
    | {"vorwärts", "vor", "hin", "aller", "прямой", "прямо"}
)
_BACK = frozenset(
    {"back", "backward", "backwards", "bwd", "bw", "b", "return", "reverse", "rev", "r", "-", "-1"}
    | {"rückwärts", "rück", "zurück", "retour", "обратный", "обратно"}
)

_ASIDE = "column direction does not tell forward from back and was set aside"
_BY_CYCLE = (
    "strokes are numbered by cycle, as the column direction shows: they were counted anew, odd ones"
    " forward and even ones back"
)

_FEW = 0.25
"""Part of the readings against the direction of their stroke that may still be mistakes."""


class Directions(NamedTuple):
    """Direction of each row, as a column names it.

    Attributes
    ----------
    column : Column
        The column.
    label : ndarray of int, shape (n,)
        Index of each cell's label.
    back : ndarray of float
        1 for each label that means back, 0 for forward, NaN for a word that is not known.
    """

    column: Column
    label: Ints
    back: Array

    @classmethod
    def of(cls, column: Column) -> Directions:
        """Read a column of directions."""
        label, names = labels(column)
        words = [with_hyphen(name.casefold()) for name in names]
        return cls(column, label, np.array([_sign(word) for word in words]))

    def strokes(self, number: Ints, row: Ints) -> tuple[Ints, tuple[str, ...]]:
        """Count strokes by number and direction.

        Parameters
        ----------
        number : ndarray of int, shape (m,)
            Number of each reading's stroke, or of its cycle of one stroke forward and one back.
        row : ndarray of int, shape (m,)
            Row of each reading.

        Returns
        -------
        ndarray of int, shape (m,)
            Numbers of the strokes, odd ones forward and even ones back.
        tuple of str
            How they were counted, where not as `number` has them, or that the column was set aside.

        Raises
        ------
        TableError
            Where a direction has no known name, or few readings are against that of their stroke.
        """
        label, even = self.label[row], number % 2 == 0
        if self._tell_what_numbers_tell(label, even):
            return number, ()
        if self._tell_something_else(label, number):
            return number, (_ASIDE,)
        known = ~np.isnan(self.back)[self.label]
        self.column.check(known, "{} is neither forward nor back", "write forward or back")
        back = self.back[label] == 1.0
        against: Mask = back != even
        if against.mean() < _FEW:
            wrong = np.ones(self.label.size, dtype=bool)
            wrong[row[against]] = False
            remedy = "odd strokes go forward and even ones back, so correct one of both"
            self.column.check(wrong, "{} contradicts the number of the stroke", remedy)
        strokes = np.where(back, 2 * number, 2 * number - 1)
        return strokes, (f"{_BY_CYCLE}, up to {strokes.max()}",)

    def _tell_what_numbers_tell(self, label: Ints, even: Mask) -> bool:
        """Whether odd strokes have one direction and even ones another, whatever its name."""
        evens = np.bincount(label, even, minlength=self.back.size)
        whole = np.bincount(label, minlength=self.back.size)
        if not np.isnan(self.back[whole > 0]).any():
            return bool(np.array_equal(evens, np.where(whole > 0, self.back, 0.0) * whole))
        odd, both = (whole > 0) & (evens == 0), (evens > 0) & (evens < whole)
        return not both.any() and odd.sum() <= 1 and (evens > 0).sum() <= 1

    def _tell_something_else(self, label: Ints, number: Ints) -> bool:
        """Whether no word is known, and none changes within a stroke, as that of heating."""
        within = (np.diff(number) == 0) & (np.diff(label) != 0)
        return bool(np.isnan(self.back).all() and not within.any())


def _sign(word: str) -> float:
    return 0.0 if word in _FORWARD else 1.0 if word in _BACK else np.nan


def strokes_of_rows(column: Column) -> Ints:
    """Return the number of the stroke in each row.

    Raises
    ------
    TableError
        At the first cell that is no whole number from 1.
    """
    stroke = whole_numbers(column, "strokes count from 1, odd ones go forward and even ones back")
    column.check(stroke > 0, "{} is missing", "write the stroke in every row")
    return stroke
