"""Functions of the coefficients of all tables, and coefficients that are changed by them.

The derivatives by all coefficients carry the errors.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from accelcal.arrays import Array, Places
from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.uncertainty import Component
from accelcal.model import COEFFICIENTS


@dataclass(frozen=True, slots=True)
class Linearised:
    """Functions of all P coefficients of a record, or of each of a stack.

    Examples
    --------
    >>> import numpy as np
    >>> bias = Linearised(np.array(6e-4), np.array([1.0, 0.0]))
    >>> scale_factor = Linearised(np.array(2.0), np.array([0.0, 1.0]))
    >>> found = bias / scale_factor
    >>> float(found.value), found.by_all.tolist()
    (0.0003, [0.5, -0.00015])
    """

    value: Array  # shape (...); of functions of the t tables, these are the last axis
    by_all: Array  # derivatives by the coefficients, shape (..., P)

    @classmethod
    def of(cls, estimate: JointEstimate, table: int, name: str) -> Linearised:
        """Take a coefficient of a table, 0 where it is not estimated."""
        value = np.asarray(estimate.coefficients[table][..., COEFFICIENTS.index(name)])
        by_all = np.zeros((*value.shape, sum(map(len, estimate.names))))
        if name in estimate.names[table]:
            by_all[..., estimate.place(table, name)] = 1.0
        return cls(value, by_all)

    @classmethod
    def of_tables(cls, each: Sequence[Linearised]) -> Linearised:
        """Put functions of one table each side by side, shape (..., t)."""
        values, by_all = [one.value for one in each], [one.by_all for one in each]
        return cls(np.stack(values, axis=-1), np.stack(by_all, axis=-2))

    def weighted(self, weights: Array) -> Linearised:
        """Sum those of the tables with weights, shape (k, t), to shape (..., k)."""
        return Linearised(self.value @ weights.T, weights @ self.by_all)

    def arctan(self) -> Linearised:
        """Take the angles of which they are the tangents."""
        return Linearised(np.arctan(self.value), self.by_all / (1.0 + self.value**2)[..., None])

    def tan(self) -> Linearised:
        """Take their tangents."""
        found = np.tan(self.value)
        return Linearised(found, self.by_all * (1.0 + found**2)[..., None])

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


def adjusted(
    estimate: JointEstimate, names: Sequence[tuple[int, str]], change: Linearised
) -> JointEstimate:
    """Add to some coefficients what depends on all of them, by the law of propagation.

    They are m coefficients by table and name; what is added, shape (..., m), is in output unit /
    g^n.
    """
    coefficients = [values.copy() for values in estimate.coefficients]
    for row, (table, name) in enumerate(names):
        coefficients[table][..., COEFFICIENTS.index(name)] += change.value[..., row]
    at = np.array([estimate.place(table, name) for table, name in names])

    def passed(components: Mapping[str, Component]) -> dict[str, Component]:
        return {source: _passed(part, at, change.by_all) for source, part in components.items()}

    return estimate._replace(
        coefficients=tuple(coefficients),
        components=passed(estimate.components),
        alike=passed(estimate.alike),
    )


def _passed(part: Component, at: Places, through: Array) -> Component:
    """Component of coefficients of which those at some places have `through` times all added.

    The others stay, and few columns of `through` are not zero: this takes a small share of the
    time that a matrix of all coefficients would.
    """
    used = np.flatnonzero(through.any(axis=tuple(range(through.ndim - 1))))
    few, back = through[..., used], through[..., used].mT
    more = few @ part.covariance[..., used, :]
    covariance = part.covariance.copy()
    covariance[..., at, :] += more
    covariance[..., at] += more.mT
    covariance[..., at[:, None], at] += more[..., used] @ back
    dof = part.dof.copy()
    fewest = np.where(few != 0.0, dof[..., None, used], np.inf).min(axis=-1)
    dof[..., at] = np.minimum(dof[..., at], fewest)
    return Component(covariance, dof)
