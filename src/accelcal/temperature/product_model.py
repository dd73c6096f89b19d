"""The product model of all readings: bilinear laws times what does not depend on temperature."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.temperature.bilinear import bilinear_design, local_slopes

__all__ = ["Point", "Readings"]

Array = NDArray[np.float64]


class Readings(NamedTuple):
    """All readings of one mounting, stacked: n readings in R runs, laws of p parameters.

    `a_i` and `cross` are accelerations, `common` the columns of what does not depend on
    temperature. The accelerometer was at `rise`, its run's mean T - T0, plus a part of
    `deviation`, what was recorded about that mean; there is a column for each run.
    """

    output: Array
    a_i: Array
    cross: Array
    common: Array
    rise: Array
    deviation: Array
    sides: Sequence[str]

    def at(self, felt: Array) -> Point:
        """Place the readings where they felt a part of the deviations, shape (R,)."""
        rise = self.rise + self.deviation @ felt
        law, slope = bilinear_design(rise, self.sides), local_slopes(rise, self.sides)
        return Point(self, law, slope)


class Point(NamedTuple):
    """Readings with the bilinear design and its derivative, `slope`, at their temperatures."""

    readings: Readings
    law: Array
    slope: Array

    def laws(self, parameters: Array) -> tuple[Array, Array, Array, Array]:
        """Split the parameters into those of k0, K1, delta and what is common."""
        p = self.law.shape[1]
        k0, K1, delta, common = np.split(parameters, [p, 2 * p, 3 * p])
        return k0, K1, delta, common

    def scale_factor(self, parameters: Array) -> Array:
        """K1 at the temperature of each reading, shape (n,)."""
        return np.asarray(self.law @ self.laws(parameters)[1])

    def model(self, parameters: Array) -> Array:
        """Output at the parameters, shape (n,)."""
        return self.scale_factor(parameters) * self.bracket(parameters)

    def bracket(self, parameters: Array) -> Array:
        """Output over K1, shape (n,)."""
        k0, _, delta, common = self.laws(parameters)
        a_i, cross = self.readings.a_i, self.readings.cross
        tilt = (self.law @ delta) * cross
        return np.asarray(self.law @ k0 + a_i + tilt + self.readings.common @ common)

    def jacobian(self, parameters: Array) -> Array:
        """Derivative of the output by the parameters, shape (n, 3 p + common)."""
        K1 = self.scale_factor(parameters)[:, None]
        by_bias, by_tilt = K1 * self.law, K1 * self.readings.cross[:, None] * self.law
        by_scale = self.bracket(parameters)[:, None] * self.law
        return np.hstack([by_bias, by_scale, by_tilt, K1 * self.readings.common])

    def by_temperature(self, parameters: Array) -> Array:
        """Derivative of the output by the temperature, shape (n,)."""
        k0, K1, delta, _ = self.laws(parameters)
        inside = self.slope @ k0 + (self.slope @ delta) * self.readings.cross
        scale = (self.slope @ K1) * self.bracket(parameters)
        return np.asarray(scale + (self.law @ K1) * inside)
