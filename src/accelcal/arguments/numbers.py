"""Numbers among the arguments: finite, whole where they count, and within their range."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arguments.kinds import as_given, is_finite
from accelcal.arrays import Array
from accelcal.errors import InputError


def check_number(minimum: float = -math.inf, maximum: float = math.inf, /, **values: float) -> None:
    """Refuse values that are not finite or outside a range.

    Examples
    --------
    >>> check_number(0.0, hours="8")
    Traceback (most recent call last):
    ...
    accelcal.errors.InputError: hours is '8'; it is a finite number
    >>> check_number(hours=[8.0, 9.0])
    Traceback (most recent call last):
    ...
    accelcal.errors.InputError: hours is list; it is one finite number
    """
    for name, value in values.items():
        if not _is_number(value) or not is_finite(value):
            one = "one" if np.iterable(value) and not isinstance(value, str) else "a"
            raise InputError(f"{name} is {as_given(value)}; it is {one} finite number")
        if value < minimum:
            raise InputError(f"{name} is {value}; it is {minimum:g} or more")
        if value > maximum:
            raise InputError(f"{name} is {value}; it is {maximum:g} or less")


def check_number_or_none(minimum: float = -math.inf, /, **values: float | None) -> None:
    """Refuse what is neither None nor passes `check_number`.

    Examples
    --------
    >>> check_number_or_none(0.0, hours=None)
    """
    given = {name: value for name, value in values.items() if value is not None}
    check_number(minimum, **given)


def check_whole(minimum: int, /, **values: float) -> None:
    """Refuse values that are no whole numbers or below the minimum.

    Examples
    --------
    >>> check_whole(1, strokes=2.5)
    Traceback (most recent call last):
    ...
    accelcal.errors.InputError: strokes is 2.5; it is a whole number, 1 or more
    """
    for name, value in values.items():
        if not _is_number(value) or not value >= minimum or value % 1:
            rule = f"a whole number, {minimum} or more"
            raise InputError(f"{name} is {as_given(value)}; it is {rule}")


def number_array(value: ArrayLike, name: str) -> Array:
    """Take a number or an array of numbers.

    A masked value of `numpy.ma` is NaN.

    Examples
    --------
    >>> number_array([1, 2], "output").tolist()
    [1.0, 2.0]
    """
    try:
        array: Any = np.asanyarray(value)
        if value is None or array.dtype.kind not in "iufO":
            raise TypeError
        if hasattr(array, "filled"):  # of numpy.ma, which is not loaded for this
            array = array.astype(np.float64).filled(np.nan)
        return np.asarray(array, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        odd = _odd_cell(value)
        told = f"is {as_given(value)}" if odd is None else f"has {as_given(odd)}"
        raise InputError(f"{name} {told}; it is a number or an array of numbers") from None


def _odd_cell(value: object) -> object:
    """First cell of a flat list or column that is no number, None where it is another thing."""
    cells = value.tolist() if hasattr(value, "tolist") else value
    cells = cells if isinstance(cells, list | tuple) else ()
    flat = not any(isinstance(cell, Iterable) and not isinstance(cell, str) for cell in cells)
    return next(
        (cell for cell in cells if flat and cell is not None and not _is_number(cell)), None
    )


def check_side_by_side(**columns: Any) -> None:
    """Refuse columns of samples that pandas would not set side by side as they are.

    Raises
    ------
    InputError
        If one is a whole DataFrame, or they are Series of different indices.

    Examples
    --------
    >>> import pandas as pd
    >>> check_side_by_side(output=pd.DataFrame({"output": [1.3]}))
    Traceback (most recent call last):
    ...
    accelcal.errors.InputError: output is a DataFrame; give one column, such as frame['output']
    """
    for name, values in columns.items():
        if hasattr(values, "columns"):
            raise InputError(f"{name} is a DataFrame; give one column, such as frame[{name!r}]")
    refuse_other_order(columns)


def refuse_other_order(columns: Mapping[Any, Any]) -> None:
    """Refuse Series whose rows pandas would match by an index that is not the same.

    Raises
    ------
    InputError
        If two are Series of different indices.
    """
    series = {name: item.index for name, item in columns.items() if hasattr(item, "reset_index")}
    for name, index in series.items():
        first = next(iter(series))
        if not index.equals(series[first]):
            raise InputError(
                f"{first} and {name} are Series of different indices; make one DataFrame of them,"
                " which aligns them, or give each by .to_numpy()"
            )


def _is_number(value: object) -> bool:
    return isinstance(value, (float, Real)) and not isinstance(value, bool)  # float is quick
