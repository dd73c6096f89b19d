"""The temperature laws of a record: of its main axis, and of the other one along the shaft."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.one_axis import tables_of_axis
from accelcal.estimate.reversal import free_of_fixture_angle
from accelcal.estimate.tables import PreparedTable
from accelcal.results.temperature import TemperatureModel
from accelcal.temperature.from_tables import laws_from_tables, tables_of_one_mounting

__all__ = ["RecordLaws", "laws_of_record"]

Array = NDArray[np.float64]


class RecordLaws(NamedTuple):
    """Temperature laws; None where there is one level only.

    Attributes
    ----------
    main : TemperatureModel or None
        Those of the mounting with most tables.
    second_axis : TemperatureModel or None
        Those of the other axis along the shaft, from its tables.
    """

    main: TemperatureModel | None
    second_axis: TemperatureModel | None


def laws_of_record(
    tables: Sequence[PreparedTable],
    estimate: JointEstimate,
    reference: float | None,
    unfelt: Array,
    *,
    laws_from: str,
    moving: tuple[Sequence[PreparedTable], Sequence[Array]],
) -> RecordLaws:
    """Fit the temperature laws of both axes.

    Parameters
    ----------
    tables : sequence of PreparedTable
        The tables of one record.
    estimate : JointEstimate
        Their coefficients.
    reference : float or None
        T0 [degC].
    unfelt : ndarray, shape (tables,)
        Share of the recorded scatter of the temperatures that was not felt.
    laws_from : str
        ``"tables"`` or ``"readings"``.
    moving : tuple
        Tables and readings before they were brought to the mean temperature of their runs, for the
        laws from readings.

    Returns
    -------
    RecordLaws
        With the misalignments free of the fixture angle, where both sides of an axis were measured.
    """
    free = free_of_fixture_angle(tables, estimate)
    same = free is estimate
    uncertainty, unit = tables[0].record.apparatus.temperature_uncertainty, tables[0].record.unit
    main = laws_from_tables(tables, free, reference, uncertainty, unit, unfelt)
    chosen = tables_of_one_mounting(tables, estimate)
    axis = str(tables[chosen[0]].record.mounting[0])[0] if chosen else "o"
    others, of_others = tables_of_axis(tables, free, "p" if axis == "o" else "o")
    second = laws_from_tables(others, of_others, reference, uncertainty, unit) if others else None
    if main is None or main.k0.at_T0 is None or reference is None or laws_from == "tables":
        return RecordLaws(main, second)
    from accelcal.temperature.from_readings import laws_from_readings

    moving_tables, outputs = moving
    estimate = estimate._replace(outputs=tuple(outputs))
    found = laws_from_readings(moving_tables, estimate, main, reference, uncertainty, unit)
    return RecordLaws(found if same else _with_misalignment(found, main), second)


def _with_misalignment(readings: TemperatureModel, tables: TemperatureModel) -> TemperatureModel:
    """Take the law of the misalignment from the tables, where the fixture angle is out of it.

    Its correlations with the laws from all readings are not known and left at zero.
    """
    names = readings.covariance_names
    if not names or not set(names) <= set(tables.covariance_names):
        return replace(readings, delta=tables.delta, covariance_names=(), covariance_matrix=())
    own = np.array([name.startswith("delta ") for name in names])
    places = [tables.covariance_names.index(name) for name in names]
    theirs = np.array(tables.covariance_matrix)[np.ix_(places, places)]
    matrix = np.array(readings.covariance_matrix) * ~(own[:, None] ^ own)
    matrix[np.ix_(own, own)] = theirs[np.ix_(own, own)]
    rows = tuple(tuple(row) for row in matrix.tolist())
    said = "the law of the misalignment is that of the tables, of both sides"
    warnings = (*readings.warnings, said)
    return replace(readings, delta=tables.delta, covariance_matrix=rows, warnings=warnings)
