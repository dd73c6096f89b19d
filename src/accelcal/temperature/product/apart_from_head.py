"""Readings of which the errors of the head, each alike in the readings of one position, are noise.

Each reading feels the error of one position. So the covariance 1 + H H' of all readings has a root
that is worked out position by position, and no error of a position needs to be an unknown.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Places
from accelcal.numerics.grouping import Grouped, grouped


class Block(NamedTuple):
    """Some readings, and those of the positions that they have."""

    rows: slice  # the readings, n of them
    # these readings by position; the keys are places among the positions of all readings
    positions: Grouped


class HeadErrors(NamedTuple):
    """What independent errors of J positions do to n readings of each of R records."""

    # shape (R, n): what an error of one standard uncertainty of its position does to each reading
    acting: Array
    positions: Grouped  # the readings by position

    def of_records(self, rows: Places) -> HeadErrors:
        """Return those of some of the records."""
        return self._replace(acting=self.acting[rows])

    def blocks(self, readings: int) -> list[Block]:
        """Divide the readings into blocks of so many."""
        position = self.positions.cell
        cuts = [slice(i, i + readings) for i in range(0, position.size, readings)]
        return [Block(rows, grouped(position[rows])) for rows in cuts]

    def of_block(self, block: Block) -> HeadErrors:
        """Return those of some of the readings."""
        return HeadErrors(self.acting[:, block.rows], block.positions)

    def sums(self, columns: Array) -> Array:
        """Multiply columns, shape (R, k, n), with H: shape (R, k, J)."""
        acting = (self.acting[:, None] * columns).mT
        return self.positions.sums(acting).mT

    def apart(self, columns: Array, noise: Array) -> Array:
        """Make the errors of readings independent of each other.

        That is columns, shape (R, k, n), in units of the noise, times the inverse root of 1 + H H',
        with H in these units as well. The noise is of shape (R, n), in the units of `acting`.

        Examples
        --------
        >>> import numpy as np
        >>> errors = HeadErrors(np.array([[2.0, 1.0, 3.0]]), grouped(np.array([0, 0, 45])))
        >>> H = np.array([[2.0, 0.0], [1.0, 0.0], [0.0, 3.0]])
        >>> root = errors.apart(np.eye(3)[None], np.ones((1, 3)))[0]
        >>> np.allclose(root @ root @ (np.eye(3) + H @ H.T), np.eye(3))
        True
        """
        own = self.over(noise)
        return own.freed(columns, own.common(own.sums(columns), own.squares))

    def over(self, noise: Array) -> HeadErrors:
        """Return those in units of the noise, shape (R, n)."""
        return self._replace(acting=self.acting / noise)

    @property
    def squares(self) -> Array:
        """Sum of the squares of `acting` of each position, shape (R, 1, J)."""
        return self.sums(self.acting[:, None])

    @staticmethod
    def common(sums: Array, squares: Array) -> Array:
        """What `freed` takes off, of the sums of columns over all readings of each position."""
        share = (1.0 - 1.0 / np.sqrt(1.0 + squares)) / np.where(squares > 0.0, squares, 1.0)
        return np.asarray(share * sums)

    def freed(self, columns: Array, common: Array) -> Array:
        """Take off columns what their positions have in common, shape (R, k, J)."""
        taken = np.take(common, self.positions.cell, axis=2)
        taken *= self.acting[:, None]
        return np.subtract(columns, taken, out=taken)
