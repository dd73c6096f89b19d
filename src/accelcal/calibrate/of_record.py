"""From the estimate of one record to its calibration: its temperature laws and its warnings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from accelcal.calibrate.of_table import table_calibrations
from accelcal.calibrate.options import Options
from accelcal.estimate.error_sources import error_sources
from accelcal.estimate.joint import JointEstimate, estimate_jointly
from accelcal.estimate.linear import linear_estimator
from accelcal.estimate.reversal import fixture_angles
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.uncertainty import Component
from accelcal.gates.record import record_gates
from accelcal.gates.table import gates_of_tables
from accelcal.record import TumbleRecord, naming
from accelcal.reference import fixture_angle, reference_temperature_of
from accelcal.results.calibration import Calibration
from accelcal.results.mapping import frozen
from accelcal.results.quantity import Gate
from accelcal.results.temperature import TemperatureModel
from accelcal.temperature.at_rest import brought_to_rest
from accelcal.temperature.of_record import RecordLaws, laws_of_record
from accelcal.temperature.of_tables import without_slopes
from accelcal.temperature.run_temperatures import undeclared_temperature
from accelcal.version import __version__
from accelcal.weaknesses import record_warnings

if TYPE_CHECKING:
    from accelcal.discovery.correction import Correction

__all__ = ["calibration_of_record", "table_names", "warnings_of_record"]


def calibration_of_record(
    record: TumbleRecord,
    tables: Sequence[PreparedTable],
    estimate: JointEstimate,
    gates: Sequence[tuple[Gate, ...]],
    options: Options,
    known: Correction | None = None,
    laws: RecordLaws | None = None,
) -> Calibration:
    """Make the calibration of one record.

    Parameters
    ----------
    record : TumbleRecord
        The record.
    tables : sequence of PreparedTable
        Its tables.
    estimate : JointEstimate
        Their coefficients.
    gates : sequence of tuple of Gate
        Gates of each table.
    options : Options
        What was asked.
    known : Correction or None
        Effects that were taken out.
    laws : RecordLaws or None
        Its temperature laws, where they came with those of other records.

    Returns
    -------
    Calibration
        With its temperature laws.
    """
    method, delta0 = options.method, fixture_angle(record, options.delta0)
    reference, chosen = reference_temperature_of(record, options.reference_temperature)
    # laws of misprinted coefficients are no laws
    found = RecordLaws(None, None) if laws is None else laws
    estimate = _with_effects(estimate, tables, known, method, delta0)
    if method != "printed" and laws is None:
        moving, outputs = tables, estimate.outputs
        at_rest = brought_to_rest(tables, estimate, reference)
        if at_rest.said:
            tables = at_rest.tables
            estimate = _estimated_anew(record, tables, known, options, delta0)
            gates = gates_of_tables(tables, _judged(tables), estimate.noises, delta0)
        found = laws_of_record(
            at_rest, estimate, reference, options.temperature_laws, moving=moving, outputs=outputs
        )
    return Calibration(
        method=method,
        robust=options.robust,
        output_unit=record.unit,
        tables=tuple(table_calibrations(tables, found.with_temperature(estimate), gates)),
        serial=record.serial,
        g_local_m_s2=record.apparatus.local_gravity,
        T0_degC=reference,
        delta0_rad=delta0,
        source=record.source,
        date=record.date,
        error_sources=error_sources(tables, estimate, record.unit),
        gates=record_gates(estimate, table_names(tables)),
        warnings=(
            *warnings_of_record(record, tables, estimate, found, chosen, method, delta0),
            *_of_head(record, options),
        ),
        software=f"accelcal {__version__}",
        temperature_model=found.main,
        second_axis_model=found.second_axis,
        fixture_angle=fixture_angles(tables, estimate, delta0) if method != "printed" else (),
        effects=() if known is None else tuple(frozen(e.to_document()) for e in known.effects),
        provenance=frozen(record.provenance(options.asked())),
    )


def _estimated_anew(
    record: TumbleRecord,
    tables: Sequence[PreparedTable],
    known: Correction | None,
    options: Options,
    delta0: float,
) -> JointEstimate:
    """Estimate tables whose readings were brought to rest."""
    with naming(record):
        estimate = estimate_jointly(
            tables,
            record.apparatus,
            method=options.method,
            robust=options.robust,
            delta0=delta0,
            head=options.head_for(record),
        )
    return _with_effects(estimate, tables, known, options.method, delta0)


def _with_effects(
    estimate: JointEstimate,
    tables: Sequence[PreparedTable],
    known: Correction | None,
    method: str,
    delta0: float,
) -> JointEstimate:
    """Add the uncertainty of the effects to the components of error."""
    if known is None:
        return estimate
    through = np.concatenate(
        [
            linear_estimator(table, method, delta0).map @ known.acting[mask]
            for table, mask in zip(tables, known.record.table_masks(), strict=True)
        ]
    )
    component = Component(through @ through.T, np.full(through.shape[0], float(known.dof)))
    return estimate._replace(components={**estimate.components, "effects": component})


def warnings_of_record(
    record: TumbleRecord,
    tables: Sequence[PreparedTable],
    estimate: JointEstimate,
    found: RecordLaws,
    chosen: bool,
    method: str,
    delta0: float,
) -> Iterator[str]:
    """Say what a reader must know of a record as a whole.

    Parameters
    ----------
    record, tables, estimate
        As of `calibration_of_record`.
    found : RecordLaws
        Its temperature laws.
    chosen : bool
        Whether T0 was chosen, as none was given.
    method, delta0
        What was asked, see `accelcal.fit`.

    Yields
    ------
    str
        A sentence, without a full stop.
    """
    declared = record.apparatus.temperature_uncertainty
    yield from record_warnings(estimate, method, delta0, _mountings(tables))
    yield from _of_laws(found.main, chosen=chosen, mountings=set(_mountings(tables)))
    yield from undeclared_temperature(found.main, declared)
    yield from without_slopes(declared, found.of_tables)
    yield from found.said


def _of_head(record: TumbleRecord, options: Options) -> Iterator[str]:
    if options.head_for(record) is not options.head:
        yield (
            "this table told of the head: that is left out here, and the rest used; the"
            " coefficients fitted jointly with the head are those of accelcal head"
        )


def _judged(tables: Sequence[PreparedTable]) -> list[NDArray[np.float64]]:
    return [linear_estimator(table).coefficients(table.record.output) for table in tables]


def _mountings(tables: Sequence[PreparedTable]) -> list[str]:
    return [str(table.record.mounting[0]) for table in tables]


def _of_laws(laws: TemperatureModel | None, *, chosen: bool, mountings: set[str]) -> Iterator[str]:
    """Say what the temperature laws rest on, or why there are none."""
    if laws is None:
        yield "no temperature laws: they need levels more than 5 degC apart, with K0, K1 and M"
        return
    if chosen:
        yield "T0 was not given: it is the level nearest to 20 degC"
    if len(mountings) > 1:
        yield "the temperature laws are those of one mounting, the one with most runs"


def table_names(tables: Sequence[PreparedTable]) -> list[str]:
    """Name the tables of a record.

    Parameters
    ----------
    tables : sequence of PreparedTable
        The tables.

    Returns
    -------
    list of str
        Such as ``"run 2"``, with the mounting where there are several.
    """
    names = [
        (f"run {t.record.run_labels[int(t.record.run[0])]}", str(t.record.mounting[0]))
        for t in tables
    ]
    several = len({mounting for _, mounting in names}) > 1
    return [f"{run}, mounting {mounting}" if several else run for run, mounting in names]
