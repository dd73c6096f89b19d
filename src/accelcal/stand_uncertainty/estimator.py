"""From readings to coefficients, error model and temperature slopes: one matrix, then quotients.

The coefficients of each table are a matrix times its readings, as `accelcal.fit` has it where no
head error is declared. The temperature laws follow from the coefficients of the tables by
unweighted least squares, which at three levels is exact.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.estimate.launch import SAME_LEVEL
from accelcal.estimate.tables import METHODS, linear_estimator, prepare
from accelcal.model import (
    COEFFICIENTS,
    CROSS_AXES,
    ERROR_TERMS,
    ERROR_UNITS,
    LAW_COEFFICIENTS,
    SLOPES,
    coefficient_unit,
    law_units,
)
from accelcal.record import TumbleRecord
from accelcal.reference import bilinear_design, measured_sides
from accelcal.results.stand_budget import BudgetedCoefficient
from accelcal.stand_uncertainty.readings import StandReadings

_ROUNDING = 1e-13
_DIFFERENCE = np.array([-1.0, 1.0])


@dataclass(frozen=True, slots=True)
class _Table:
    """Place of one table's readings and coefficients among all."""

    label: str
    mounting: str
    rise: float
    names: tuple[str, ...]
    start: int

    def value(self, name: str) -> Callable[[Array], Array]:
        """Coefficient, from those of all tables."""
        place = self.start + self.names.index(name)
        return lambda known: known[..., place]

    def quotient(self, name: str) -> Callable[[Array], Array]:
        """Coefficient over K1, last line of (6)."""
        own, K1 = self.value(name), self.value("K1")
        return lambda known: own(known) / K1(known)


Rule = tuple[BudgetedCoefficient, Callable[[Array], Array]]
"""What is budgeted, and how it follows from coefficients and gravity."""


@dataclass(frozen=True, eq=False)
class Estimator:
    """Coefficients of all tables and what follows from them."""

    map: Array  # shape (p, n): from the n readings to the p coefficients of all tables
    fitted: Array  # shape (n, p): from the coefficients back to the readings
    tables: tuple[_Table, ...]  # the tables, the one nearest to T0 first
    unit: str  # of the output
    gravity: float | None  # declared local gravity, to express K1 per m/s^2 [m/s^2]

    def estimates(self, known: Array) -> Array:
        """All that is budgeted, in the order of `named`, from the coefficients of the tables.

        What is known, real or complex, are these coefficients and, behind them, declared over true
        gravity: from shape (..., p + 1) to (..., q).
        """
        return np.stack([rule(known) for _, rule in self._rules], axis=-1)

    def dust(self, scale_factor: float) -> Array:
        """Sizes below which a change of an estimate is rounding error, shape (q,).

        That is some hundred times the rounding error of a number of 1, or, in the unit of the
        output, of the scale factor.
        """
        of_output = [name.unit.startswith(self.unit) for name in self.named]
        return _ROUNDING * np.where(of_output, abs(scale_factor), 1.0)

    @property
    def named(self) -> tuple[BudgetedCoefficient, ...]:
        """Symbols, places and units of what is budgeted."""
        return tuple(name for name, _ in self._rules)

    @cached_property
    def _rules(self) -> list[Rule]:
        found = [rule for table in self.tables for rule in self._of_table(table)]
        found += self._slopes()
        found += self._reversals()
        found += self._changes()
        if self.gravity is not None:
            found.append(self._per_gravity(self.gravity))
        return found

    def _of_table(self, table: _Table) -> Iterator[Rule]:
        where = "" if table is self.tables[0] else table.label
        for name in table.names:
            unit = coefficient_unit(name, self.unit)
            yield BudgetedCoefficient(name, where, unit), table.value(name)
        for name in table.names:
            if name in ERROR_TERMS:
                symbol = ERROR_TERMS[name]
                named = BudgetedCoefficient(symbol, where, ERROR_UNITS[symbol])
                yield named, table.quotient(name)

    def _per_gravity(self, gravity: float) -> Rule:
        K1 = self.tables[0].value("K1")
        named = BudgetedCoefficient("K1 per m/s^2", "", f"{self.unit}/(m/s^2)")
        return named, lambda known: K1(known) / gravity / known[..., -1]

    def _slopes(self) -> Iterator[Rule]:
        """Slopes of the bilinear laws, from the tables of one mounting."""
        mounting = self.tables[0].mounting
        tell = set(LAW_COEFFICIENTS).issubset
        levels = [t for t in self.tables if t.mounting == mounting and tell(t.names)]
        rise = np.array([table.rise for table in levels])
        design = bilinear_design(rise, sides := measured_sides(rise))
        if np.linalg.matrix_rank(design) < design.shape[1]:
            return
        matrix = np.linalg.pinv(design)
        values = {
            "k0": [table.quotient("K0") for table in levels],
            "K1": [table.value("K1") for table in levels],
            "delta": [table.quotient("M") for table in levels],
        }
        for symbol, (law, side) in SLOPES.items():
            if side in sides:
                named = BudgetedCoefficient(symbol, "", law_units()[law][1])
                over = matrix[0] if law == "K1" else None
                yield named, _weighted(values[law], matrix[1 + sides.index(side)], over)

    def _reversals(self) -> Iterator[Rule]:
        """Misalignment and fixture angle, which changes its sign in M - K1 d0 of the other side."""
        near = [t for t in self.tables if _same_level(t, self.tables[0])]
        by_side = {table.mounting: table for table in near if "M" in table.names}
        for axis, seen in CROSS_AXES.items():
            if {f"{axis}+", f"{axis}-"} <= set(by_side):
                plus, minus = (by_side[f"{axis}{side}"] for side in "+-")
                where = f"{plus.label} and {minus.label}"
                both = [plus.quotient("M"), minus.quotient("M")]
                rules = ((seen.misalignment, (0.5, 0.5)), (f"d0_{axis}", (-0.5, 0.5)))
                for symbol, weights in rules:
                    named = BudgetedCoefficient(symbol, where, "rad")
                    yield named, _weighted(both, np.array(weights))

    def _changes(self) -> Iterator[Rule]:
        """Changes of bias and scale factor between the first two runs at one level."""
        first = self.tables[0]
        again = [
            t for t in self.tables[1:] if _same_level(t, first) and t.mounting == first.mounting
        ]
        if not again or "K0" not in first.names or "K0" not in again[0].names:
            return
        where = f"{first.label} to {again[0].label}"
        named = BudgetedCoefficient("k0 change", where, "g")
        yield named, _weighted([first.quotient("K0"), again[0].quotient("K0")], _DIFFERENCE)
        named = BudgetedCoefficient("K1 change", where, "1")
        K1 = [first.value("K1"), again[0].value("K1")]
        yield named, _weighted(K1, _DIFFERENCE, over=np.array([1.0, 0.0]))


