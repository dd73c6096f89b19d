"""The temperature laws of a record: of its main axis, and of the other one along the shaft.

Their slopes tell what an error of the temperature does to the coefficients of a table, which are
stated at one temperature.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.reversal import free_of_fixture_angle
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.uncertainty import Component
from accelcal.model import BIAS, COEFFICIENTS, LAWS, MISALIGNMENT, SCALE_FACTOR
from accelcal.numerics.grouping import grouped
from accelcal.reference import LEAST_RISE
from accelcal.results.covariance import NO_COVARIANCE, Rows, rows_of
from accelcal.results.temperature import TemperatureModel
from accelcal.temperature.from_tables import LawsOfRecords, laws_of_records
from accelcal.temperature.levels import (
    RecordedTemperatures,
    level_stack,
    stacked_temperature_uncertainty,
)
from accelcal.temperature.one_meaning import tables_of_one_mounting, with_one_meaning


class Slopes(NamedTuple):
    """Scale factor at T0 and the slopes of the laws of R records; NaN where not determined."""

    # shape (R,): whether a record has laws at all; its levels may determine nothing of them
    has_laws: Mask
    # shape (R,): scale factor at T0 and its standard uncertainty [output unit / g]
    K1: Array
    K1_uncertainty: Array
    # shape (R, 3): slopes of k0 [g/degC], of K1 [1/degC] and of delta [rad/degC]
    above: Array
    below: Array

    @classmethod
    def of(cls, laws: LawsOfRecords) -> Slopes:
        """Take those of many records."""

        def columns(part: str) -> list[int]:
            return [laws.names.index(f"{law} {part}") for law in LAWS]

        K1 = columns("at_T0")[1]
        slopes = (laws.value[:, columns(side)] for side in ("above", "below"))
        return cls(laws.has_laws, laws.value[:, K1], laws.standard[:, K1], *slopes)

    @classmethod
    def without_laws(cls, records: int) -> Slopes:
        """Slopes of records that have none."""
        unknown = np.full((records, len(LAWS)), np.nan)
        nothing = np.zeros(records, dtype=np.bool_)
        return cls(nothing, unknown[:, 0], unknown[:, 0], unknown, unknown)

    def steepest_of_scale_factor(self) -> Array:
        """Largest relative slope of K1, shape (R,); 0 where there is none [1/degC]."""
        above, below = np.abs(self.above[:, 1]), np.abs(self.below[:, 1])
        return np.asarray(np.fmax(np.fmax(above, below), 0.0))

    def at(self, rise: Array) -> Array:
        """Slopes at a rise, (R,), shape (R, 3); near T0, where the sign counts, of both sides."""
        above, below = np.isfinite(self.above), np.isfinite(self.below)
        above, below = above & (rise > -LEAST_RISE)[:, None], below & (rise < LEAST_RISE)[:, None]
        whole = np.where(above, self.above, 0.0) + np.where(below, self.below, 0.0)
        return np.asarray(whole / np.maximum(above.astype(int) + below, 1))


def stacked_temperature_component(
    tables: Sequence[PreparedTable],
    estimate: JointEstimate,
    slopes: Slopes,
    rise: Array,
    uncertain: tuple[Array, Array],
) -> Component | None:
    """Find what errors of the temperatures of the runs make of all coefficients, table after table.

    It is zero in records without slopes, and None where all temperatures are exact. The rise is
    that of each table, shape (R, tables).

    Notes
    -----
    A coefficient K = K1 k changes by (K1'/K1) K + K1 k' a degree; k' is known for the bias and,
    in the mounting of the laws, for the misalignment. All coefficients of a run have the same
    error of temperature. The laws do not take this component: they weigh it at the slopes of
    their own.
    """
    if not uncertain[0].any():
        return None
    runs, column, _ = grouped(np.array([table.run for table in tables]))
    of_laws = set(tables_of_one_mounting(tables, estimate))
    sizes = [len(names) for names in estimate.names]
    through = np.zeros((len(rise), sum(sizes), runs.size))
    for i, edge in enumerate(np.cumsum([0, *sizes])[:-1].tolist()):
        rate = _rate(slopes, rise[:, i], estimate.coefficients[i], with_misalignment=i in of_laws)
        kept = [COEFFICIENTS.index(name) for name in estimate.names[i]]
        own = np.nan_to_num(uncertain[0][:, i, None] * rate[:, kept])
        through[:, edge : edge + sizes[i], column[i]] = own
    return Component(through @ through.mT, np.repeat(uncertain[1], sizes, axis=1))


def _rate(slopes: Slopes, rise: Array, k: Array, *, with_misalignment: bool) -> Array:
    """Change of the coefficients of one table by the temperature, shape (R, 6)."""
    by_bias, by_scale, by_tilt = slopes.at(rise).T
    scale_factor = k[:, SCALE_FACTOR]
    rate = (slopes.K1 * by_scale / scale_factor)[:, None] * k
    rate[:, BIAS] += scale_factor * by_bias
    if with_misalignment:
        rate[:, MISALIGNMENT] += scale_factor * by_tilt
    return np.where(np.isfinite(slopes.K1)[:, None], rate, 0.0)


class StackLaws(NamedTuple):
    """Temperature laws of R records of one plan."""

    # those of the mounting with most tables; None where it has one level only
    main: LawsOfRecords | None
    second_axis: LawsOfRecords | None  # those of the other axis along the shaft, from its tables
    # what errors of the temperature do to the coefficients of all tables
    of_tables: Component | None
    # whether both sides of an axis free the misalignments of the fixture angle
    is_free: bool = False

    def slopes(self, records: int) -> Slopes:
        """Slopes of the main axis of all R records."""
        return Slopes.without_laws(records) if self.main is None else Slopes.of(self.main)


def laws_of_stack(
    tables: Sequence[PreparedTable],
    estimate: JointEstimate,
    temperatures: RecordedTemperatures,
    unfelt: Array | float = 1.0,
) -> StackLaws:
    """Fit the temperature laws of both axes of many records, to the coefficients of the tables.

    The misalignments are free of the fixture angle where both sides of an axis were measured. Of
    the recorded scatter, as a variance, the accelerometer did not feel the share `unfelt`, shape
    (R, tables) or a number.
    """
    estimate = with_one_meaning(tables, estimate)
    free = free_of_fixture_angle(tables, estimate)
    declared = tables[0].record.apparatus.temperature_uncertainty
    uncertain = stacked_temperature_uncertainty(temperatures.readings, declared, unfelt)

    def of(chosen: list[int]) -> LawsOfRecords | None:
        if len(chosen) < 2:
            return None
        return laws_of_records(level_stack(tables, free, temperatures, uncertain, chosen))

    chosen = tables_of_one_mounting(tables, estimate)
    if not chosen:
        return StackLaws(None, None, None)
    axis = tables[chosen[0]].axis
    main = of(chosen)
    second = of(tables_of_one_mounting(tables, estimate, "p" if axis == "o" else "o"))
    if main is None:
        return StackLaws(None, second, None)
    slopes = Slopes.of(main)
    heat = stacked_temperature_component(tables, estimate, slopes, temperatures.rise, uncertain)
    return StackLaws(main, second, heat, free is not estimate)


def with_misalignment(readings: TemperatureModel, tables: TemperatureModel) -> TemperatureModel:
    """Take the law of the misalignment from the tables, where the fixture angle is out of it.

    All else is from the readings; the correlations between both are not known and left at zero.
    """
    names = readings.covariance_names
    if not names or not set(names) <= set(tables.covariance_names):
        return replace(readings, delta=tables.delta, **NO_COVARIANCE)
    own = np.array([name.startswith("delta ") for name in names])
    places = [tables.covariance_names.index(name) for name in names]

    def joined(ours: Array, theirs: Array) -> Rows:
        together = np.where(own, theirs[np.ix_(places, places)], ours)
        return rows_of(np.where(own[:, None] ^ own, 0.0, together))

    sources = dict.fromkeys((*readings.shares, *tables.shares))
    shares = {each: joined(readings.share([each]), tables.share([each])) for each in sources}
    said = "the law of the misalignment is that of the tables, of both sides"
    warnings = (*readings.warnings, said)
    return replace(
        readings,
        delta=tables.delta,
        covariance_matrix=joined(readings.covariance, tables.covariance),
        over_dof_matrix=joined(readings.over_dof, tables.over_dof),
        shares=shares,
        warnings=warnings,
    )
