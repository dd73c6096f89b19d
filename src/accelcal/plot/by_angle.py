"""Readings by head angle and direction, and their means with 95 % intervals."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from accelcal.arrays import Array, Ints
from accelcal.numerics.grouping import group_after_group, grouped
from accelcal.numerics.probability import LEVEL, student_quantile


@dataclass(frozen=True, slots=True, eq=False)
class Readings:
    """A value for each reading of a tumble test.

    Attributes
    ----------
    angle : ndarray, shape (n,)
        Head angle [deg].
    stroke : ndarray of int, shape (n,)
        Stroke; odd ones run forward.
    value : ndarray, shape (n,)
        Such as a residual [g].
    """

    angle: Array
    stroke: Ints
    value: Array

    def directions(self) -> Iterator[tuple[int, str, Readings]]:
        """Iterate over what was read forward and what back, with its number and name."""
        for number, name in enumerate(("forward", "back")):
            here = self.stroke % 2 == 1 - number
            if here.any():
                yield (
                    number,
                    name,
                    Readings(self.angle[here], self.stroke[here], self.value[here]),
                )

    def means(self) -> tuple[Array, Array, Array]:
        """Head angles, mean at each, and half width of its 95 % interval (NaN of one reading)."""
        angles, index, members = grouped(self.angle)
        values = self.value[group_after_group(index, members)]
        told = [mean_and_half_width(own) for own in np.split(values, np.cumsum(members)[:-1])]
        means, half_widths = np.array(told).reshape(-1, 2).T
        return angles, means, half_widths


def mean_and_half_width(values: Array) -> tuple[float, float]:
    """Mean, and half width of its 95 % interval by Student; NaN where there is one reading only."""
    if values.size < 2:
        return float(values.mean()), float("nan")
    spread = float(values.std(ddof=1)) / values.size**0.5
    return float(values.mean()), student_quantile(LEVEL, values.size - 1) * spread
