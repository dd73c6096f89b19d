"""Records from arrays in memory: they are set as a table and read by the rules of tables."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from dataclasses import fields, replace
from itertools import zip_longest
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from accelcal.apparatus import Apparatus
from accelcal.arguments.numbers import refuse_other_order
from accelcal.errors import InputError, TableError
from accelcal.io.declarations import declared_by_caller
from accelcal.io.files.csv_text import cell_text, csv_text
from accelcal.io.layout.heading_rows import is_apart
from accelcal.io.tables import ONE_AT_A_TIME, read_table
from accelcal.io.words.headings import read_heading, split_unit
from accelcal.io.words.vocabulary import LABELS
from accelcal.record import TumbleRecord

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["read_arrays"]

_NAME = "<arrays>"
_NO_LABEL = ("None", "nan", "<NA>", "NaT")
_LINE = re.compile(r"a line '# (\w+): (\w+)'")


def read_arrays(
    columns: Mapping[str, Any] | pd.DataFrame | NDArray[Any],
    *,
    overrides: Mapping[str, object] | None = None,
) -> TumbleRecord:
    """Make a record of arrays, of a DataFrame or of an array with fields.

    Parameters
    ----------
    columns : mapping of str to array_like of shape (n,), pandas.DataFrame, or structured array
        Columns by the headings that a table may have, such as ``"position"``, ``"stroke"``,
        ``"output"`` or ``"Y [mA]"``. A single value stands for all readings. Levels of an index
        that have names are columns too. A mapping of columns to units in ``frame.attrs["units"]``
        counts as units in the headings, and ``frame.attrs["declared"]``, as of
        `TumbleRecord.to_frame`, declares what neither columns nor `overrides` do.
    overrides : mapping of str to object, optional
        Declarations, as for `read_tables`.

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
    all their digits. A missing number is NaN, None or masked.

    Examples
    --------
    >>> import numpy as np
    >>> import accelcal
    >>> position = np.arange(1, 9)
    >>> output = 1.35 * np.cos(np.radians(45.0 * (position - 1)))
    >>> columns = {"position": position, "stroke": 1, "temperature": 20.0, "Y [mA]": output}
    >>> accelcal.read_arrays(columns, overrides={"serial": "AL-15"})
    <TumbleRecord serial 'AL-15': 8 readings, 1 run, 8 positions>
    """
    arrays = _arrays(columns)
    rows = zip(*(_cells(*column) for column in arrays), strict=True)
    source = io.StringIO(csv_text([[name for name, _ in arrays], *rows]))
    source.name = _NAME  # where a file has its name, for messages
    declared = getattr(columns, "attrs", {}).get("declared", {})
    turn = {name: value for name, value in declared.items() if name == "positions"}
    try:
        record = read_table(source, overrides=turn | declared_by_caller(overrides))
    except TableError as error:
        raise _of_arrays(error) from None
    return _declared(record, declared) if declared else record


def _of_arrays(error: TableError) -> TableError:
    """Word a remedy for columns, which have no header lines."""
    remedy = _LINE.sub(r"one value for all readings, {'\1': \2}", error.remedy)
    remedy = remedy.replace(ONE_AT_A_TIME, "give one at a time, as each of frame.groupby('serial')")
    return TableError(error.problem, remedy, source=_NAME, line=error.line)


def _declared(record: TumbleRecord, declared: Mapping[str, Any]) -> TumbleRecord:
    """Take what the attributes of a frame declare, where neither columns nor caller do."""
    own = record.apparatus
    names = [item.name for item in fields(Apparatus) if getattr(own, item.name) is None]
    more = [n for n in ("serial", "date", "reference_temperature") if getattr(record, n) is None]
    given: dict[str, Any] = {name: declared.get(name) for name in more}
    given["apparatus"] = replace(own, **{name: declared.get(name) for name in names})
    metadata = {**declared.get("metadata", {}), **record.metadata}
    return replace(record, **given, metadata=metadata)


def _arrays(columns: Any) -> list[tuple[str, NDArray[Any]]]:
    """Columns with their names, single values repeated."""
    if fields_of := getattr(getattr(columns, "dtype", None), "names", None):
        columns = {name: columns[name] for name in fields_of}
    if not hasattr(columns, "items"):
        convertible = hasattr(columns, "to_pandas")  # a frame of polars, or a table of pyarrow
        raise InputError(
            f"{type(columns).__name__} in place of columns; give"
            f"{' its .to_pandas(),' if convertible else ''} a mapping of names to arrays, or a"
            " DataFrame of pandas"
        )
    names = getattr(getattr(columns, "index", None), "names", ())
    levels = [name for name in names if name is not None and name not in columns]
    found = [*(columns.reset_index(levels) if levels else columns).items()]
    refuse_other_order(dict(found))
    arrays = [(_heading(columns, name), _array(values)) for name, values in found]
    sizes = {array.size for _, array in arrays if array.ndim}
    if len(sizes) > 1 or any(array.ndim > 1 for _, array in arrays):
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays)
        raise InputError(f"columns of different shapes, {shapes}; all have the shape (n,)")
    size = max(sizes, default=1)
    return [(name, np.broadcast_to(array, size)) for name, array in arrays]


def _array(values: Any) -> NDArray[Any]:
    """Take values as an array; what has a mask of `numpy.ma` is missing, whatever would fill it."""
    array: Any = np.asanyarray(values)
    if not isinstance(array, np.ma.MaskedArray):
        return np.asarray(array)
    cells: NDArray[Any] = array.data.astype(object)
    cells[np.ma.getmaskarray(array)] = None
    return cells


def _heading(columns: Any, name: Any) -> str:
    """Name of a column, with the unit that the attributes of a frame have for it."""
    if isinstance(name, tuple):  # of a pivot table with several levels
        levels = getattr(getattr(columns, "columns", None), "names", ())
        apart = ["" not in name and is_apart(str(level)) for level in levels]
        words = [f"{level} " if own else "" for level, own in zip(levels, apart, strict=True)]
        pairs = zip_longest(words, name, fillvalue="")
        name = " ".join(f"{word}{own}" for word, own in pairs).strip()
    units = getattr(columns, "attrs", {}).get("units")
    unit = units.get(name) if isinstance(units, Mapping) else None
    return f"{name} [{unit}]" if unit and not split_unit(str(name))[1] else str(name)


def _cells(heading: str, array: NDArray[Any]) -> list[Any]:
    """Plain numbers and texts of one line each."""
    if read_heading(heading).role in LABELS:
        return list(map(_label, array.tolist()))
    if array.dtype.kind == "M":
        array = np.datetime_as_string(array, unit="us")
    if array.dtype.kind == "m":
        array = array.astype("timedelta64[us]")  # of nanoseconds bare numbers would be left
        if read_heading(heading).unit in (None, "s"):
            array = array / np.timedelta64(1, "s")  # a text of a day or more is no clock time
    cells: list[Any] = array.tolist()
    if array.dtype.kind in "OSU":
        cells = ["" if cell is None else cell_text(cell) for cell in cells]
    return cells


def _label(value: Any) -> str:
    """A label as Parquet and workbooks have it: of a whole number its digits alone."""
    text = cell_text(value)
    return "" if text in _NO_LABEL else text
