"""The product model of all readings: bilinear laws times what does not depend on temperature.

Columns of readings lie one below another here, shape (k, n), so that numpy works on all readings of
a column at a time.

The errors of the head, each alike in the readings of one position, count as noise. Each reading
feels the error of one position, so the covariance 1 + H H' of all readings has a root that is
worked out position by position, and no error of a position needs to be an unknown.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Places
from accelcal.numerics.grouping import Grouped, grouped
from accelcal.reference import bilinear_design
from accelcal.temperature.bilinear import local_slopes


class MountingReadings(NamedTuple):
    """All n readings of one mounting in each of R records of one plan; laws of p parameters."""

    output: Array  # shape (R, n): outputs [output unit]
    # shape (n,): accelerations along the input axis, and across it, felt by the misalignment [g]
    a_i: Array
    cross: Array
    common: Array  # shape (c, n): columns of what does not depend on temperature
    rise: Array  # shape (R, n): mean T of the reading's run, less T0 [degC]
    # shape (R, n): what was recorded about that mean, of which the accelerometer felt a part [degC]
    deviation: Array
    table: Places  # shape (n,): table of each reading
    sides: Sequence[str]  # see `accelcal.reference.measured_sides`

    def of_records(self, rows: Places) -> MountingReadings:
        """Return those of some of the records."""
        own = {name: getattr(self, name)[rows] for name in ("output", "rise", "deviation")}
        return self._replace(**own)

    def of_rows(self, rows: slice) -> MountingReadings:
        """Return some of the readings of each record."""
        own = {name: getattr(self, name)[rows] for name in ("a_i", "cross", "table")}
        two = ("common", "output", "rise", "deviation")
        return self._replace(**own, **{name: getattr(self, name)[:, rows] for name in two})

    def at(self, felt: Array, parameters: Array) -> Point:
        """What the model says where each table felt a part of the deviations, shape (R, tables).

        The parameters, shape (R, 3 p + c), are those of k0, K1 and delta, then of what is common to
        all temperatures.
        """
        rise = self.rise + self.deviation * felt[:, self.table]
        law = bilinear_design(rise, self.sides, axis=-2)
        p = law.shape[1]
        k0, K1, delta, common = np.split(parameters, [p, 2 * p, 3 * p], axis=1)
        inside = times(k0, law) + self.a_i + times(delta, law) * self.cross + common @ self.common
        return Point(self, rise, law, (k0, K1, delta), times(K1, law), inside)


class Point(NamedTuple):
    """Readings at their temperatures, and what the model says of them."""

    readings: MountingReadings
    rise: Array  # shape (R, n): what was felt, less T0 [degC]
    law: Array  # shape (R, p, n): the bilinear design there
    laws: tuple[Array, Array, Array]  # shape (R, p): parameters of k0, K1 and delta
    scale_factor: Array  # shape (R, n): K1 there [output unit / g]
    bracket: Array  # shape (R, n): output over K1 [g]

    def of_rows(self, rows: slice) -> Point:
        """Return some of the readings of each record."""
        own = {name: getattr(self, name)[..., rows] for name in ("rise", "law", "bracket")}
        scale_factor = self.scale_factor[:, rows]
        readings = self.readings.of_rows(rows)
        return self._replace(readings=readings, scale_factor=scale_factor, **own)

    @property
    def model(self) -> Array:
        """Output, shape (R, n)."""
        return self.scale_factor * self.bracket

    @property
    def jacobian(self) -> Array:
        """Derivative of the output by the parameters, shape (R, 3 p + c, n)."""
        K1 = self.scale_factor[:, None]
        by_bias, by_scale = K1 * self.law, self.bracket[:, None] * self.law
        parts = by_bias, by_scale, by_bias * self.readings.cross, K1 * self.readings.common
        return np.concatenate(parts, axis=1)

    @property
    def by_temperature(self) -> Array:
        """Derivative of the output by the temperature, shape (R, n)."""
        slope = local_slopes(self.rise, self.readings.sides, axis=-2)
        k0, K1, delta = (times(law, slope) for law in self.laws)
        inside = k0 + delta * self.readings.cross
        return np.asarray(K1 * self.bracket + self.scale_factor * inside)


def times(values: Array, columns: Array) -> Array:
    """Each column times its value, summed: (R, p) and (R, p, n) to (R, n)."""
    return np.asarray((values[:, None] @ columns)[:, 0])


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
