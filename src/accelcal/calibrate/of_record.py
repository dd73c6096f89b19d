"""From the estimate of one record to its calibration: its temperature laws and its warnings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from accelcal.calibrate.of_table import table_calibrations
from accelcal.calibrate.options import Options
from accelcal.calibrate.weaknesses import Fitted, Warned, warnings_of
from accelcal.estimate.error_sources import error_sources
from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.reversal import fixture_angles
from accelcal.estimate.tables import PreparedTable
from accelcal.gates.record import RecordStack, gates_of_records
from accelcal.record import TumbleRecord
from accelcal.reference import fixture_angle, has_reference_temperature, reference_temperature_of
from accelcal.results.calibration import Calibration
from accelcal.results.mapping import frozen
from accelcal.results.quantity import Gate
from accelcal.temperature.error_component import Slopes
from accelcal.temperature.laws import RecordLaws
from accelcal.version import __version__

if TYPE_CHECKING:
    from accelcal.discovery.correction import Correction


def calibration_of_record(
    record: TumbleRecord,
    tables: Sequence[PreparedTable],
    estimate: JointEstimate,
    gates: Sequence[tuple[Gate, ...]],
    options: Options,
    known: Correction | None,
    laws: RecordLaws,
) -> Calibration:
    """Make the calibration of one record.

    Parameters
    ----------
    record : TumbleRecord
        The record.
    tables : sequence of PreparedTable
        Its tables.
    estimate : JointEstimate
        Their coefficients, as a stack of one record.
    gates : sequence of tuple of Gate
        Gates of each table.
    options : Options
        What was asked.
    known : Correction or None
        Effects that were taken out.
    laws : RecordLaws
        Its temperature laws.

    Returns
    -------
    Calibration
        With all that is known of the record.
    """
    method, delta0 = options.method, fixture_angle(record, options.delta0)
    warned = _warnings(record, tables, estimate, laws, options)
    of_tables = [own[0] for own in warned.of_tables]
    of_record = gates_of_records(RecordStack.of(estimate, tables))
    stated = estimate.with_error("temperature", laws.of_tables)
    own = estimate.of_records(0)
    return Calibration(
        method=method,
        robust=options.robust,
        output_unit=record.unit,
        tables=tuple(table_calibrations(tables, stated, gates, of_tables)),
        serial=record.serial,
        g_local_m_s2=record.apparatus.local_gravity,
        T0_degC=reference_temperature_of(record, options.reference_temperature),
        delta0_rad=delta0,
        source=record.source,
        date=record.date,
        error_sources=error_sources(tables, own, record.unit),
        gates=tuple(gate.gate(0) for gate in of_record),
        warnings=warned.of_record[0],
        software=f"accelcal {__version__}",
        temperature_model=laws.main,
        second_axis_model=laws.second_axis,
        fixture_angle=fixture_angles(tables, own, delta0) if method != "printed" else (),
        effects=() if known is None else tuple(frozen(e.to_document()) for e in known.effects),
        provenance=frozen(record.provenance(options.asked())),
    )


def _warnings(
    record: TumbleRecord,
    tables: Sequence[PreparedTable],
    estimate: JointEstimate,
    laws: RecordLaws,
    options: Options,
) -> Warned:
    """Say what a reader must know of one record, from the estimate as a stack of one."""
    is_given = has_reference_temperature(record, options.reference_temperature)
    return warnings_of(
        Fitted(
            tables=tables,
            estimate=estimate,
            slopes=Slopes.of_one(laws.main),
            is_chosen=np.array([not is_given]),
            method=options.method,
            delta0=fixture_angle(record, options.delta0),
            told_of_head=options.left_out([record]),
            moved=[laws.said],
        )
    )
