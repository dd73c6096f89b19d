"""Readings of which the errors of the head, each alike in the readings of one position, are noise.

Each reading feels the error of one position. So the covariance 1 + H H' of all readings has a root
that is worked out position by position, and no error of a position needs to be an unknown.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

__all__ = ["apart_from_head"]

Array = NDArray[np.float64]


def apart_from_head(acting: Array) -> Callable[[Array], Array]:
    """Find what makes the errors of readings independent.

    Parameters
    ----------
    acting : ndarray, shape (n, J)
        What independent errors of the positions do to readings of independent noise, both of
        standard deviation 1; one in each row.

    Returns
    -------
    callable
        Takes columns, shape (n, k), and multiplies them with the inverse root of 1 + H H'.

    Examples
    --------
    >>> import numpy as np
    >>> acting = np.array([[2.0, 0.0], [1.0, 0.0], [0.0, 3.0]])
    >>> root = apart_from_head(acting)(np.eye(3))
    >>> np.allclose(root @ root @ (np.eye(3) + acting @ acting.T), np.eye(3))
    True
    """
    squares = (acting**2).sum(axis=0)
    share = (1.0 - 1.0 / np.sqrt(1.0 + squares)) / np.where(squares > 0.0, squares, 1.0)
    return lambda columns: columns - acting @ (share[:, None] * (acting.T @ columns))
