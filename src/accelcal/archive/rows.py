"""From a calibration to the rows of the two frames."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from accelcal.archive.columns import LAWS, ROWS, gate_column
from accelcal.record import TumbleRecord
from accelcal.results.calibration import Calibration
from accelcal.results.quantity import Gate, Quantity
from accelcal.results.table import TableCalibration

Row = list[Any]

JOINT = " | "
"""Between the texts in one cell."""


def table_rows(calibration: Calibration, record: TumbleRecord) -> Iterator[Row]:
    """Make a row of each table of a calibration.

    Parameters
    ----------
    calibration : Calibration
        The calibration.
    record : TumbleRecord
        What was fitted.

    Yields
    ------
    list
        Cells in the order of `ROWS`, None where there is nothing.
    """
    common = _where(calibration, record) | _of_record(calibration, record)
    for table in calibration.tables:
        yield _row(ROWS, common | _of_table(table, calibration))


def law_rows(calibration: Calibration, record: TumbleRecord) -> Iterator[Row]:
    """Make a row of each term of the temperature laws of a calibration.

    Parameters
    ----------
    calibration : Calibration
        The calibration.
    record : TumbleRecord
        What was fitted.

    Yields
    ------
    list
        Cells in the order of `LAWS`, None where there is nothing.
    """
    common = _where(calibration, record) | {"T0_degC": calibration.T0_degC}
    for mounting in dict.fromkeys(table.mounting for table in calibration.tables):
        laws = calibration.of_mounting(mounting).temperature_model
        for term, quantity in laws.quantities() if laws else ():
            cells = {"mounting": mounting, "coefficient": term, **quantity.to_document()}
            yield _row(
                LAWS, common | cells | {"warnings": JOINT.join(laws.warnings if laws else ())}
            )


def _row(columns: Iterable[str], cells: Mapping[str, Any]) -> Row:
    return [cells[name] for name in columns]


def _where(calibration: Calibration, record: TumbleRecord) -> dict[str, Any]:
    return {
        "source": calibration.source,
        "line": None if record.line is None else int(record.line[0]),
        "serial": calibration.serial,
        "date": calibration.date,
        "software": calibration.software,
    }


def _of_record(calibration: Calibration, record: TumbleRecord) -> dict[str, Any]:
    verdict = calibration.verdict
    judged = () if verdict is None else verdict.judgements
    failed = dict.fromkeys(j.limit for j in judged if j.outcome == "fail")
    return {
        "output_unit": calibration.output_unit,
        "notes": JOINT.join(record.notes),
        "verdict": None if verdict is None else verdict.outcome,
        "failed_limits": JOINT.join(failed),
        "method": calibration.method,
        "robust": calibration.robust,
        "g_local_m_s2": calibration.g_local_m_s2,
        "T0_degC": calibration.T0_degC,
        "delta0_rad": calibration.delta0_rad,
        "sha256": record.sha256,
        **_gates(ROWS, calibration.gates),
    }


def _of_table(table: TableCalibration, calibration: Calibration) -> dict[str, Any]:
    names = ("run", "mounting", "temperature_degC", "readings", "dof", "residual_rms")
    meanings = (f"{name}: {meaning}" for name, meaning in table.stands_for.items())
    cells: dict[str, Any] = {name: getattr(table, name) for name in names}
    cells |= {"stands_for": JOINT.join(meanings)}
    cells |= {"warnings": JOINT.join((*table.warnings, *calibration.warnings))}
    for name, quantity in (*table.coefficients.items(), *table.error_model.items()):
        cells |= _of_quantity(name, quantity)
    return cells | _verdicts(table.gates)


def _of_quantity(name: str, quantity: Quantity) -> dict[str, float | None]:
    return {
        name: quantity.value,
        f"{name}_standard_uncertainty": quantity.standard_uncertainty,
        f"{name}_expanded_uncertainty": quantity.expanded_uncertainty,
        f"{name}_dof": quantity.dof,
    }


def _gates(columns: Iterable[str], gates: Sequence[Gate]) -> dict[str, str | None]:
    """States of the gates of a record, nothing for one that there was no cause for."""
    none = {name: None for name in columns if name.startswith("gate_")}
    return none | _verdicts(gates)


def _verdicts(gates: Sequence[Gate]) -> dict[str, str]:
    return {gate_column(gate.name): gate.verdict for gate in gates}
