"""Cells of a frame, column by column: from rows, and of several parts put together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from accelcal.archive.columns import FrameColumn

__all__ = ["Cells", "Columns", "columns_of_rows", "put_together"]

Cells = list[Any] | NDArray[np.float64]
"""Cells of a column: an array of numbers, NaN where there is none, or a list of whatever is no
number, None where there is nothing."""

Columns = dict[str, Cells]
"""Cells of a frame by the name of the column."""


def columns_of_rows(rows: Sequence[Sequence[Any]], kinds: Mapping[str, FrameColumn]) -> Columns:
    """Turn rows into columns.

    Parameters
    ----------
    rows : sequence of sequence
        Cells in the order of the columns, None where there is nothing.
    kinds : mapping of str to FrameColumn
        The columns.

    Returns
    -------
    mapping of str to list or ndarray
        Cells by column.

    Examples
    --------
    >>> from accelcal.archive.columns import ROWS
    >>> columns_of_rows([["20", 1.35], ["60", None]], {name: ROWS[name] for name in ("run", "K1")})
    {'run': ['20', '60'], 'K1': array([1.35,  nan])}
    """
    columns = map(list, zip(*rows, strict=True)) if rows else ([] for _ in kinds)
    return {
        name: np.array(column, dtype=np.float64) if kinds[name].kind == "number" else column
        for name, column in zip(kinds, columns, strict=True)
    }


def put_together(parts: Sequence[Columns], order: NDArray[np.intp] | None = None) -> Columns:
    """Put parts of a frame below each other.

    Parameters
    ----------
    parts : sequence of mapping
        Parts with the same columns, one or more.
    order : ndarray of int, optional
        Place in that frame of each row that is wanted; by default all as they come.

    Returns
    -------
    mapping of str to list or ndarray
        Cells by column.
    """
    return {name: _joined([part[name] for part in parts], order) for name in parts[0]}


def _joined(parts: Sequence[Cells], order: NDArray[np.intp] | None) -> Cells:
    if isinstance(parts[0], np.ndarray):
        numbers = np.concatenate(parts)
        return numbers if order is None else numbers[order]
    cells = [cell for part in parts for cell in part]
    return cells if order is None else [cells[i] for i in order.tolist()]
