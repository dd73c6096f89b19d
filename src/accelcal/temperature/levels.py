"""What the tables of records tell the temperature laws: coefficients, errors and temperatures.

Records of one plan are stacked: the same runs and mountings in the same order, while the levels
that were really reached differ from record to record.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arrays import Array, Places
from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.launch import SAME_LEVEL
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.uncertainty import Component, propagate
from accelcal.model import BIAS, COEFFICIENTS, ERROR_TERMS, MISALIGNMENT, SCALE_FACTOR, WITHOUT_LAWS
from accelcal.numerics.grouping import places_of_equals
from accelcal.reference import LEAST_RISE
from accelcal.temperature.weaknesses import OF_LOOP


class RecordedTemperatures(NamedTuple):
    """Temperatures of R records of one plan."""

    # shape (R, n): temperatures of the readings of each table, those unknown at their mean [degC]
    readings: Sequence[Array]
    levels: Array  # shape (R, tables): mean temperature of each table; NaN where unknown [degC]
    reference: Array  # shape (R,): T0; NaN where there is none [degC]

    @property
    def rise(self) -> Array:
        """Level of each table above T0, shape (R, tables) [degC]."""
        return self.levels - self.reference[:, None]

    @property
    def span(self) -> Array:
        """Range of the readings' temperatures in each table, shape (R, tables) [degC]."""
        return np.stack([np.ptp(own, axis=1) for own in self.readings], axis=1)

    @property
    def away(self) -> Array:
        """Most by which a reading's temperature is away from its level, as `span` [degC]."""
        pairs = zip(self.readings, self.levels.T, strict=True)
        return np.stack([np.abs(own - level[:, None]).max(axis=1) for own, level in pairs], axis=1)


class AtRest(NamedTuple):
    """Readings of R records at the mean temperatures of their runs."""

    # shape (R, n): readings of each table; other than before where they moved [output unit]
    outputs: tuple[Array, ...]
    # shape (R, tables): share of the recorded scatter, as a variance, that the accelerometer did
    # not feel
    unfelt: Array
    # what was done with each record, and which of its tables move still
    said: Sequence[tuple[str, ...]]

    @classmethod
    def of(cls, outputs: Sequence[Array]) -> AtRest:
        """Leave the readings as they are."""
        records = len(outputs[0])
        return cls(tuple(outputs), np.ones((records, len(outputs))), [()] * records)


def stacked_temperature_uncertainty(
    temperatures: Sequence[Array], declared: float | None, share: ArrayLike = 1.0
) -> tuple[Array, Array]:
    """Uncertainty of the mean temperature of each run of many records, and its degrees of freedom.

    It is the declared one, but not less than that of the mean of what was recorded, of shape (R, n)
    for each table; both are of shape (R, tables). Where the declared one counts, its degrees of
    freedom are infinite. Of the recorded scatter, as a variance, the accelerometer did not feel the
    share, of shape (R, tables) or less.

    Notes
    -----
    The mean of n temperatures of scatter s has the standard uncertainty s / sqrt(n). A temperature
    that stands unchanged over several readings was taken once.
    """
    changes = [np.count_nonzero(own[:, 1:] != own[:, :-1], axis=1) for own in temperatures]
    taken = 1.0 + np.stack(changes, axis=1)
    scatter = np.zeros_like(taken)  # where all are equal; std would give a rounding error
    for table, own in enumerate(temperatures):
        moves = taken[:, table] > 1.0
        if moves.any():
            scatter[moves, table] = own[moves].std(axis=1, ddof=1)
    seen = scatter * np.sqrt(np.asarray(share) / taken)
    least = declared or 0.0
    return np.maximum(seen, least), np.where(seen > least, np.maximum(taken - 1.0, 1.0), np.inf)


_WITH_LAW = [BIAS, SCALE_FACTOR, MISALIGNMENT]


class LevelStack(NamedTuple):
    """n tables of one mounting in each of R records, in which K0, K1 and M mean the same."""

    temperature: Array  # shape (R, n): mean temperature of each table [degC]; NaN where unknown
    # shape (R, n): its standard uncertainty [degC], and the degrees of freedom
    uncertainty: Array
    dof: Array
    reference: Array  # shape (R,): T0 [degC]; NaN where there is none
    coefficients: Array  # shape (R, n, 6): coefficients [output unit / g^n]
    # components of the errors of all P coefficients that are estimated in the records, with the
    # shifts of all runs alike (`accelcal.estimate.joint.JointEstimate.alike`)
    components: Mapping[str, Component]
    # shape (n, 6): place of each coefficient among those P; -1 where it is not estimated
    place: Places
    order: Places  # shape (n,): order in which the runs were made
    # where the shift of the bias from launch to launch is from, see
    # `accelcal.temperature.weaknesses.law_sentences`
    shift_source: str
    unit: str | None  # of the output

    @property
    def rise(self) -> Array:
        """T - T0, shape (R, n) [degC]."""
        return self.temperature - self.reference[:, None]

    def of_records(self, rows: Places) -> LevelStack:
        """Keep some of the records."""
        if rows.size == len(self.reference):
            return self
        by_record = ("temperature", "uncertainty", "dof", "reference", "coefficients")
        own: dict[str, Any] = {name: getattr(self, name)[rows] for name in by_record}
        parts = {name: part.of_records(rows) for name, part in self.components.items()}
        return self._replace(components=parts, **own)


