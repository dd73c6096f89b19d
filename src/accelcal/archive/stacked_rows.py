"""From the calibrations of a stack to columns of the two frames, without a step for each table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from accelcal.archive.columns import LAWS, ROWS
from accelcal.archive.formats import Columns
from accelcal.archive.rows import JOINT
from accelcal.archive.warned import warnings_of
from accelcal.calibrate.columns import columns_of
from accelcal.calibrate.stack import CalibrationStack
from accelcal.record import TumbleRecord
from accelcal.version import __version__

__all__ = ["can_be_columns", "stacked_laws", "stacked_tables"]

_SLOPES = {"k0": "g/degC", "K1": "1/degC", "delta": "rad/degC"}
_AT_T0 = {"k0": "g", "delta": "rad"}


def can_be_columns(stack: CalibrationStack) -> bool:
    """Tell whether the rows of a stack come from its arrays alone.

    Parameters
    ----------
    stack : CalibrationStack
        The calibrations.

    Returns
    -------
    bool
        False where its calibrations are to be made one by one.
    """
    return (
        not stack.is_alone
        and stack.options.temperature_laws == "tables"
        and stack.laws.second_axis is None
    )


def stacked_tables(stack: CalibrationStack) -> Columns:
    """Columns of the tables of a stack, record after record.

    Parameters
    ----------
    stack : CalibrationStack
        R records of t tables.

    Returns
    -------
    mapping of str to list
        R * t cells of each of `ROWS`, None or NaN where there is nothing.
    """
    records, tables = stack.plan.records, stack.tables
    found: Columns = {name: column.tolist() for name, column in columns_of(stack).items()}
    stands_for = [
        JOINT.join(f"{n}: {m}" for n, m in own.items()) for own in stack.estimate.stands_for
    ]
    warned = [(JOINT.join(said), own) for said, own in warnings_of(stack)]
    warnings = [JOINT.join((*own, said)) for said, each in warned for own in each]
    per_record = {**_of_records(records), "T0_degC": stack.references.tolist()}
    found |= {name: _repeated(cells, len(tables)) for name, cells in per_record.items()}
    found |= {"stands_for": stands_for * len(records), "warnings": warnings}
    same = {"method": stack.options.method, "robust": stack.options.robust}
    same |= {"delta0_rad": stack.delta0, "software": f"accelcal {__version__}"}
    count = len(records) * len(tables)
    found |= {name: [cell] * count for name, cell in same.items()}
    return {name: found.get(name, [None] * count) for name in ROWS}


def stacked_laws(stack: CalibrationStack) -> tuple[Columns, NDArray[np.intp]]:
    """Columns of the temperature laws of a stack, record after record.

    Parameters
    ----------
    stack : CalibrationStack
        The calibrations.

    Returns
    -------
    columns : mapping of str to list
        Cells of each of `LAWS`.
    record : ndarray of int
        Place in the stack of the record of each row.
    """
    laws = stack.laws.main
    if laws is None:
        return {name: [] for name in LAWS}, np.zeros(0, dtype=np.intp)
    record, term = np.nonzero(~np.isnan(laws.value))
    records = stack.plan.records
    warnings = [JOINT.join(laws.warnings(i)) for i in range(len(records))]
    per_record = {
        **_of_records(records),
        "T0_degC": stack.references.tolist(),
        "warnings": warnings,
    }
    place = record.tolist()
    found: Columns = {name: [cells[i] for i in place] for name, cells in per_record.items()}
    units = [_law_unit(name, records[0].unit) for name in laws.names]
    numbers = {"value": laws.value, "standard_uncertainty": laws.standard}
    numbers |= {
        "expanded_uncertainty": laws.expanded,
        "dof": np.where(np.isinf(laws.dof), np.nan, laws.dof),
    }
    found |= {name: values[record, term].tolist() for name, values in numbers.items()}
    found |= {
        "term": [laws.names[i] for i in term.tolist()],
        "unit": [units[i] for i in term.tolist()],
    }
    mountings = [str(table.record.mounting[0]) for table in stack.tables]
    same = {"mounting": max(mountings, key=mountings.count), "software": f"accelcal {__version__}"}
    found |= {name: [cell] * record.size for name, cell in same.items()}
    return {name: found[name] for name in LAWS}, record


def _of_records(records: Sequence[TumbleRecord]) -> dict[str, list[Any]]:
    cells: dict[str, Callable[[TumbleRecord], Any]] = {
        "source": lambda r: r.source,
        "line": lambda r: None if r.line is None else int(r.line[0]),
        "serial": lambda r: r.serial,
        "date": lambda r: r.date,
        "output_unit": lambda r: r.unit,
        "notes": lambda r: JOINT.join(r.notes),
        "failed_limits": lambda _: "",
        "g_local_m_s2": lambda r: r.apparatus.local_gravity,
        "sha256": lambda r: r.sha256,
    }
    return {name: [cell(record) for record in records] for name, cell in cells.items()}


def _repeated(cells: Sequence[Any], times: int) -> list[Any]:
    return [cell for cell in cells for _ in range(times)]


def _law_unit(term: str, unit: str | None) -> str:
    law, _, part = term.partition(" ")
    if law == "hysteresis":
        return "g"
    return _SLOPES[law] if part != "at_T0" else _AT_T0.get(law, f"{unit or 'output unit'}/g")
