"""Calibrations of a stack as columns, a row a table, record after record."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Places
from accelcal.calibrate.stack import CalibrationStack

Column = NDArray[Any]


def mountings_of(stack: CalibrationStack) -> list[str]:
    """Mounting of each table, which is that of all records."""
    return [table.mounting for table in stack.tables]


def numbers_of(stack: CalibrationStack) -> dict[str, Column]:
    """Put what was found of a stack, t tables in each of R records of one plan, into columns.

    They are of shape (R * t,): ``temperature_degC``, ``readings``, ``dof``, ``residual_rms``; each
    coefficient and error term with its ``_standard_uncertainty``, ``_expanded_uncertainty`` and
    ``_dof``. NaN where unknown, and degrees of freedom where infinite.
    """
    quantities = (of_all.columns().items() for of_all in stack.quantities)
    return {**_of_tables(stack), **{name: part for own in quantities for name, part in own}}


def verdict_codes(stack: CalibrationStack) -> dict[str, Places]:
    """Put the verdicts of the gates of such a stack into columns, by the names of the gates.

    A column has places in `accelcal.gates.verdict.VERDICTS`, shape (R * t,); those of the record,
    which all its tables share, come last.
    """
    found = {}
    for gates in zip(*stack.gates, strict=True):
        found[gates[0].name] = np.stack([gate.verdict for gate in gates], axis=1).ravel()
    for gate in stack.record_gates:
        found[gate.name] = np.repeat(gate.verdict, len(stack.tables))
    return found


def gate_warnings(stack: CalibrationStack) -> dict[int, list[str]]:
    """Say what the gates of such a stack found that warn.

    By the row of a table, of R * t, these are the sentences of its gates that warn, then of those
    of its record; rows without any are left out.
    """
    tables = len(stack.tables)
    found: dict[int, list[str]] = {}
    for table, gates in enumerate(stack.gates):
        for gate in gates:
            for place in gate.warned():
                found.setdefault(place * tables + table, []).append(gate.warning(place))
    for gate in stack.record_gates:
        for place in gate.warned():
            said = gate.warning(place)
            for row in range(place * tables, (place + 1) * tables):
                found.setdefault(row, []).append(said)
    return found


def _of_tables(stack: CalibrationStack) -> dict[str, Column]:
    """What the tables hold, and how well they were fitted."""
    records, estimate, tables = len(stack), stack.estimate, range(len(stack.tables))
    readings = np.array([residual.shape[1] for residual in estimate.residuals])
    return {
        "temperature_degC": stack.plan.levels.ravel(),
        "readings": np.tile(readings, records),
        "dof": np.tile([estimate.dof(table) for table in tables], records),
        "residual_rms": np.stack([estimate.residual_rms(t) for t in tables], axis=1).ravel(),
    }