def _same_level(one: _Table, other: _Table) -> bool:
    return abs(one.rise - other.rise) <= SAME_LEVEL


def _weighted(
    rules: Sequence[Callable[[Array], Array]], weights: Array, over: Array | None = None
) -> Callable[[Array], Array]:
    """Weighted sum of some values, or the quotient of two of them."""

    def rule(known: Array) -> Array:
        values = np.stack([value(known) for value in rules], axis=-1)
        total = values @ weights
        return np.asarray(total if over is None else total / (values @ over))

    return rule


def estimator_of(
    readings: StandReadings, method: str = METHODS[0], gravity: float | None = None
) -> Estimator:
    """Make the estimator of a test, by one of `accelcal.estimate.tables.METHODS`.

    Raises
    ------
    DesignError
        If the angles do not determine K1, or a closed form meets another test than its own.
    """
    record = replace(readings.record, output=readings.output({}))
    masks = list(record.table_masks())
    prepared = [prepare(record.select(mask), delta0=readings.delta0) for mask in masks]
    own = [linear_estimator(table, method, readings.delta0) for table in prepared]
    starts = accumulate((len(one.names) for one in own), initial=0)
    each = zip(masks, own, starts, strict=False)
    tables = [_table(readings, mask, one.names, start) for mask, one, start in each]
    columns = [[COEFFICIENTS.index(name) for name in one.names] for one in own]
    designs = [table.design[:, kept].T for table, kept in zip(prepared, columns, strict=True)]
    return Estimator(
        map=_assembled([one.map for one in own], masks),
        fitted=_assembled(designs, masks).T,
        tables=tuple(sorted(tables, key=lambda table: abs(table.rise))),
        unit=readings.unit or "output unit",
        gravity=gravity,
    )


def _table(readings: StandReadings, mask: Mask, names: tuple[str, ...], start: int) -> _Table:
    record: TumbleRecord = readings.record
    run = int(record.run[mask][0])
    mounting = str(record.mounting[mask][0])
    rise = float(readings.conditions.excess[mask].mean())
    temperature = rise + readings.accelerometer.reference_temperature
    label = f"run {record.run_labels[run]}, {temperature:g} degC, {mounting}"
    return _Table(label, mounting, rise, names, start)


def _assembled(blocks: Sequence[Array], masks: Sequence[Mask]) -> Array:
    """Put the blocks of all tables into one matrix over all readings."""
    rows = np.zeros((sum(map(len, blocks)), masks[0].size))
    start = 0
    for block, mask in zip(blocks, masks, strict=True):
        rows[start : start + len(block), mask] = block
        start += len(block)
    return rows
