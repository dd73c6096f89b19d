"""The temperature laws of a record: of its main axis, and of the other one along the shaft."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.reversal import free_of_fixture_angle
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.uncertainty import Component
from accelcal.results.covariance import NO_COVARIANCE, Rows, rows_of
from accelcal.results.temperature import TemperatureModel
from accelcal.temperature.error_component import Slopes, stacked_temperature_component
from accelcal.temperature.from_tables import (
    LawsOfRecords,
    laws_of_records,
)
from accelcal.temperature.levels import level_stack
from accelcal.temperature.one_meaning import tables_of_one_mounting, with_one_meaning
from accelcal.temperature.recorded import (
    RecordedTemperatures,
    stacked_temperature_uncertainty,
)


class StackLaws(NamedTuple):
    """Temperature laws of R records of one plan.

    Attributes
    ----------
    main : LawsOfRecords or None
        Those of the mounting with most tables; None where it has one level only.
    second_axis : LawsOfRecords or None
        Those of the other axis along the shaft, from its tables.
    of_tables : Component or None
        What errors of the temperature do to the coefficients of all tables.
    is_free : bool
        Whether both sides of an axis free the misalignments of the fixture angle.
    """

    main: LawsOfRecords | None
    second_axis: LawsOfRecords | None
    of_tables: Component | None
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

    Parameters
    ----------
    tables : sequence of PreparedTable
        The tables of any of the R records, which are of one plan.
    estimate : JointEstimate
        Their coefficients.
    temperatures : RecordedTemperatures
        Those of the records.
    unfelt : ndarray, shape (R, tables), or 1
        Share of the recorded scatter, as a variance, that the accelerometer did not feel.

    Returns
    -------
    StackLaws
        The laws, with the misalignments free of the fixture angle where both sides of an axis were
        measured.
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

    Returns
    -------
    TemperatureModel
        Those from the readings with that law; its correlations with them are not known and left at
        zero.
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
