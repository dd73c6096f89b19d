"""From a record to a calibration: the rooms below, wired together."""

from __future__ import annotations

import warnings as python_warnings
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from accelcal.errors import AccelcalWarning, InputError
from accelcal.estimate.error_sources import error_sources, finite_or_none
from accelcal.estimate.estimability import check_names
from accelcal.estimate.joint import JointEstimate, estimate_jointly
from accelcal.estimate.linear import METHODS, linear_estimator
from accelcal.estimate.reversal import fixture_angles
from accelcal.estimate.tables import PreparedTable, prepare
from accelcal.estimate.uncertainty import Component, Interval, intervals, propagate
from accelcal.gates.record import record_gates
from accelcal.gates.table import gates_of_tables
from accelcal.model import COEFFICIENTS, ERROR_TERMS, POWERS
from accelcal.record import TumbleRecord, naming
from accelcal.reference import fixture_angle, reference_temperature_of
from accelcal.results.calibration import Calibration
from accelcal.results.mapping import frozen
from accelcal.results.quantity import Gate, Quantity, Residuals
from accelcal.results.table import TableCalibration
from accelcal.results.temperature import TemperatureModel
from accelcal.temperature.at_rest import brought_to_rest
from accelcal.temperature.bilinear import quantity
from accelcal.temperature.of_record import RecordLaws, laws_of_record
from accelcal.temperature.of_tables import without_slopes
from accelcal.temperature.run_temperatures import undeclared_temperature
from accelcal.version import __version__
from accelcal.weaknesses import record_warnings, table_warnings

if TYPE_CHECKING:
    from accelcal.discovery.correction import Correction
    from accelcal.results.discovery import Discovery

__all__ = ["TEMPERATURE_LAWS", "fit"]

Array = NDArray[np.float64]

_ERROR_UNITS = {"k0": "g", "k2": "g/g^2", "k3": "g/g^3", "delta": "rad", "delta_ip": "g/g^2"}

TEMPERATURE_LAWS = ("tables", "readings")
"""What the temperature laws are fitted to; the first is the default."""


def fit(
    record: TumbleRecord,
    *,
    method: str = METHODS[0],
    robust: bool = False,
    delta0: float | None = None,
    reference_temperature: float | None = None,
    coefficients: Sequence[str] = COEFFICIENTS,
    strict: bool = False,
    temperature_laws: str = "tables",
    model: Discovery | None = None,
) -> Calibration:
    """Calibrate an accelerometer from the record of its tumble test.

    Parameters
    ----------
    record : TumbleRecord
        All readings of one accelerometer.
    method : str, default "least-squares"
        ``"least-squares"``; the closed forms ``"closed-form"``, ``"sign-corrected"``,
        ``"printed"``.
    robust : bool, default False
        Make the readings safe against outliers by their replicates first.
    delta0 : float, optional
        Fixture angle between head zero and input axis, taken as given [rad]; by default that of
        the record's metadata, else 0.
    reference_temperature : float, optional
        T0; by default that of the record, else the level nearest to 20 degC [degC].
    coefficients : sequence of str, default all six
        Coefficients to estimate; the others are taken as zero.
    strict : bool, default False
        Refuse a design that does not determine all coefficients asked for.
    temperature_laws : str, default "tables"
        Fit the temperature laws to the coefficients of the ``"tables"``, or to all ``"readings"``,
        each at its own temperature.
    model : Discovery, optional
        Effects to take out of the readings first; their sizes are fitted anew.

    Returns
    -------
    Calibration
        A table of coefficients for each run and mounting, with uncertainties and gates.

    Raises
    ------
    InputError
        If `record` is no record, the method is unknown or an argument is not finite.
    DesignError
        If the angles do not allow what is asked.

    Warns
    -----
    AccelcalWarning
        With ``method="printed"``, which is misprinted.

    Notes
    -----
    Equations (1), (2) and (6). Each table has coefficients of its own; the errors of the head are
    common to all of them.

    Examples
    --------
    >>> import accelcal
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> calibration.tables[0].error_model["k0"].unit
    'g'
    """
    _check_record(record)
    _check_arguments(method, reference_temperature, temperature_laws)
    delta0 = fixture_angle(record, delta0)
    reference, chosen = reference_temperature_of(record, reference_temperature)
    known = None if model is None else _known_effects(record, model, reference, delta0)
    record = record if known is None else known.record
    tables = list(_prepared(record, delta0, coefficients, strict=strict))
    estimate = _joint_estimate(record, tables, known, method, delta0, robust=robust)
    found = RecordLaws(None, None)  # laws of misprinted coefficients are no laws
    if method != "printed":
        moving, outputs = tables, estimate.outputs
        at_rest = brought_to_rest(tables, estimate, reference)
        if at_rest.said:
            tables = list(at_rest.tables)
            estimate = _joint_estimate(record, tables, known, method, delta0, robust=robust)
        found = laws_of_record(
            at_rest, estimate, reference, temperature_laws, moving=moving, outputs=outputs
        )
    return Calibration(
        method=method,
        robust=robust,
        output_unit=record.unit,
        tables=tuple(_table_calibrations(tables, found.with_temperature(estimate), delta0)),
        serial=record.serial,
        g_local_m_s2=record.apparatus.local_gravity,
        T0_degC=reference,
        delta0_rad=delta0,
        source=record.source,
        date=record.date,
        error_sources=error_sources(tables, estimate, record.unit),
        gates=record_gates(estimate, _table_names(tables)),
        warnings=tuple(_warnings(record, tables, estimate, found, chosen, method, delta0)),
        software=f"accelcal {__version__}",
        temperature_model=found.main,
        second_axis_model=found.second_axis,
        fixture_angle=fixture_angles(tables, estimate, delta0) if method != "printed" else (),
        effects=() if known is None else tuple(frozen(e.to_document()) for e in known.effects),
        provenance=frozen(record.provenance(_asked(coefficients, strict, temperature_laws, model))),
    )


