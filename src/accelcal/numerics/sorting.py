"""Different values and medians, by sorting.

numpy.unique and numpy.median do the same, but import numpy.ma, which takes as long as the fit of a
table.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def distinct(values: NDArray[Any]) -> NDArray[Any]:
    """Sort the values, none of them NaN, and keep one of each.

    Examples
    --------
    >>> import numpy as np
    >>> distinct(np.array([3, 1, 3])).tolist()
    [1, 3]
    """
    ordered = np.sort(values)
    first = np.concatenate([[True], ordered[1:] != ordered[:-1]])[: ordered.size]
    return np.asarray(ordered[first])


def median(values: NDArray[Any]) -> float:
    """Median of one value or more, none of them NaN.

    Examples
    --------
    >>> import numpy as np
    >>> median(np.array([4.0, 1.0, 3.0])), median(np.array([1.0, 2.0]))
    (3.0, 1.5)
    """
    ordered = np.sort(values)
    half = values.size // 2
    return float(ordered[half] if values.size % 2 else 0.5 * (ordered[half - 1] + ordered[half]))