def level_stack(
    tables: Sequence[PreparedTable],
    estimate: JointEstimate,
    temperatures: RecordedTemperatures,
    uncertain: tuple[Array, Array],
    chosen: Sequence[int],
) -> LevelStack:
    """Take the chosen tables of R records of one plan."""
    own, shift = [tables[i] for i in chosen], estimate.bias_shift
    coefficients = [estimate.coefficients[i] for i in chosen]
    return LevelStack(
        temperature=temperatures.levels[:, chosen],
        uncertainty=uncertain[0][:, chosen],
        dof=uncertain[1][:, chosen],
        reference=temperatures.reference,
        coefficients=np.stack(coefficients, axis=1),
        components={**estimate.components, **estimate.alike},
        place=np.array([_places(estimate, i) for i in chosen]),
        order=np.argsort([table.run for table in own], kind="stable"),
        shift_source=OF_LOOP if shift.holds_loop else shift.source,
        unit=own[0].record.unit,
    )


def _places(estimate: JointEstimate, table: int) -> list[int]:
    """Place of each coefficient of a table among those of all tables; -1 for those without."""
    own = estimate.names[table]
    return [estimate.place(table, name) if name in own else -1 for name in COEFFICIENTS]


def alike(stack: LevelStack) -> list[Places]:
    """Group the records that have laws by the course of their levels.

    Those of a group have levels that are sorted alike, close to each other alike, met alike by
    heating or cooling, on the same sides of T0, and with the same one nearest to it. Those with one
    level only, or with an unknown one, are in none.
    """
    rise, temperature = stack.rise, stack.temperature
    if rise.shape[1] < 2:
        return []
    met = np.diff(temperature[:, stack.order], axis=1)
    sort = np.argsort(temperature, axis=1, kind="stable")
    apart = np.diff(np.take_along_axis(temperature, sort, axis=1), axis=1) > SAME_LEVEL
    course = np.sign(met) * (np.abs(met) > SAME_LEVEL)
    sides = [rise.max(axis=1) > LEAST_RISE, rise.min(axis=1) < -LEAST_RISE]
    nearest = np.abs(rise).argmin(axis=1)
    key = np.column_stack([sort, apart, course, *sides, nearest]).astype(np.float64)
    slope = (sides[0] | sides[1]) & (np.ptp(rise, axis=1) >= LEAST_RISE)
    rows = np.flatnonzero(np.isfinite(rise).all(axis=1) & slope)
    keys = key[rows].view(f"V{8 * key.shape[1]}")[:, 0].tolist()
    return [rows[places] for places in places_of_equals(keys)]


class Levels(NamedTuple):
    """k0, K1 and delta of n tables in R records alike, with the components of their errors.

    `values`, shape (R, 3, n), and the covariances of the components, shape (R, 3, n, n), are of
    each quantity by itself: its law is fitted by itself. `by_heat`, shape (R, 3, n), is what an
    error of each temperature does, and `by_loop`, shape (R, n, m), are columns of errors of k0.
    """

    values: Array
    components: Mapping[str, Component]
    by_heat: Array
    by_loop: Array

    @property
    def covariance(self) -> Array:
        """Covariance of the values of each quantity, shape (R, 3, n, n)."""
        return np.asarray(sum(part.covariance for part in self.components.values()))

    @property
    def share_of_heat(self) -> Array:
        """Largest share of a variance at each level that errors of its temperature make, (R, n)."""
        whole = np.diagonal(self.covariance, axis1=-2, axis2=-1)
        heat = np.broadcast_to(self.by_heat**2, whole.shape)
        share = np.divide(heat, whole, out=np.zeros_like(whole), where=whole > 0.0)
        return np.asarray(share.max(axis=1))

    def at_uncertain_levels(self, by_heat: Array, dof: Array, by_loop: Array) -> Levels:
        """Add what errors of the temperatures do, and runs off the middle of a loop.

        `dof`, shape (R, n), are the degrees of freedom of the temperatures.
        """
        heat = by_heat[..., None] ** 2 * np.eye(by_heat.shape[2])
        loop = np.zeros_like(heat)
        loop[:, 0] = by_loop @ by_loop.mT
        more = {
            "temperature": Component(heat, np.broadcast_to(dof[:, None], by_heat.shape)),
            "hysteresis": Component(loop, np.full(by_heat.shape, np.inf)),
        }
        return Levels(self.values, {**self.components, **more}, by_heat, by_loop)


