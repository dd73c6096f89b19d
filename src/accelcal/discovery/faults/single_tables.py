"""Tables of a record, each fitted by itself."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.discovery.faults.fault import SMALLEST
from accelcal.estimate.tables import PreparedTable, prepare
from accelcal.numerics.probability import student_survival
from accelcal.record import TumbleRecord


class SingleTable(NamedTuple):
    """A table with its least-squares coefficients."""

    table: PreparedTable
    values: Mapping[str, float]  # coefficients that the angles determine [output unit / g^n]
    rest: Array  # what they leave of the readings, (n,) [output unit]
    dof: float  # degrees of freedom of that, 1 where there are none

    def error(self, name: str) -> float:
        """Standard uncertainty of a coefficient, by what is left of the readings."""
        row = self.table.least_squares.map[self.table.estimability.kept.index(name)]
        return float(max(np.sqrt(row @ row * (self.rest @ self.rest) / self.dof), SMALLEST))

    def chance(self, name: str) -> float:
        """Chance of the size of a coefficient, if it is 0."""
        return 2.0 * student_survival(abs(self.values[name]) / self.error(name), self.dof)


def tables_of(record: TumbleRecord) -> list[Mask]:
    """Readings of each table that has more than one."""
    return [own for own in record.table_masks() if own.sum() > 1]


def single_table(record: TumbleRecord, readings: Mask, delta0: float) -> SingleTable:
    """Fit one of the tables of a record, with a fixture angle [rad]."""
    table = prepare(record.select(readings), delta0=delta0)
    values = table.least_squares.solve(table.record.output)
    rest = table.record.output - table.kept_design @ values
    told = dict(zip(table.estimability.kept, values.tolist(), strict=True))
    return SingleTable(table, told, rest, max(float(rest.size - values.size), 1.0))
