"""Cells of a frame, column by column, and those of several parts put together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from accelcal.archive.columns import FrameColumn
from accelcal.arrays import Array, Places


class Labels(NamedTuple):
    """Cells that are no numbers, most of which come again.

    Attributes
    ----------
    code : ndarray of int
        Place of each cell among the values.
    values : list
        What the cells hold, None for nothing.

    Examples
    --------
    >>> Labels(np.array([0, 0, 1]), ["o+", None]).cells()
    ['o+', 'o+', None]
    """

    code: Places
    values: list[Any]

    @classmethod
    def of(cls, cells: Sequence[Any]) -> Labels:
        """Find the values of cells."""
        values = list(dict.fromkeys(cells))
        if len(values) == len(cells):
            return cls(np.arange(len(cells)), values)
        places = {value: place for place, value in enumerate(values)}
        return cls(np.fromiter(map(places.__getitem__, cells), np.intp, len(cells)), values)

    def taken(self, places: Places) -> Labels:
        """Those of some cells."""
        return self._replace(code=self.code[places])

    def cells(self, values: Sequence[Any] | None = None) -> list[Any]:
        """List the cells, by other values where these are given."""
        known = self.values if values is None else values
        return [known[i] for i in self.code.tolist()]


Cells = Array | Labels
"""Cells of a column: numbers, NaN where there is none, or labels."""

Columns = dict[str, Cells]
"""Cells of a frame by the name of the column."""


def no_rows(kinds: Mapping[str, FrameColumn]) -> Columns:
    """Make a frame without rows.

    Parameters
    ----------
    kinds : mapping of str to FrameColumn
        The columns.

    Returns
    -------
    mapping of str to Labels or ndarray
        No cells by column.
    """
    return {
        name: np.zeros(0) if column.kind == "number" else Labels.of([])
        for name, column in kinds.items()
    }


def put_together(parts: Sequence[Columns], order: Places | None = None) -> Columns:
    """Put parts of a frame below each other.

    Parameters
    ----------
    parts : sequence of mapping
        Parts with the same columns, one or more.
    order : ndarray of int, optional
        Place in that frame of each row that is wanted; by default all as they come.

    Returns
    -------
    mapping of str to Labels or ndarray
        Cells by column.
    """
    return {name: _joined([part[name] for part in parts], order) for name in parts[0]}


def _joined(parts: Sequence[Cells], order: Places | None) -> Cells:
    rows = slice(None) if order is None else order
    labels = [part for part in parts if isinstance(part, Labels)]
    if not labels:
        return np.concatenate([part for part in parts if not isinstance(part, Labels)])[rows]
    starts = np.cumsum([0, *(len(part.values) for part in labels)])
    codes = [part.code + start for part, start in zip(labels, starts.tolist(), strict=False)]
    values = [value for part in labels for value in part.values]
    return Labels(np.concatenate(codes)[rows], values)
