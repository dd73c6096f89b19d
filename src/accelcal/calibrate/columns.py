"""Calibrations of a stack as columns of a tidy frame: a row a table, record after record."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from accelcal.calibrate.quantities import coefficient_stack, error_model_stack
from accelcal.calibrate.stack import CalibrationStack
from accelcal.gates.verdict import VERDICTS, GateStack
from accelcal.results.calibration import Calibration

__all__ = ["columns_of", "columns_of_one"]

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
    tables = [_of_table(stack, table) for table in range(len(stack.tables))]
    found = {name: _interleaved([table[name] for table in tables]) for name in tables[0]}
    count = len(tables)
    for gate in stack.record_gates:
        found[_name(gate.name)] = np.repeat(_verdicts(gate), count)
    return {"record": np.repeat(np.arange(len(stack)), count), **found}


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


def _of_table(stack: CalibrationStack, table: int) -> dict[str, Column]:
    records, prepared, estimate = len(stack), stack.tables[table], stack.estimate
    own = {name: c.part(estimate.part(table)) for name, c in stack.components.items()}
    arguments = estimate.names[table], estimate.coefficients[table], own
    residual = estimate.residuals[table]
    dof = residual.shape[1] - len(estimate.names[table])
    squares = np.einsum("rn,rn->r", residual, residual)
    found: dict[str, ArrayLike] = {
        "run": [r.run_labels[int(prepared.record.run[0])] for r in stack.plan.records],
        "mounting": np.full(records, str(prepared.record.mounting[0])),
        "temperature_degC": stack.plan.levels[:, table],
        "readings": np.full(records, residual.shape[1]),
        "dof": np.full(records, dof),
        "residual_rms": np.sqrt(squares / dof) if dof > 0 else np.zeros(records),
        **coefficient_stack(*arguments, stack.plan.records[0].unit).columns(),
        **error_model_stack(*arguments).columns(),
    }
    gates, start = stack.gates[table]
    for gate in gates:
        found[_name(gate.name)] = _verdicts(gate)[start : start + records]
    return {name: np.asarray(values) for name, values in found.items()}


def _verdicts(gate: GateStack) -> Column:
    return np.asarray(_VERDICTS[gate.verdict])


def _name(gate: str) -> str:
    return "gate_" + gate.replace(" ", "_")


def _interleaved(tables: Sequence[Column]) -> Column:
    """Put a column of each table into that of all rows, record after record."""
    return np.stack(tables, axis=1).ravel()


def _column(cells: Iterable[Any]) -> Column:
    values = list(cells)
    known = [value for value in values if value is not None]
    if known and isinstance(known[0], str):
        return np.array(values)
    return np.array([np.nan if value is None else value for value in values])
