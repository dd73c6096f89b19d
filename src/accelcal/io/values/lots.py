"""The lot of a unit, from a line above its table or from a column."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from accelcal.arguments.kinds import shown
from accelcal.io.values.cells import Column
from accelcal.io.words.vocabulary import COLUMNS, is_missing

_NAMES = frozenset(COLUMNS["lot"])


def declared_lot(metadata: Mapping[str, str]) -> str | None:
    """Lot that a header line names.

    Examples
    --------
    >>> declared_lot({"operator": "Meyer", "Los": "7"})
    '7'
    """
    for key, text in metadata.items():  # a generator would take twice the time of a record
        if key.casefold() in _NAMES:
            return text
    return None


def lots_of_rows(column: Column) -> NDArray[np.str_]:
    """Lots of a column, empty where the cell says that it is missing."""
    cells = [str(cell) for cell in column.cells]
    return np.array(["" if is_missing(cell) else cell for cell in cells])


def lot_of_column(
    lots: NDArray[np.str_] | None, metadata: Mapping[str, str]
) -> tuple[dict[str, str], list[str]]:
    """Metadata with the lot of one unit, and what is set aside.

    The lots are those of its readings, as of `lots_of_rows`. There is none where the column names
    none, or several. A sentence tells of several, and of another one than is declared.

    Examples
    --------
    >>> lot_of_column(np.array(["7", "", "7"]), {})
    ({'lot': '7'}, [])
    """
    names = [] if lots is None else sorted({*lots.tolist()} - {""})
    declared = declared_lot(metadata)
    if names in ([], [declared]):
        return {}, []
    if len(names) > 1:
        several = shown(", ".join(names))
        return {}, [f"the column of lots names several for one unit, {several}, and was set aside"]
    if declared is not None:
        return {}, [f"the lot is {declared}, as declared, in place of {names[0]} in the column"]
    return {"lot": names[0]}, []