def _asked(
    coefficients: Sequence[str], strict: bool, laws_from: str, model: Discovery | None
) -> dict[str, object]:
    """What was asked of the fit and stands nowhere else in the calibration."""
    return {
        "coefficients": [name for name in COEFFICIENTS if name in coefficients],
        "strict": strict,
        "temperature_laws": laws_from,
        "model": None if model is None else model.source,
    }


def _warnings(
    record: TumbleRecord,
    tables: Sequence[PreparedTable],
    estimate: JointEstimate,
    found: RecordLaws,
    chosen: bool,
    method: str,
    delta0: float,
) -> Iterator[str]:
    declared = record.apparatus.temperature_uncertainty
    yield from record_warnings(estimate, method, delta0, _mountings(tables))
    yield from _of_laws(found.main, chosen=chosen, mountings=set(_mountings(tables)))
    yield from undeclared_temperature(found.main, declared)
    yield from without_slopes(declared, found.of_tables)
    yield from found.said


def _joint_estimate(
    record: TumbleRecord,
    tables: Sequence[PreparedTable],
    known: Correction | None,
    method: str,
    delta0: float,
    *,
    robust: bool,
) -> JointEstimate:
    with naming(record):
        estimate = estimate_jointly(
            tables, record.apparatus, method=method, robust=robust, delta0=delta0
        )
    return estimate if known is None else _with_effects(estimate, tables, known, method, delta0)


def _known_effects(
    record: TumbleRecord, model: Discovery, reference: float | None, delta0: float
) -> Correction:
    from accelcal.discovery.correction import correction

    with naming(record):
        return correction(record, model, reference or 0.0, delta0)


def _with_effects(
    estimate: JointEstimate,
    tables: Sequence[PreparedTable],
    known: Correction,
    method: str,
    delta0: float,
) -> JointEstimate:
    """Add the uncertainty of the effects to the components of error."""
    through = np.concatenate(
        [
            linear_estimator(table, method, delta0).map @ known.acting[mask]
            for table, mask in zip(tables, known.record.table_masks(), strict=True)
        ]
    )
    component = Component(through @ through.T, np.full(through.shape[0], float(known.dof)))
    return estimate._replace(components={**estimate.components, "effects": component})


def _prepared(
    record: TumbleRecord, delta0: float, asked: Sequence[str], *, strict: bool
) -> Iterator[PreparedTable]:
    check_names(asked)  # no table is at fault
    for table in record.tables():
        with naming(table):
            yield prepare(table, delta0=delta0, asked=asked, strict=strict)


def _mountings(tables: Sequence[PreparedTable]) -> list[str]:
    return [str(table.record.mounting[0]) for table in tables]


def _check_record(record: object) -> None:
    if not isinstance(record, TumbleRecord):
        raise InputError(
            f"{type(record).__name__} in place of a record; make one by"
            " accelcal.read_table('file.csv'), or by accelcal.read_arrays(columns) of arrays or a"
            " DataFrame"
        )


def _check_arguments(method: str, temperature: float | None, laws_from: str) -> None:
    if temperature is not None and not np.isfinite(temperature):
        raise InputError(f"T0 is {temperature}; it is a finite number of degC")
    if laws_from not in TEMPERATURE_LAWS:
        raise InputError(
            f"temperature_laws is {laws_from!r}; choose from {', '.join(TEMPERATURE_LAWS)}"
        )
    if method == "printed":
        python_warnings.warn(
            "method 'printed' uses the misprinted equations (6); it is there for the record",
            AccelcalWarning,
            stacklevel=3,
        )


