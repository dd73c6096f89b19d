"""From a stack of calibrations to that of one of its records."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from accelcal.estimate.head import HeadError
from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.noise import ReadingNoise
from accelcal.estimate.reversal import fixture_angles
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.uncertainty import Component, covariance_fields
from accelcal.frozen_mapping import frozen
from accelcal.model import SCALE_FACTOR
from accelcal.record import TumbleRecord
from accelcal.reference import reference_temperature_of
from accelcal.results.calibration import Calibration
from accelcal.results.covariance import NO_COVARIANCE
from accelcal.results.documents.fields import finite_or_none
from accelcal.results.quantity import ErrorSource, Residuals
from accelcal.results.table import TableCalibration
from accelcal.version import SOFTWARE

if TYPE_CHECKING:
    from accelcal.calibrate.stack import CalibrationStack


def calibration_of_record(stack: CalibrationStack, place: int) -> Calibration:
    """Make the calibration of one record."""
    options, record, known = stack.options, stack.plan.records[place], stack.correction_of(place)
    tables, estimate = stack.tables_of(place), stack.estimate.of_records(place)
    main, second = stack.laws_of(place)
    fixture = fixture_angles(tables, estimate, stack.delta0) if options.method != "printed" else ()
    return Calibration(
        method=options.method,
        robust=options.robust,
        output_unit=record.unit,
        tables=tuple(_of_tables(stack, place, tables)),
        serial=record.serial,
        g_local_m_s2=record.apparatus.local_gravity,
        T0_degC=reference_temperature_of(record, options.reference_temperature),
        delta0_rad=stack.delta0,
        source=record.source,
        date=record.date,
        error_sources=_error_sources(tables, estimate, record.unit),
        gates=tuple(gate.gate(place) for gate in stack.record_gates),
        warnings=stack.warnings.of_record[place],
        software=SOFTWARE,
        temperature_model=main,
        second_axis_model=second,
        fixture_angle=fixture,
        effects=() if known is None else known.effects,
        effects_as_found=() if known is None else known.as_found,
        provenance=frozen(record.provenance(options.asked())),
    )


def _error_sources(
    tables: Sequence[PreparedTable], estimate: JointEstimate, unit: str | None
) -> tuple[ErrorSource, ...]:
    """Error of the readings of each table, then head, launch, launch_sf, a declared temperature."""
    readings = [
        ErrorSource(
            "reading",
            finite_or_none(noise.factor * table.usual_scatter),
            unit or "output unit",
            _told_by_itself(noise, estimate.head),
            str(noise.source),
        )
        for table, noise in zip(tables, estimate.noises, strict=True)
    ]
    others = [
        ErrorSource(
            name,
            float(part.uncertainty) if part.source != "none" else None,
            unit_,
            finite_or_none(part.dof),
            part.source,
        )
        for name, part, unit_ in (
            ("head", estimate.head, "rad"),
            ("launch", estimate.bias_shift, "g"),
            ("launch_sf", estimate.scale_factor_shift, "1"),
        )
    ]
    declared = tables[0].record.apparatus.temperature_uncertainty
    heat = [ErrorSource("temperature", declared, "degC", None, "declared")] if declared else []
    return (*readings, *others, *heat)


def _told_by_itself(noise: ReadingNoise, head: HeadError) -> float | None:
    """Degrees of freedom; None with none, and where residuals told noise and head at once.

    Then the noise holds a part of the head's errors, see `accelcal.estimate.unrepeated`.
    """
    together = noise.source == "residuals" and head.source == "estimated"
    return None if together else finite_or_none(noise.dof) or None


def _of_tables(
    stack: CalibrationStack, place: int, tables: Sequence[PreparedTable]
) -> Iterator[TableCalibration]:
    """Make the calibration of each table of one record."""
    estimate, (coefficients, error_model) = stack.stated.of_records(place), stack.quantities
    for index, (table, gates) in enumerate(zip(tables, stack.gates, strict=True)):
        own = {name: c.part(estimate.part(index)) for name, c in estimate.components.items()}
        names, is_open = estimate.names[index], bool(stack.unbounded[place])
        yield TableCalibration(
            run=table.run_label,
            mounting=table.mounting,
            temperature_degC=finite_or_none(table.record.mean_temperature),
            readings=len(table.record),
            dof=int(estimate.dof(index)),
            residual_rms=estimate.residual_rms(index).item(),
            coefficients=coefficients.one(place, index),
            error_model=error_model.one(place, index),
            **(NO_COVARIANCE if is_open else covariance_fields(names, own)),
            budget=_budget(names, own),
            stands_for=dict(estimate.stands_for[index]),
            residuals=_residuals(table.record, estimate, index),
            gates=tuple(gate.gate(place) for gate in gates),
            warnings=stack.warnings.of_tables[index][place],
        )


def _residuals(record: TumbleRecord, estimate: JointEstimate, index: int) -> Residuals:
    value = estimate.residuals[index] / estimate.judged[index][SCALE_FACTOR]
    arrays = record.angle, record.stroke, value
    return Residuals(*(tuple(array.tolist()) for array in arrays))


def _budget(names: Sequence[str], own: Mapping[str, Component]) -> dict[str, dict[str, float]]:
    sigma = {source: np.sqrt(np.maximum(part.variances, 0.0)) for source, part in own.items()}
    return {
        name: {source: float(s[i]) for source, s in sigma.items() if s[i] > 0.0}
        for i, name in enumerate(names)
    }
