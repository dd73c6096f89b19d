"""Records from arrays in memory: they are set as a table and read by the rules of tables."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from accelcal.errors import InputError
from accelcal.io.tables import read_table
from accelcal.record import TumbleRecord

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["read_arrays"]

_NAME = "<arrays>"


def read_arrays(
    columns: Mapping[str, Any] | pd.DataFrame, *, overrides: Mapping[str, object] | None = None
) -> TumbleRecord:
    """Make a record of arrays or of a DataFrame.

    Parameters
    ----------
    columns : mapping of str to array_like of shape (n,), or pandas.DataFrame
        Columns by the headings that a table may have, such as ``"position"``, ``"stroke"``,
        ``"output"`` or ``"Y [mA]"``. A single value stands for all readings.
    overrides : mapping of str to object, optional
        Declarations, as for `read_table`.

    Returns
    -------
    TumbleRecord
        The readings. Their lines are those of the table: row i of the arrays, from 0, is line
        i + 2, below the headings.

    Raises
    ------
    InputError
        If the columns do not fit together.
    TableError
        If they break a rule of tables; the message names the line and the remedy.

    Notes
    -----
    The arrays pass through text, so that one set of rules holds for files and arrays. Numbers keep
    all their digits. A missing number is NaN or None.

    Examples
    --------
    >>> import numpy as np
    >>> import accelcal
    >>> position = np.arange(1, 9)
    >>> output = 1.35 * np.cos(np.radians(45.0 * (position - 1)))
    >>> columns = {"position": position, "stroke": 1, "temperature": 20.0, "Y [mA]": output}
    >>> accelcal.read_arrays(columns, overrides={"serial": "AL-15"})
    <TumbleRecord serial 'AL-15': 8 readings, 1 runs, 8 positions>
    """
    arrays = _arrays(columns)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(arrays)
    writer.writerows(zip(*map(_cells, arrays.values()), strict=True))
    source = io.StringIO(text.getvalue())
    source.name = _NAME  # where a file has its name, for messages
    return read_table(source, overrides=overrides)


def _arrays(columns: Mapping[str, Any] | pd.DataFrame) -> dict[str, NDArray[Any]]:
    """Columns by their names, single values repeated."""
    if not hasattr(columns, "items"):
        raise InputError(
            f"{type(columns).__name__} in place of columns; give a mapping of names to arrays, or a"
            " DataFrame"
        )
    arrays = {str(name): np.asarray(values) for name, values in columns.items()}
    sizes = {array.size for array in arrays.values() if array.ndim}
    if len(sizes) > 1 or any(array.ndim > 1 for array in arrays.values()):
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
        raise InputError(f"columns of different shapes, {shapes}; all have the shape (n,)")
    size = max(sizes, default=1)
    return {name: np.broadcast_to(array, size) for name, array in arrays.items()}


def _cells(array: NDArray[Any]) -> list[Any]:
    """Plain numbers and texts of one line each."""
    if array.dtype.kind == "M":
        array = np.datetime_as_string(array, unit="us")
    cells: list[Any] = array.tolist()
    if array.dtype.kind in "OSU":
        cells = ["" if cell is None else " ".join(str(cell).split()) for cell in cells]
    return cells