def _of_laws(laws: TemperatureModel | None, *, chosen: bool, mountings: set[str]) -> Iterator[str]:
    """Say what the temperature laws rest on, or why there are none."""
    if laws is None:
        yield "no temperature laws: they need levels more than 5 degC apart, with K0, K1 and M"
        return
    if chosen:
        yield "T0 was not given: it is the level nearest to 20 degC"
    if len(mountings) > 1:
        yield "the temperature laws are those of one mounting, the one with most runs"


def _table_names(tables: Sequence[PreparedTable]) -> list[str]:
    names = [
        (f"run {t.record.run_labels[int(t.record.run[0])]}", str(t.record.mounting[0]))
        for t in tables
    ]
    several = len({mounting for _, mounting in names}) > 1
    return [f"{run}, mounting {mounting}" if several else run for run, mounting in names]


def _table_calibrations(
    tables: Sequence[PreparedTable], estimate: JointEstimate, delta0: float
) -> Iterator[TableCalibration]:
    judged = [linear_estimator(table).coefficients(table.record.output) for table in tables]
    gates = gates_of_tables(tables, judged, estimate.noises, delta0)
    for index, table in enumerate(tables):
        scale_factor = judged[index][COEFFICIENTS.index("K1")]
        yield _table_calibration(table, estimate, index, scale_factor, gates[index])


def _table_calibration(
    table: PreparedTable,
    estimate: JointEstimate,
    index: int,
    scale_factor: float,
    gates: tuple[Gate, ...],
) -> TableCalibration:
    names = estimate.names[index]
    values = estimate.coefficients[index]
    residual = estimate.residuals[index]
    own = {name: c.part(estimate.part(index)) for name, c in estimate.components.items()}
    covariance = np.sum([part.covariance for part in own.values()], axis=0)
    known = bool(np.isfinite(covariance).all())
    dof = residual.size - len(names)
    return TableCalibration(
        run=table.record.run_labels[int(table.record.run[0])],
        mounting=str(table.record.mounting[0]),
        temperature_degC=finite_or_none(table.record.mean_temperature),
        readings=residual.size,
        dof=dof,
        residual_rms=float(np.sqrt((residual**2).sum() / dof)) if dof > 0 else 0.0,
        coefficients=_coefficients(names, values, own, table.record.unit),
        error_model=_error_model(names, values, own),
        covariance_names=names if known else (),
        covariance_matrix=_rows(covariance) if known else (),
        budget=_budget(names, own),
        stands_for=dict(estimate.stands_for[index]),
        residuals=_residuals(table.record, residual / scale_factor),
        gates=gates,
        warnings=table_warnings(table, estimate.noises[index]),
    )


def _residuals(record: TumbleRecord, value: Array) -> Residuals:
    arrays = record.angle, record.stroke, value
    return Residuals(*(tuple(array.tolist()) for array in arrays))


def _coefficients(
    names: Sequence[str], values: Array, own: Mapping[str, Component], unit: str | None
) -> dict[str, Quantity]:
    found = dict(zip(names, intervals(own), strict=True))
    return {
        name: _estimated(value, found.get(name), _coefficient_unit(unit, POWERS[name]))
        for name, value in zip(COEFFICIENTS, values.tolist(), strict=True)
    }


def _error_model(
    names: Sequence[str], values: Array, own: Mapping[str, Component]
) -> dict[str, Quantity]:
    """Quotients by K1, last line of (6), with their uncertainty by the law of propagation."""
    scale_factor = values[COEFFICIENTS.index("K1")]
    jacobian = np.zeros((len(names), len(names)))
    for row, name in enumerate(names):
        jacobian[row, row] = 1.0 / scale_factor
        jacobian[row, names.index("K1")] -= values[COEFFICIENTS.index(name)] / scale_factor**2
    found = dict(zip(names, intervals(propagate(own, jacobian)), strict=True))
    return {
        error: _estimated(
            float(values[COEFFICIENTS.index(name)] / scale_factor),
            found.get(name),
            _ERROR_UNITS[error],
        )
        for name, error in ERROR_TERMS.items()
    }


def _estimated(value: float, interval: Interval | None, unit: str) -> Quantity:
    """Join a value and its interval; nothing where the coefficient was not estimated."""
    return Quantity(None, None, unit) if interval is None else quantity(value, interval, unit)


def _coefficient_unit(unit: str | None, power: int) -> str:
    suffix = {0: "", 1: "/g"}.get(power, f"/g^{power}")
    return f"{unit or 'output unit'}{suffix}"


def _budget(names: Sequence[str], own: Mapping[str, Component]) -> dict[str, dict[str, float]]:
    sigma = {
        source: np.sqrt(np.maximum(np.diagonal(part.covariance), 0.0))
        for source, part in own.items()
    }
    return {
        name: {source: float(s[i]) for source, s in sigma.items() if s[i] > 0.0}
        for i, name in enumerate(names)
    }


def _rows(matrix: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in matrix.tolist())
