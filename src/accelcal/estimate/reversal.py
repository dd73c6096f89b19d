"""Reversal: both sides of an axis, turned by 180 deg about the input axis, tell delta0 from M.

A fixture angle d0 beyond the one taken as given acts as K1 cos(th + d0), which a table takes for a
misalignment of -d0 on the side + and of +d0 on the side -, where the cross axis has changed its
sign. So the mean of both sides is the misalignment and half the difference, - minus +, the angle.
The errors of the head are common to both sides and turn with the angle: they leave the mean and
stay in the angle. The covariance of all tables, which has them in common, knows that by itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.launch import SAME_LEVEL
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.uncertainty import Interval, intervals, propagate
from accelcal.model import COEFFICIENTS
from accelcal.results.fixture_angle import FixtureAngle
from accelcal.results.quantity import Quantity

__all__ = ["fixture_angles", "free_of_fixture_angle"]

Array = NDArray[np.float64]

_K1, _M = (COEFFICIENTS.index(name) for name in ("K1", "M"))


class _Reversal(NamedTuple):
    """One axis measured on both sides.

    `angle`, shape (R,), and `misalignments`, a row for each level, are weights of the effective
    misalignments of all R tables; `correction` is what to add to them, a row for each table.
    """

    axis: str
    angle: Array
    levels: tuple[float, ...]
    misalignments: Array
    correction: Array


def fixture_angles(
    tables: Sequence[PreparedTable], estimate: JointEstimate, delta0: float = 0.0
) -> tuple[FixtureAngle, ...]:
    """Tell the fixture angle of each axis that was measured on both sides.

    Parameters
    ----------
    tables : sequence of PreparedTable
        The tables of one record.
    estimate : JointEstimate
        Their coefficients.
    delta0 : float, default 0
        Fixture angle that the estimate took as given [rad].

    Returns
    -------
    tuple of FixtureAngle
        None, one or two.

    Notes
    -----
    At each level delta = (delta+ + delta-)/2 and delta0 = given + (delta- - delta+)/2, of the
    means over the runs of each side; delta0 is the mean over the levels.
    """
    effective, jacobian = _effective(estimate)
    found = []
    for reversal in _reversals(tables, estimate):
        weights = np.vstack([reversal.angle, reversal.misalignments])
        known = intervals(propagate(estimate.components, weights @ jacobian))
        angle, *misalignments = map(_radians, weights @ effective + _first(delta0, weights), known)
        levels = tuple(float(t) if np.isfinite(t) else None for t in reversal.levels)
        found.append(FixtureAngle(reversal.axis, angle, levels, tuple(misalignments)))
    return tuple(found)


def free_of_fixture_angle(
    tables: Sequence[PreparedTable], estimate: JointEstimate
) -> JointEstimate:
    """Take the fixture angle out of M, where both sides of an axis were measured.

    Parameters
    ----------
    tables : sequence of PreparedTable
        The tables of one record.
    estimate : JointEstimate
        Their coefficients.

    Returns
    -------
    JointEstimate
        With the M and its error components of the tables of these axes free of the angle, by that
        of their own level, or by the mean angle where a level has one side only. The same object
        where no axis was measured on both sides.
    """
    corrections = [reversal.correction for reversal in _reversals(tables, estimate)]
    if not corrections:
        return estimate
    correction = np.sum(corrections, axis=0)
    effective, jacobian = _effective(estimate)
    change, by_all = correction @ effective, correction @ jacobian
    whole = np.eye(jacobian.shape[1])
    coefficients = [values.copy() for values in estimate.coefficients]
    for i in np.flatnonzero(correction.any(axis=1)).tolist():
        scale_factor = coefficients[i][_K1]
        coefficients[i][_M] += scale_factor * change[i]
        whole[_place(estimate, i, "M")] += scale_factor * by_all[i]
        whole[_place(estimate, i, "M"), _place(estimate, i, "K1")] += change[i]
    return estimate._replace(
        coefficients=tuple(coefficients),
        components=propagate(estimate.components, whole),
        alike=propagate(estimate.alike, whole),
    )


def _reversals(tables: Sequence[PreparedTable], estimate: JointEstimate) -> Iterator[_Reversal]:
    mountings = [str(table.record.mounting[0]) for table in tables]
    for axis in "op":
        sides = np.array(
            [
                (1.0 if m[1] == "+" else -1.0) * (m[0] == axis and _tells_misalignment(estimate, i))
                for i, m in enumerate(mountings)
            ]
        )
        levels = list(_levels([table.record.mean_temperature for table in tables], sides))
        if levels:
            yield _reversal(axis, sides, levels)


def _tells_misalignment(estimate: JointEstimate, table: int) -> bool:
    return "M" in estimate.names[table] and "M" not in estimate.stands_for[table]


def _levels(temperatures: Sequence[float], sides: Array) -> Iterator[tuple[float, Array]]:
    """Levels with both sides: mean temperature, and which tables belong to them."""
    at = np.array(temperatures)
    left = sides != 0.0
    while left.any():
        first = at[left][0]
        here = left & (np.isnan(at) if np.isnan(first) else np.abs(at - first) < SAME_LEVEL)
        left &= ~here
        if {1.0, -1.0} <= set(sides[here].tolist()):
            yield float(at[here].mean()), here


def _reversal(axis: str, sides: Array, levels: Sequence[tuple[float, Array]]) -> _Reversal:
    means = np.array([[_mean(here & (sides == s)) for s in (1.0, -1.0)] for _, here in levels])
    plus, minus = means[:, 0], means[:, 1]
    angles = (minus - plus) / 2.0
    correction = np.outer(sides, angles.mean(axis=0))
    for (_, here), angle in zip(levels, angles, strict=True):
        correction[here] = np.outer(sides[here], angle)
    temperatures = tuple(temperature for temperature, _ in levels)
    return _Reversal(axis, angles.mean(axis=0), temperatures, (plus + minus) / 2.0, correction)


def _mean(chosen: NDArray[np.bool_]) -> Array:
    return np.asarray(chosen / chosen.sum())


def _effective(estimate: JointEstimate) -> tuple[Array, Array]:
    """Effective misalignment M/K1 of each table, and its derivatives by all coefficients."""
    size = sum(len(names) for names in estimate.names)
    jacobian = np.zeros((len(estimate.names), size))
    values = np.zeros(len(estimate.names))
    for i, k in enumerate(estimate.coefficients):
        values[i] = k[_M] / k[_K1]
        if "M" in estimate.names[i]:
            jacobian[i, _place(estimate, i, "M")] = 1.0 / k[_K1]
            jacobian[i, _place(estimate, i, "K1")] = -k[_M] / k[_K1] ** 2
    return values, jacobian


def _place(estimate: JointEstimate, table: int, name: str) -> int:
    return int(estimate.part(table).start) + estimate.names[table].index(name)


def _first(value: float, like: Array) -> Array:
    return np.pad([value], (0, like.shape[0] - 1))


def _radians(value: float, interval: Interval) -> Quantity:
    dof = interval.dof if interval.dof is not None and np.isfinite(interval.dof) else None
    return Quantity(float(value), interval.standard, "rad", interval.expanded, dof)