def levels_of(stack: LevelStack) -> Levels:
    """Take the quotients by K1 and their error components, by the law of propagation."""
    tables = np.arange(len(stack.place))
    quotients = _Quotients.of(stack.coefficients, stack.place, tables, np.array(_WITH_LAW)[:, None])
    values = np.moveaxis(quotients.value, -1, 0).copy()
    values[:, 1] = stack.coefficients[..., SCALE_FACTOR]
    components = {name: quotients.errors(part) for name, part in stack.components.items()}
    return Levels(values, components, np.zeros_like(values), np.zeros((*values[:, 1].shape, 0)))


class _Quotients(NamedTuple):
    """Quotients of coefficients by the K1 of their table; K1 itself stays what it is.

    `at` and `at_k1` are places among all coefficients that are estimated. `value`, 0 for K1, and
    `over`, 1 for K1, have the records as their last axis: all others are too short for numpy to be
    quick along them.
    """

    at: Places
    at_k1: Places
    value: Array
    over: Array

    @classmethod
    def of(cls, coefficients: Array, place: Places, table: Places, column: Places) -> _Quotients:
        """Take some columns of coefficients, shape (R, n, 6), each of its table."""
        k, is_k1 = np.ascontiguousarray(coefficients.T), (column == SCALE_FACTOR)[..., None]
        over = np.where(is_k1, 1.0, k[SCALE_FACTOR, table])
        value = np.where(is_k1, 0.0, k[column, table] / over)
        return cls(place[table, column], place[table, SCALE_FACTOR], value, over)

    def errors(self, part: Component) -> Component:
        """Carry a component of the errors of all coefficients over, by the law of propagation."""
        at, at_k1, value, over = self
        row, column = at[..., :, None], at[..., None, :]
        whole = part.covariance.transpose(1, 2, 0)
        mixed = value[..., :, None, :] * whole[at_k1[:, None], column]
        found = whole[row, column]
        found -= mixed
        found -= mixed.swapaxes(-3, -2)
        np.multiply(value[..., :, None, :], value[..., None, :, :], out=mixed)
        mixed *= whole[at_k1[:, None], at_k1]
        found += mixed
        found /= over[..., :, None, :] * over[..., None, :, :]
        fewest = np.minimum(part.dof[:, at], part.dof[:, np.broadcast_to(at_k1, at.shape)])
        return Component(np.ascontiguousarray(np.moveaxis(found, -1, 0)), fewest)


def joint_components(
    stack: LevelStack, levels: Levels, record: int, laws: Array
) -> tuple[dict[str, Component], tuple[str, ...]]:
    """Errors of the laws of one record, by its place, and of what follows no law.

    The laws are a map, shape (m, 3 n), from k0 of all tables, then K1, then delta, to their
    parameters. The components are those of the m parameters, then of the others, which are named:
    k2, k3 and delta_ip, each of the table nearest to T0 that tells it by itself.
    """
    place, one = stack.place, slice(record, record + 1)
    size, near = len(place), np.argsort(np.abs(stack.rise[record]).round(6), kind="stable")
    others = [COEFFICIENTS.index(name) for name in WITHOUT_LAWS]
    told = [(near[place[near, c] >= 0][0], c) for c in others if (place[:, c] >= 0).any()]
    lines = [(table, c) for c in _WITH_LAW for table in range(size)]
    quotients = _Quotients.of(stack.coefficients[one], place, *np.array(lines + told).T)
    through = np.pad(laws, (0, len(told)))
    through[len(laws) :, laws.shape[1] :] = np.eye(len(told))
    found: dict[str, Component] = {}
    # one after the other: of many tables, each is large before it goes through
    for name, part in stack.components.items():
        own = quotients.errors(part.of_records(one))
        found |= propagate({name: Component(own.covariance[0], own.dof[0])}, through)
    found |= propagate(_of_levels(levels, record, len(told)), through)
    return found, tuple(ERROR_TERMS[COEFFICIENTS[c]] for _, c in told)


def _of_levels(levels: Levels, record: int, others: int) -> dict[str, Component]:
    """Errors of the temperatures and of a loop, which act on all quantities of a table together."""
    heat = levels.by_heat[record]
    by_heat = (heat[:, :, None] * np.eye(heat.shape[1])).reshape(heat.size, -1)
    found = {}
    for name, columns in (("temperature", by_heat), ("hysteresis", levels.by_loop[record])):
        if name in levels.components:
            acting = np.pad(columns, ((0, heat.size + others - len(columns)), (0, 0)))
            dof = np.full(len(acting), np.inf)
            dof[: heat.size] = levels.components[name].dof[record].ravel()
            found[name] = Component(acting @ acting.T, dof)
    return found
