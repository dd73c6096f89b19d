"""Reversal: both sides of an axis, turned by 180 deg about the input axis, tell delta0 from M.

A fixture angle d0 beyond the one taken as given acts as K1 cos(th + d0), which a table takes for a
misalignment of -d0 on the side + and of +d0 on the side -, where the cross axis has changed its
sign: M/K1 = tan(alpha - d0) and tan(alpha + d0), where tan(alpha) is the misalignment. So the mean
of these angles is alpha and half their difference, - minus +, is d0.
The errors of the head are common to both sides and turn with the angle: they leave the mean and
stay in the angle. The covariance of all tables, which has them in common, knows that by itself.

The cross-coupling is the mean of both sides too: there the -2 K2 delta0 that the angle adds to it,
and what the head's first harmonic adds, which no position of one side shows, change their signs.
Each clamping of the fixture on the head has an angle of its own.

Functions of the coefficients of all tables carry their derivatives by these with them, so that the
errors of what is corrected by them follow by the law of propagation.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask, Places
from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.launch import same_levels
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.uncertainty import Component, interval_stack, propagate
from accelcal.geometry import side_of
from accelcal.model import COEFFICIENTS
from accelcal.results.covariance import Covariance, rows_of
from accelcal.results.fixture_angle import FixtureAngle


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


_G = "g/g^2"


class _Reversal(NamedTuple):
    """One axis measured on both sides.

    `angle`, shape (R,), and `misalignments`, a row for each level, are weights of the angles whose
    tangents are the effective misalignments of all R tables; `correction` is what to add to these
    angles, a row for each table.
    """

    axis: str
    clamping: float
    angle: Array
    levels: tuple[float, ...]
    misalignments: Array
    correction: Array


def fixture_angles(
    tables: Sequence[PreparedTable], estimate: JointEstimate, delta0: float
) -> tuple[FixtureAngle, ...]:
    """Tell the fixture angle of each axis that was measured on both sides.

    Parameters
    ----------
    tables : sequence of PreparedTable
        The tables of one record.
    estimate : JointEstimate
        Their coefficients, of one record alone.
    delta0 : float
        Fixture angle that the estimate took as given [rad].

    Returns
    -------
    tuple of FixtureAngle
        One for each axis that was measured on both sides, and for each clamping of the fixture.

    Notes
    -----
    At each level delta = tan((alpha+ + alpha-)/2) and delta0 = given + (alpha- - alpha+)/2, where
    tan(alpha) is the M/K1 of a table, of the means over the runs of each side; delta0 is the mean
    over the levels. It holds 0.75 k3 delta0 of the cubic term, which is not taken off.
    """
    return tuple(_told(each, estimate, delta0) for each in _reversals(tables, estimate))


def fixture_angle_stack(tables: Sequence[PreparedTable], estimate: JointEstimate) -> Array | None:
    """Tell the fixture angles of R records beyond the one taken as given [rad], shape (R,).

    Of several axes and clampings it is the largest; None where no axis was measured on both sides.
    """
    reversals = list(_reversals(tables, estimate))
    if not reversals:
        return None
    weights = np.stack([each.angle for each in reversals])
    whole = _quotients(estimate).arctan().weighted(weights).value
    largest = np.abs(whole).argmax(axis=-1)
    return np.asarray(np.take_along_axis(whole, largest[..., None], axis=-1)[..., 0])


def misalignment_stack(
    tables: Sequence[PreparedTable], estimate: JointEstimate, temperatures: Array
) -> tuple[Array, Array]:
    """Tell the misalignments of R records free of the fixture angle, shape (R, tables) [rad].

    They are what `FixtureAngle.nearest` has for the temperature of each table [degC], with expanded
    uncertainties; NaN where one side of the axis was measured only.
    """
    value, expanded = (np.full(temperatures.shape, np.nan) for _ in range(2))
    axes = np.array([table.axis for table in tables])
    for reversal in reversed(list(_reversals(tables, estimate))):  # the first of an axis counts
        weights, own = reversal.misalignments, np.flatnonzero(axes == reversal.axis)
        free = _quotients(estimate).arctan().weighted(weights).tan()
        known = interval_stack(propagate(estimate.components, free.by_all))
        level = _nearest(temperatures[:, own], _means(temperatures, weights != 0.0))
        value[:, own] = np.take_along_axis(free.value, level, axis=1)
        expanded[:, own] = np.take_along_axis(known.expanded, level, axis=1)
    return value, expanded


def _means(temperatures: Array, chosen: Mask) -> Array:
    """Mean temperature of some tables, shape (R, L); NaN where that of one is unknown."""
    known = np.nan_to_num(temperatures) @ _mean(chosen).T
    return np.where(np.isnan(temperatures) @ chosen.T, np.nan, known)


def _nearest(temperatures: Array, levels: Array) -> Places:
    """Place of the level, (R, L), that is nearest to each temperature, (R, m)."""
    away = np.nan_to_num(np.abs(temperatures[..., None] - levels[:, None]), nan=np.inf)
    return np.asarray(away.argmin(axis=2))


def _told(reversal: _Reversal, estimate: JointEstimate, delta0: float) -> FixtureAngle:
    angles, levels = _quotients(estimate).arctan(), len(reversal.levels)
    parts = [
        angles.weighted(reversal.angle[None]).plus(delta0),
        angles.weighted(reversal.misalignments).tan(),
    ]
    if _tells_couplings(estimate, reversal.misalignments):
        parts.append(_quotients(estimate, "M_ip").weighted(reversal.misalignments))
    values = np.concatenate([part.value for part in parts])
    components = propagate(estimate.components, np.vstack([part.by_all for part in parts]))
    units = ["rad" if i <= levels else _G for i in range(values.size)]
    fixture, *rest = interval_stack(components).around(values, units)
    names, matrix = _covariance(components, levels)
    return FixtureAngle(
        axis=reversal.axis,
        angle=fixture,
        temperatures=tuple(float(t) if np.isfinite(t) else None for t in reversal.levels),
        misalignments=tuple(rest[:levels]),
        couplings=tuple(rest[levels:]),
        covariance_names=names,
        covariance_matrix=matrix,
        clamping_deg=reversal.clamping,
    )


def _covariance(components: Mapping[str, Component], levels: int) -> Covariance:
    matrix = np.sum([part.covariance for part in components.values()], axis=0)
    if not np.isfinite(matrix).all():
        return (), ()
    each = range(1, levels + 1)
    names = ["delta0", *(f"delta_{i}" for i in each), *(f"delta_ip_{i}" for i in each)]
    return tuple(names[: len(matrix)]), rows_of(matrix)


def _tells_couplings(estimate: JointEstimate, weights: Array) -> bool:
    used = np.flatnonzero(weights.any(axis=0)).tolist()
    return all("M_ip" in estimate.names[i] and "M_ip" not in estimate.stands_for[i] for i in used)


def free_of_fixture_angle(
    tables: Sequence[PreparedTable], estimate: JointEstimate
) -> JointEstimate:
    """Take the fixture angle out of M, where both sides of an axis were measured.

    M and its error components of the tables of these axes are freed by the angle of their own
    level, or by the mean angle where a level has one side only. It is the same object where no axis
    was measured on both sides.
    """
    corrections = [reversal.correction for reversal in _reversals(tables, estimate)]
    if not corrections:
        return estimate
    correction = np.sum(corrections, axis=0)
    effective, chosen = _quotients(estimate), np.flatnonzero(correction.any(axis=1))
    free = effective.arctan().weighted(np.eye(len(correction)) + correction).tan()
    change = _of_tables(estimate, "K1") * (free - effective)
    own = Linearised(change.value[..., chosen], change.by_all[..., chosen, :])
    return adjusted(estimate, [(i, "M") for i in chosen.tolist()], own)


def _reversals(tables: Sequence[PreparedTable], estimate: JointEstimate) -> Iterator[_Reversal]:
    mountings = [table.mounting for table in tables]
    clampings = [clamping_of(table) for table in tables]
    for axis, clamping in itertools.product("op", sorted(set(clampings))):
        sides = np.array(
            [
                side_of(m) * (m[0] == axis and c == clamping and tells_misalignment(estimate, i))
                for i, (m, c) in enumerate(zip(mountings, clampings, strict=True))
            ]
        )
        if not sides.min() < 0.0 < sides.max():
            continue
        levels = list(_levels([table.record.mean_temperature for table in tables], sides))
        if levels:
            yield _reversal(axis, clamping, sides, levels)


def clamping_of(table: PreparedTable) -> float:
    """Angle at which the fixture of a table is clamped on the head [deg]."""
    clamping = table.record.clamping
    return 0.0 if clamping is None else float(clamping[0])


def tells_misalignment(estimate: JointEstimate, table: int) -> bool:
    """Tell whether M of a table is estimated and holds nothing else."""
    return "M" in estimate.names[table] and "M" not in estimate.stands_for[table]


def _levels(temperatures: Sequence[float], sides: Array) -> Iterator[tuple[float, Array]]:
    """Levels with both sides: mean temperature, and which tables belong to them."""
    at, used = np.array(temperatures), sides != 0.0
    known = [np.isin(range(at.size), own) for own in same_levels(np.where(used, at, np.nan))]
    for here in sorted([*known, used & np.isnan(at)], key=np.argmax):  # as they were met
        if {1.0, -1.0} <= set(sides[here].tolist()):
            yield float(at[here].mean()), here


def _reversal(
    axis: str, clamping: float, sides: Array, levels: Sequence[tuple[float, Array]]
) -> _Reversal:
    means = np.array([[_mean(here & (sides == s)) for s in (1.0, -1.0)] for _, here in levels])
    plus, minus = means[:, 0], means[:, 1]
    angles = (minus - plus) / 2.0
    correction = np.outer(sides, angles.mean(axis=0))
    for (_, here), angle in zip(levels, angles, strict=True):
        correction[here] = np.outer(sides[here], angle)
    temperatures = tuple(temperature for temperature, _ in levels)
    middle = (plus + minus) / 2.0
    return _Reversal(axis, clamping, angles.mean(axis=0), temperatures, middle, correction)


def _mean(chosen: Mask) -> Array:
    return np.asarray(chosen / chosen.sum(axis=-1, keepdims=True))


def _quotients(estimate: JointEstimate, name: str = "M") -> Linearised:
    """Quotient by K1 of a coefficient of each table."""
    return _of_tables(estimate, name) / _of_tables(estimate, "K1")


def _of_tables(estimate: JointEstimate, name: str) -> Linearised:
    tables = range(len(estimate.names))
    return Linearised.of_tables([Linearised.of(estimate, i, name) for i in tables])
