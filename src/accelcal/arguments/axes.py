"""The axes x, y and z of a triad, and what a column of one of them may be called."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arguments.kinds import shown
from accelcal.arguments.numbers import number_array
from accelcal.arrays import Array
from accelcal.errors import InputError

AXES = "xyz"
"""Names of the channels of a triad, and of the axes of its frame."""

_NAME = re.compile(
    r"(?:(?:output|out|mean|acceleration|accel|acc|a|y|(up))[_ ]?)?([xyz])(?:[_ (\[](.*))?",
    re.IGNORECASE,
)


class AxisName(NamedTuple):
    """What the name of a column tells.

    Attributes
    ----------
    axis : str
        One of `AXES`, empty for a column of something else.
    behind : str
        What stands behind the axis, such as a unit.
    is_up : bool
        Whether it is that of a direction up, not of an output.
    """

    axis: str
    behind: str = ""
    is_up: bool = False


def axis_named(name: str) -> AxisName:
    """Tell the axis of a column by its name.

    Examples
    --------
    >>> axis_named("acc_x"), axis_named("T").axis
    (AxisName(axis='x', behind='', is_up=False), '')
    >>> axis_named("Up Z [g]")
    AxisName(axis='z', behind='[g]', is_up=True)
    """
    found = _NAME.fullmatch(name)
    return AxisName(found[2].casefold(), found[3] or "", bool(found[1])) if found else AxisName("")


def by_axis(value: ArrayLike, name: str) -> Array:
    """Take numbers for the axes x, y, z along the last axis.

    Parameters
    ----------
    value : array_like
        What was given. Columns of a DataFrame that are named by the axes, as x or acc_x, count by
        their names, whatever their order; if names tell no two axes, they are x, y, z in their
        order.
    name : str
        Its name, for the message.

    Returns
    -------
    ndarray of float
        The numbers.

    Raises
    ------
    InputError
        If they are no numbers, or names tell two axes, but not each axis once.

    Examples
    --------
    >>> import pandas as pd
    >>> by_axis(pd.DataFrame({"z": [3.0], "x": [1.0], "y": [2.0]}), "output").tolist()
    [[1.0, 2.0, 3.0]]
    """
    columns: Any = getattr(value, "columns", ())
    axes = [str(column).casefold() for column in columns]
    if not {*AXES} <= {*axes}:
        axes = [axis_named(column).axis for column in axes]
    if len({*axes} - {""}) < 2:  # as of Y_1, Y_2, Y_3
        return number_array(value, name)
    if any(axes.count(axis) != 1 for axis in AXES):
        given = shown(", ".join(map(str, columns)))
        problem = f"{name} is a DataFrame with the columns {given}"
        raise InputError(
            f"{problem}; give one for each of x, y and z, such as frame[['x', 'y', 'z']]"
        )
    return number_array(np.asarray(value)[:, [axes.index(axis) for axis in AXES]], name)
