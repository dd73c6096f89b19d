"""From the estimate of one record to the calibration of each of its tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from accelcal.arrays import Array
from accelcal.calibrate.quantities import TableQuantities, table_quantities
from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.uncertainty import Component
from accelcal.model import SCALE_FACTOR
from accelcal.record import TumbleRecord
from accelcal.results.covariance import rows_of
from accelcal.results.mapping import finite_or_none
from accelcal.results.quantity import Gate, Residuals
from accelcal.results.table import TableCalibration


def table_calibrations(
    tables: Sequence[PreparedTable],
    estimate: JointEstimate,
    gates: Sequence[tuple[Gate, ...]],
    warnings: Sequence[tuple[str, ...]],
) -> Iterator[TableCalibration]:
    """Make the calibration of each table.

    Parameters
    ----------
    tables : sequence of PreparedTable
        The tables of one record.
    estimate : JointEstimate
        Their coefficients, as a stack of one record.
    gates : sequence of tuple of Gate
        Their gates.
    warnings : sequence of tuple of str
        Sentences about each.

    Yields
    ------
    TableCalibration
        One a table.
    """
    unit, own = tables[0].record.unit, estimate.of_records(0)
    quantities = table_quantities(own.names, estimate.coefficients, estimate.components, unit)
    for index, table in enumerate(tables):
        yield _table_calibration(table, own, index, quantities, gates[index], warnings[index])


def _table_calibration(
    table: PreparedTable,
    estimate: JointEstimate,
    index: int,
    quantities: TableQuantities,
    gates: tuple[Gate, ...],
    warnings: tuple[str, ...],
) -> TableCalibration:
    names, residual = estimate.names[index], estimate.residuals[index]
    place = estimate.part(index)
    own = {name: c.part(place) for name, c in estimate.components.items()}
    covariance = np.sum([part.covariance for part in own.values()], axis=0)
    known = bool(np.isfinite(covariance).all())
    scale_factor = estimate.judged[index][SCALE_FACTOR]
    return TableCalibration(
        run=table.run_label,
        mounting=table.mounting,
        temperature_degC=finite_or_none(table.record.mean_temperature),
        readings=residual.size,
        dof=estimate.dof(index),
        residual_rms=estimate.residual_rms(index).item(),
        coefficients=quantities.coefficients.one(0, index),
        error_model=quantities.error_model.one(0, index),
        covariance_names=names if known else (),
        covariance_matrix=rows_of(covariance) if known else (),
        budget=_budget(names, own),
        stands_for=dict(estimate.stands_for[index]),
        residuals=_residuals(table.record, residual / scale_factor),
        gates=gates,
        warnings=warnings,
    )


def _residuals(record: TumbleRecord, value: Array) -> Residuals:
    arrays = record.angle, record.stroke, value
    return Residuals(*(tuple(array.tolist()) for array in arrays))


def _budget(names: Sequence[str], own: Mapping[str, Component]) -> dict[str, dict[str, float]]:
    sigma = {
        source: np.sqrt(np.maximum(np.diagonal(part.covariance), 0.0))
        for source, part in own.items()
    }
    return {
        name: {source: float(s[i]) for source, s in sigma.items() if s[i] > 0.0}
        for i, name in enumerate(names)
    }
