"""From the calibrations of a stack to columns of the two frames, without a step for each table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from accelcal.archive.cells import Cells, Columns, put_together
from accelcal.archive.columns import LAWS, ROWS, FrameColumn
from accelcal.archive.rows import JOINT
from accelcal.archive.warned import warning_cells
from accelcal.calibrate.columns import columns_of
from accelcal.calibrate.stack import CalibrationStack
from accelcal.record import TumbleRecord
from accelcal.temperature.from_tables import LawsOfRecords
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
    return not stack.is_alone and stack.options.temperature_laws == "tables"


def stacked_tables(stack: CalibrationStack) -> Columns:
    """Columns of the tables of a stack, record after record.

    Parameters
    ----------
    stack : CalibrationStack
        R records of t tables.

    Returns
    -------
    mapping of str to list or ndarray
        R * t cells of each of `ROWS`.
    """
    records, tables = stack.plan.records, stack.tables
    table = np.tile(np.arange(len(tables)), len(records))
    record = np.repeat(np.arange(len(records)), len(tables))
    stands_for = [
        JOINT.join(f"{n}: {m}" for n, m in own.items()) for own in stack.estimate.stands_for
    ]
    found: dict[str, Any] = {
        **columns_of(stack),
        **_of_records(records, record),
        "stands_for": np.array(stands_for, dtype=object)[table],
        "warnings": warning_cells(stack),
        "T0_degC": stack.references[record],
        "method": stack.options.method,
        "robust": stack.options.robust,
        "delta0_rad": stack.delta0,
        "failed_limits": "",
    }
    return _columns(found, ROWS, record.size)


def stacked_laws(stack: CalibrationStack) -> tuple[Columns, NDArray[np.intp]]:
    """Columns of the temperature laws of a stack, record after record.

    Parameters
    ----------
    stack : CalibrationStack
        The calibrations.

    Returns
    -------
    columns : mapping of str to list or ndarray
        Cells of each of `LAWS`.
    record : ndarray of int
        Place in the stack of the record of each row.
    """
    parts = [_laws_of(stack, laws, mounting) for mounting, laws in _laws_by_mounting(stack)]
    if not parts:
        return _columns({}, LAWS, 0), np.zeros(0, dtype=np.intp)
    if len(parts) == 1:
        return parts[0]
    record = np.concatenate([own for _, own in parts])
    order = np.argsort(record, kind="stable")
    return put_together([columns for columns, _ in parts], order), record[order]


def _laws_by_mounting(stack: CalibrationStack) -> list[tuple[str, LawsOfRecords]]:
    """Laws of one axis or of both, each with the mounting of most of its tables, in their order."""
    have = [str(table.record.mounting[0]) for table in stack.tables]
    main = max(have, key=have.count)
    others = [mounting for mounting in have if mounting[0] != main[0]]
    found = {main: stack.laws.main}
    if others:
        found[max(others, key=others.count)] = stack.laws.second_axis
    laws = ((mounting, found.get(mounting)) for mounting in dict.fromkeys(have))
    return [(mounting, own) for mounting, own in laws if own is not None]


def _laws_of(
    stack: CalibrationStack, laws: LawsOfRecords, mounting: str
) -> tuple[Columns, NDArray[np.intp]]:
    record, term = np.nonzero(~np.isnan(laws.value))
    records = stack.plan.records
    units = [_law_unit(name, records[0].unit) for name in laws.names]
    warnings = [JOINT.join(said) for said in laws.warnings]
    dof = laws.dof[record, term]
    found: dict[str, Any] = {
        **_of_records(records, record),
        "mounting": mounting,
        "term": np.array(laws.names, dtype=object)[term],
        "value": laws.value[record, term],
        "standard_uncertainty": laws.standard[record, term],
        "expanded_uncertainty": laws.expanded[record, term],
        "dof": np.where(np.isinf(dof), np.nan, dof),
        "unit": np.array(units, dtype=object)[term],
        "T0_degC": stack.references[record],
        "warnings": np.array(warnings, dtype=object)[record],
    }
    return _columns(found, LAWS, record.size), record


def _of_records(records: Sequence[TumbleRecord], row: NDArray[np.intp]) -> dict[str, Any]:
    """Cells that rows have from their records."""
    cells = {
        "source": [r.source for r in records],
        "line": [None if r.line is None else int(r.line[0]) for r in records],
        "serial": [r.serial for r in records],
        "date": [r.date for r in records],
        "output_unit": [r.unit for r in records],
        "notes": [JOINT.join(r.notes) for r in records],
        "sha256": [r.sha256 for r in records],
    }
    gravity = np.array([r.apparatus.local_gravity for r in records], dtype=np.float64)
    of_rows = {name: np.array(own, dtype=object)[row] for name, own in cells.items()}
    return {**of_rows, "g_local_m_s2": gravity[row]}


def _columns(found: Mapping[str, Any], kinds: Mapping[str, FrameColumn], rows: int) -> Columns:
    """Cells of all columns; one that is not found is empty, a single cell that of all rows."""
    every = {**dict.fromkeys(kinds), **found, "software": f"accelcal {__version__}"}
    return {name: _cells(every[name], kind.kind, rows) for name, kind in kinds.items()}


def _cells(found: Any, kind: str, rows: int) -> Cells:
    if kind == "number":
        return np.broadcast_to(np.asarray(found, dtype=np.float64), rows)
    if isinstance(found, np.ndarray):
        return list(found.tolist())
    return found if isinstance(found, list) else [found] * rows


def _law_unit(term: str, unit: str | None) -> str:
    law, _, part = term.partition(" ")
    if law == "hysteresis":
        return "g"
    return _SLOPES[law] if part != "at_T0" else _AT_T0.get(law, f"{unit or 'output unit'}/g")
