"""Functions of the coefficients of all tables, and coefficients that are changed by them.

The derivatives by all coefficients carry the errors.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from accelcal.arrays import Array, Places
from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.uncertainty import Component
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
        by_all[..., estimate.place(table, name)] = 1.0
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


def adjusted(
    estimate: JointEstimate, names: list[tuple[int, str]], change: Array, through: Array
) -> JointEstimate:
    """Add to some coefficients what depends on all of them.

    Parameters
    ----------
    estimate : JointEstimate
        Coefficients of all tables of a record, or of a stack of records.
    names : list of tuple of int and str
        Table and name of each of m coefficients to change.
    change : ndarray, shape (..., m)
        What is added to them [output unit / g^n].
    through : ndarray, shape (..., m, P)
        Its derivatives by all coefficients.

    Returns
    -------
    JointEstimate
        With these coefficients and their error components changed, by the law of propagation.
    """
    coefficients = [values.copy() for values in estimate.coefficients]
    for row, (table, name) in enumerate(names):
        coefficients[table][..., COEFFICIENTS.index(name)] += change[..., row]
    at = np.array([estimate.place(table, name) for table, name in names])

    def passed(components: Mapping[str, Component]) -> dict[str, Component]:
        return {source: _passed(part, at, through) for source, part in components.items()}

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
