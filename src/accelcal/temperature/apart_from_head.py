"""Readings of which the errors of the head, each alike in the readings of one position, are noise.

Each reading feels the error of one position. So the covariance 1 + H H' of all readings has a root
that is worked out position by position, and no error of a position needs to be an unknown.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Places
from accelcal.numerics.grouping import sums_of_groups


class HeadErrors(NamedTuple):
    """What independent errors of J positions do to n readings of each of R records.

    Attributes
    ----------
    acting : ndarray, shape (R, n)
        What an error of one standard uncertainty of its position does to each reading.
    position : ndarray of int, shape (n,)
        Position of each reading.
    members : ndarray of int, shape (J,)
        How many readings each position has.
    """

    acting: Array
    position: Places
    members: Places

    def of_records(self, rows: Places) -> HeadErrors:
        """Return those of some of the records."""
        return self._replace(acting=self.acting[rows])

    def sums(self, columns: Array) -> Array:
        """Multiply columns, shape (R, n, k), with the transpose of H: shape (R, J, k)."""
        return sums_of_groups(self.acting[..., None] * columns, self.position, self.members)

    def apart(self, columns: Array, noise: Array) -> Array:
        """Make the errors of readings independent of each other.

        Parameters
        ----------
        columns : ndarray, shape (R, n, k)
            Columns in units of the noise.
        noise : ndarray, shape (R, n)
            Noise of the readings, in the units of `acting`.

        Returns
        -------
        ndarray, shape (R, n, k)
            The columns times the inverse root of 1 + H H', with H in units of the noise.

        Examples
        --------
        >>> import numpy as np
        >>> errors = HeadErrors(np.array([[2.0, 1.0, 3.0]]), np.array([0, 0, 1]), np.array([2, 1]))
        >>> H = np.array([[2.0, 0.0], [1.0, 0.0], [0.0, 3.0]])
        >>> root = errors.apart(np.eye(3)[None], np.ones((1, 3)))[0]
        >>> np.allclose(root @ root @ (np.eye(3) + H @ H.T), np.eye(3))
        True
        """
        own = self._replace(acting=self.acting / noise)
        squares = own.sums(own.acting[..., None])
        share = (1.0 - 1.0 / np.sqrt(1.0 + squares)) / np.where(squares > 0.0, squares, 1.0)
        taken = (share * own.sums(columns))[:, self.position]
        taken *= own.acting[..., None]
        return np.asarray(columns - taken)
