"""The product model of all readings: bilinear laws times what does not depend on temperature."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Places
from accelcal.temperature.bilinear import bilinear_design, local_slopes


class Readings(NamedTuple):
    """All n readings of one mounting in each of R records of one plan; laws of p parameters.

    Attributes
    ----------
    output : ndarray, shape (R, n)
        Outputs [output unit].
    a_i, cross : ndarray, shape (n,)
        Accelerations along the input axis, and across it where the misalignment feels them [g].
    common : ndarray, shape (n, c)
        Columns of what does not depend on temperature.
    rise : ndarray, shape (R, n)
        Mean T of the reading's run, less T0 [degC].
    deviation : ndarray, shape (R, n)
        What was recorded about that mean, of which the accelerometer felt a part [degC].
    table : ndarray of int, shape (n,)
        Table of each reading.
    sides : sequence of str
        See `accelcal.temperature.bilinear.measured_sides`.
    """

    output: Array
    a_i: Array
    cross: Array
    common: Array
    rise: Array
    deviation: Array
    table: Places
    sides: Sequence[str]

    def of_records(self, rows: Places) -> Readings:
        """Return those of some of the records."""
        own = {name: getattr(self, name)[rows] for name in ("output", "rise", "deviation")}
        return self._replace(**own)

    def of_rows(self, rows: slice) -> Readings:
        """Return some of the readings of each record."""
        own = {name: getattr(self, name)[rows] for name in ("a_i", "cross", "common", "table")}
        own |= {name: getattr(self, name)[:, rows] for name in ("output", "rise", "deviation")}
        return self._replace(**own)

    def at(self, felt: Array) -> Point:
        """Place the readings where each table felt a part of the deviations, shape (R, tables)."""
        rise = self.rise + self.deviation * felt[:, self.table]
        law, slope = bilinear_design(rise, self.sides), local_slopes(rise, self.sides)
        return Point(self, law, slope)


class Point(NamedTuple):
    """Readings with the bilinear design and its derivative, `slope`, at their temperatures.

    Both have the shape (R, n, p); parameters have the shape (R, 3 p + c).
    """

    readings: Readings
    law: Array
    slope: Array

    def laws(self, parameters: Array) -> list[Array]:
        """Split the parameters into those of k0, K1, delta and what is common."""
        p = self.law.shape[2]
        return np.split(parameters, [p, 2 * p, 3 * p], axis=1)

    def scale_factor(self, parameters: Array) -> Array:
        """K1 at the temperature of each reading, shape (R, n)."""
        return times(self.law, self.laws(parameters)[1])

    def model(self, parameters: Array) -> Array:
        """Output at the parameters, shape (R, n)."""
        return self.scale_factor(parameters) * self.bracket(parameters)

    def bracket(self, parameters: Array) -> Array:
        """Output over K1, shape (R, n)."""
        k0, _, delta, common = self.laws(parameters)
        a_i, cross = self.readings.a_i, self.readings.cross
        tilt = times(self.law, delta) * cross
        return np.asarray(times(self.law, k0) + a_i + tilt + common @ self.readings.common.T)

    def jacobian(self, parameters: Array) -> Array:
        """Derivative of the output by the parameters, shape (R, n, 3 p + c)."""
        K1 = self.scale_factor(parameters)[..., None]
        by_bias, by_tilt = K1 * self.law, K1 * self.readings.cross[:, None] * self.law
        by_scale = self.bracket(parameters)[..., None] * self.law
        return np.concatenate([by_bias, by_scale, by_tilt, K1 * self.readings.common], axis=2)

    def by_temperature(self, parameters: Array) -> Array:
        """Derivative of the output by the temperature, shape (R, n)."""
        k0, K1, delta, _ = self.laws(parameters)
        inside = times(self.slope, k0) + times(self.slope, delta) * self.readings.cross
        scale = times(self.slope, K1) * self.bracket(parameters)
        return np.asarray(scale + times(self.law, K1) * inside)


def times(matrix: Array, values: Array) -> Array:
    """Each matrix times its values, (R, n, p) and (R, p)."""
    return np.asarray((matrix @ values[..., None])[..., 0])
