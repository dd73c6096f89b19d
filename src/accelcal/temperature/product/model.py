"""The product model of all readings: bilinear laws times what does not depend on temperature.

Columns of readings lie one below another here, shape (k, n), so that numpy works on all readings of
a column at a time.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Places
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
