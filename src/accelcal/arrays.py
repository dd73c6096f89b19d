"""Arrays by what they hold, and arrays that stay as they are."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Places = NDArray[np.intp]
Ints = NDArray[np.int64]
"""Places index other arrays; Ints count and name."""

Numbers = Sequence[float] | NDArray[Any]
"""Some numbers as a user gives them; an array is no Sequence to a type checker."""


def kept(array: NDArray[Any]) -> NDArray[Any]:
    """Keep an array as it is, whatever becomes of the one that was given.

    Parameters
    ----------
    array : ndarray
        Numbers or texts, which stay the caller's.

    Returns
    -------
    ndarray
        A copy that cannot be written to, or the array itself where it is one.

    Examples
    --------
    >>> given = np.zeros(2)
    >>> own = kept(given)
    >>> given[0] = 1.0
    >>> own.tolist(), kept(own) is own
    ([0.0, 0.0], True)
    """
    if array.flags.owndata and not array.flags.writeable:
        return array
    own = array.copy()
    own.setflags(write=False)
    return own
