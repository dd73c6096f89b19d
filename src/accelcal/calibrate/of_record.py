"""From a stack of calibrations to that of one of its records, and the numbers of all."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.estimate.head import HeadError
from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.noise import ReadingNoise
from accelcal.estimate.reversal import fixture_angles
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.uncertainty import (
    Component,
    Intervals,
    combined,
    covariance_fields,
    interval_stack,
    quantities,
)
from accelcal.frozen_mapping import frozen
from accelcal.model import COEFFICIENTS, ERROR_TERMS, ERROR_UNITS, SCALE_FACTOR, coefficient_unit
from accelcal.record import TumbleRecord
from accelcal.reference import reference_temperature_of
from accelcal.results.calibration import Calibration
from accelcal.results.covariance import NO_COVARIANCE
from accelcal.results.documents.fields import finite_or_none
from accelcal.results.quantity import ErrorSource, Quantity, Residuals
from accelcal.results.table import TableCalibration
from accelcal.version import SOFTWARE

if TYPE_CHECKING:
    from accelcal.calibrate.stack import CalibrationStack


class QuantityStack(NamedTuple):
    """Quantities of the t tables of each of R records.

    Attributes
    ----------
    units : mapping of str to str
        Name of each of the m quantities and its unit.
    value : ndarray, shape (R, t, m)
        Estimates; NaN where the data do not determine one.
    standard, expanded : ndarray, shape (R, t, m)
        Standard uncertainty and half width of the 95 % interval; NaN where nothing tells them.
    dof : ndarray, shape (R, t, m)
        Effective degrees of freedom; infinite where known, NaN where nothing tells them.
    """

    units: Mapping[str, str]
    value: Array
    standard: Array
    expanded: Array
    dof: Array

    def one(self, record: int, table: int) -> dict[str, Quantity]:
        """Return the quantities of one table of one record."""
        parts = (field[record, table] for field in self[1:])
        return dict(zip(self.units, quantities(self.units.values(), *parts), strict=True))

    def without_uncertainty(self, records: Mask, names: Collection[str]) -> QuantityStack:
        """Take the uncertainties of some quantities from some of the R records."""
        own = records[:, None, None] & np.array([name in names for name in self.units])
        told = (np.where(own, np.nan, part) for part in (self.standard, self.expanded, self.dof))
        return QuantityStack(self.units, self.value, *told)

    def columns(self) -> dict[str, Array]:
        """Return columns of values, standard and expanded uncertainties, and dof, shape (R * t,).

        Table after table of a record, and record after record.
        """
        finite = np.where(np.isinf(self.dof), np.nan, self.dof)
        parts = {
            "": self.value,
            "_standard_uncertainty": self.standard,
            "_expanded_uncertainty": self.expanded,
            "_dof": finite,
        }
        return {
            name + suffix: part[:, :, i].ravel()
            for i, name in enumerate(self.units)
            for suffix, part in parts.items()
        }


class TableQuantities(NamedTuple):
    """What is known of the tables of R records."""

    coefficients: QuantityStack  # K0, K1, K2, K3, M, M_ip
    error_model: QuantityStack  # k0, k2, k3, delta, delta_ip: quotients by K1, last line of (6)

    def unbounded(self, records: Mask, names: Collection[str]) -> TableQuantities:
        """Take the uncertainties of coefficients from some records where nothing bounds an error.

        Their quotients by K1 have none either; in those of the others it is small.
        """
        quotients = [ERROR_TERMS[name] for name in names if name in ERROR_TERMS]
        return TableQuantities(
            self.coefficients.without_uncertainty(records, names),
            self.error_model.without_uncertainty(records, quotients),
        )


def table_quantities(
    names: Sequence[Sequence[str]],
    values: Sequence[Array],
    components: Mapping[str, Component],
    unit: str | None,
) -> TableQuantities:
    """Coefficients and error models of all tables in all records, with their uncertainties.

    Those estimated are named for each of t tables, P in all; the values of each table, shape (R,
    6), are zero where not estimated [output unit / g^n]; components of the errors of those
    estimated are of shape (R, P, P), table after table. Those of the quotients are by the law of
    propagation.
    """
    whole = [(table, name) for table, own in enumerate(names) for name in own]
    k = np.stack(values, axis=1)[:, *_columns(whole, COEFFICIENTS)]
    units = {name: coefficient_unit(name, unit) for name in COEFFICIENTS}
    own = [i for i, (_, name) in enumerate(whole) if name in ERROR_TERMS]
    scale_factors = {table: i for i, (table, name) in enumerate(whole) if name == "K1"}
    k1 = [scale_factors[whole[i][0]] for i in own]
    errors = [(table, ERROR_TERMS[name]) for table, name in (whole[i] for i in own)]
    quotients = k[:, own] / k[:, k1]
    parts = components.values()
    variances = [_of_quotients(part.covariance, quotients, own, k1) for part in parts]
    known = combined(
        [variance / k[:, k1] ** 2 for variance in variances],
        [np.minimum(part.dof[:, own], part.dof[:, k1]) for part in parts],
    )
    return TableQuantities(
        _stack(units, len(names), whole, k, interval_stack(components)),
        _stack(ERROR_UNITS, len(names), errors, quotients, known),
    )


def _of_quotients(
    covariance: Array, quotients: Array, own: Sequence[int], k1: Sequence[int]
) -> Array:
    """Variances of K / K1 times the square of K1, by the law of propagation, shape (R, m)."""
    of_own, with_k1, of_k1 = (covariance[:, i, j] for i, j in ((own, own), (own, k1), (k1, k1)))
    return np.asarray(of_own + quotients * (quotients * of_k1 - 2.0 * with_k1))


def _stack(
    units: Mapping[str, str],
    tables: int,
    places: Sequence[tuple[int, str]],
    values: Array,
    known: Intervals,
) -> QuantityStack:
    """Put what was estimated at its table and name, NaN elsewhere."""

    def placed(part: Array) -> Array:
        whole = np.full((len(part), tables, len(units)), np.nan)
        whole[:, *_columns(places, list(units))] = part
        return whole

    parts = (values, known.standard, known.expanded, known.dof)
    return QuantityStack(units, *map(placed, parts))


def _columns(
    places: Sequence[tuple[int, str]], names: Sequence[str]
) -> tuple[list[int], list[int]]:
    """Table and place among the names of each quantity."""
    return [table for table, _ in places], [names.index(name) for _, name in places]


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
