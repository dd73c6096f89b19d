"""Calibrations of a stack as columns of a tidy frame: a row a table, record after record."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from accelcal.calibrate.quantities import TableQuantities, table_quantities
from accelcal.calibrate.stack import CalibrationStack
from accelcal.gates.verdict import VERDICTS
from accelcal.results.calibration import Calibration

__all__ = [
    "columns_of",
    "columns_of_one",
    "mountings_of",
    "numbers_of",
    "runs_of",
    "verdict_codes",
]

Column = NDArray[Any]

_VERDICTS = np.array(VERDICTS)


def columns_of(stack: CalibrationStack) -> dict[str, Column]:
    """Put the calibrations of a stack into columns.

    Parameters
    ----------
    stack : CalibrationStack
        R records of one plan of t tables.

    Returns
    -------
    dict of str to ndarray, shape (R * t,)
        ``record``, the place in the stack; ``run``, ``mounting``, ``temperature_degC``,
        ``readings``, ``dof``, ``residual_rms``; each coefficient and error term with its
        ``_standard_uncertainty``, ``_expanded_uncertainty`` and ``_dof``; ``gate_closure`` and so
        on. Numbers are NaN where unknown, and degrees of freedom where infinite.
    """
    if stack.is_alone:
        return columns_of_one(stack.one(0))
    runs = [run for own in zip(*runs_of(stack), strict=True) for run in own]
    return {
        "record": np.repeat(np.arange(len(stack)), len(stack.tables)),
        "run": np.array(runs),
        "mounting": np.tile(mountings_of(stack), len(stack)),
        **numbers_of(stack),
        **{name: _VERDICTS[code] for name, code in verdict_codes(stack).items()},
    }


def runs_of(stack: CalibrationStack) -> list[list[str]]:
    """Label of the run of each table, in each record."""
    runs = (table.run for table in stack.tables)
    return [[record.run_labels[run] for record in stack.plan.records] for run in runs]


def mountings_of(stack: CalibrationStack) -> list[str]:
    """Mounting of each table, which is that of all records."""
    return [table.mounting for table in stack.tables]


def numbers_of(stack: CalibrationStack) -> dict[str, Column]:
    """Columns of `columns_of` that are numbers.

    Parameters
    ----------
    stack : CalibrationStack
        R records of one plan of t tables, none of them alone.

    Returns
    -------
    dict of str to ndarray, shape (R * t,)
        ``temperature_degC`` to the last coefficient.
    """
    quantities = (of_all.columns().items() for of_all in _quantities(stack))
    return {**_of_tables(stack), **{name: part for own in quantities for name, part in own}}


def verdict_codes(stack: CalibrationStack) -> dict[str, NDArray[np.intp]]:
    """Columns of `columns_of` that are verdicts of gates.

    Parameters
    ----------
    stack : CalibrationStack
        R records of one plan of t tables, none of them alone.

    Returns
    -------
    dict of str to ndarray of int, shape (R * t,)
        Place of the verdict in `accelcal.gates.verdict.VERDICTS`; those of the record, which all
        its tables share, come last.
    """
    found = {}
    for gates in zip(*(own for own, _ in stack.gates), strict=True):
        starts = (start for _, start in stack.gates)
        rows = [g.verdict[i : i + len(stack)] for g, i in zip(gates, starts, strict=True)]
        found[_name(gates[0].name)] = np.stack(rows, axis=1).ravel()
    for gate in stack.record_gates:
        found[_name(gate.name)] = np.repeat(gate.verdict, len(stack.tables))
    return found


def columns_of_one(calibration: Calibration) -> dict[str, Column]:
    """Put one calibration into the columns of `columns_of`.

    Parameters
    ----------
    calibration : Calibration
        The calibration.

    Returns
    -------
    dict of str to ndarray, shape (tables,)
        The columns.
    """
    names = ("run", "mounting", "temperature_degC", "readings", "dof", "residual_rms")
    rows: list[dict[str, Any]] = []
    for table in calibration.tables:
        row: dict[str, Any] = {"record": 0} | {name: getattr(table, name) for name in names}
        for name, quantity in (*table.coefficients.items(), *table.error_model.items()):
            row[name] = quantity.value
            row[f"{name}_standard_uncertainty"] = quantity.standard_uncertainty
            row[f"{name}_expanded_uncertainty"] = quantity.expanded_uncertainty
            row[f"{name}_dof"] = quantity.dof
        row |= {_name(gate.name): gate.verdict for gate in (*table.gates, *calibration.gates)}
        rows.append(row)
    return {name: _column([row[name] for row in rows]) for name in rows[0]}


def _of_tables(stack: CalibrationStack) -> dict[str, Column]:
    """What the tables hold, and how well they were fitted."""
    records, estimate = len(stack), stack.estimate
    readings = np.array([residual.shape[1] for residual in estimate.residuals])
    dof = readings - [len(names) for names in estimate.names]
    squares = [np.einsum("rn,rn->r", residual, residual) for residual in estimate.residuals]
    rms = np.sqrt(np.stack(squares, axis=1) / np.where(dof > 0, dof, np.inf))
    return {
        "temperature_degC": stack.plan.levels.ravel(),
        "readings": np.tile(readings, records),
        "dof": np.tile(dof, records),
        "residual_rms": rms.ravel(),
    }


def _quantities(stack: CalibrationStack) -> TableQuantities:
    estimate, unit = stack.estimate, stack.plan.records[0].unit
    return table_quantities(estimate.names, estimate.coefficients, stack.components, unit)


def _name(gate: str) -> str:
    return "gate_" + gate.replace(" ", "_")


def _column(cells: Iterable[Any]) -> Column:
    values = list(cells)
    known = [value for value in values if value is not None]
    if known and isinstance(known[0], str):
        return np.array(values)
    return np.array([np.nan if value is None else value for value in values])
