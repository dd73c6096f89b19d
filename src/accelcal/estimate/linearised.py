"""Functions of the coefficients of all tables, with the derivatives that carry their errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from accelcal.arrays import Array
from accelcal.estimate.joint import JointEstimate
from accelcal.model import COEFFICIENTS


@dataclass(frozen=True, slots=True)
class Linearised:
    """A function of all P coefficients of a record, or of each of a stack.

    Attributes
    ----------
    value : ndarray, shape (...)
        Its value.
    by_all : ndarray, shape (..., P)
        Its derivatives by the coefficients.

    Examples
    --------
    >>> import numpy as np
    >>> bias = Linearised(np.array(6e-4), np.array([1.0, 0.0]))
    >>> scale_factor = Linearised(np.array(2.0), np.array([0.0, 1.0]))
    >>> found = bias / scale_factor
    >>> float(found.value), found.by_all.tolist()
    (0.0003, [0.5, -0.00015])
    """

    value: Array
    by_all: Array

    @classmethod
    def of(cls, estimate: JointEstimate, table: int, name: str) -> Linearised:
        """Take a coefficient of a table."""
        value = np.asarray(estimate.coefficients[table][..., COEFFICIENTS.index(name)])
        by_all = np.zeros((*value.shape, sum(map(len, estimate.names))))
        by_all[..., place_of(estimate, table, name)] = 1.0
        return cls(value, by_all)

    def plus(self, number: float) -> Linearised:
        """Add a number."""
        return Linearised(self.value + number, self.by_all)

    def times(self, number: float) -> Linearised:
        """Multiply by a number."""
        return Linearised(self.value * number, self.by_all * number)

    def __add__(self, other: Linearised) -> Linearised:
        return Linearised(self.value + other.value, self.by_all + other.by_all)

    def __sub__(self, other: Linearised) -> Linearised:
        return self + other.times(-1.0)

    def __mul__(self, other: Linearised) -> Linearised:
        by_all = self.value[..., None] * other.by_all + other.value[..., None] * self.by_all
        return Linearised(self.value * other.value, by_all)

    def __truediv__(self, other: Linearised) -> Linearised:
        quotient = self.value / other.value
        by_all = (self.by_all - quotient[..., None] * other.by_all) / other.value[..., None]
        return Linearised(quotient, by_all)


def place_of(estimate: JointEstimate, table: int, name: str) -> int:
    """Return the place of a coefficient of a table among those of all tables."""
    return int(estimate.part(table).start) + estimate.names[table].index(name)
