"""From the calibrations of a stack to columns of the two frames, and to verdicts, all at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from itertools import chain, compress
from operator import attrgetter
from typing import Any

import numpy as np

from accelcal.archive.formats import (
    LAWS,
    ROWS,
    Columns,
    FrameColumn,
    put_together,
)
from accelcal.arrays import Labels, Places
from accelcal.calibrate.stack import CalibrationStack
from accelcal.estimate.reversal import misalignment_stack
from accelcal.gates.verdict import VERDICTS
from accelcal.io.records import declared_lot
from accelcal.model import law_units
from accelcal.numerics.grouping import grouped
from accelcal.record import TumbleRecord
from accelcal.results.table import mountings_of_laws
from accelcal.results.tabular import gate_column
from accelcal.results.verdict import OUTCOMES
from accelcal.sentences import both
from accelcal.specification import Specification
from accelcal.temperature.from_tables import LawsOfRecords
from accelcal.temperature.one_meaning import telling_laws
from accelcal.verdict.conformity import SECOND_AXIS, Found, Measured, conformity
from accelcal.version import SOFTWARE

JOINT = " | "
"""Between the texts in one cell."""


def stacked_tables(stack: CalibrationStack) -> Columns:
    """Columns of the tables of a stack, record after record: of R of t tables R * t rows."""
    records, count = stack.plan.records, len(stack.tables)
    record = np.repeat(np.arange(len(records)), count)
    table = np.tile(np.arange(count), len(records))
    stands_for = [
        JOINT.join(f"{n}: {m}" for n, m in own.items()) for own in stack.estimate.stands_for
    ]
    runs = Labels.of([record.run_labels for record in records])
    found: Columns = {
        **_numbers(stack),
        **_of_records(stack, record, ROWS),
        **_verdicts(stack),
        "run": Labels(
            np.add.outer(count * runs.code, np.arange(count)).ravel(),
            [labels[run] for labels in runs.values for run in stack.plan.runs],
        ),
        "mounting": Labels(table, _mountings(stack)),
        "stands_for": Labels(table, stands_for),
        "warnings": _warnings(stack),
    }
    same = {"method": stack.options.method, "robust": stack.options.robust, "failed_limits": ""}
    found |= {name: Labels.everywhere(value, record.size) for name, value in same.items()}
    found["delta0_rad"] = np.full(record.size, stack.delta0)
    return _columns(found, ROWS, record.size)


def _mountings(stack: CalibrationStack) -> list[str]:
    """Mounting of each table, which is that of all records."""
    return [table.mounting for table in stack.tables]


def _numbers(stack: CalibrationStack) -> Columns:
    """What the tables hold, how well they were fitted, and what was found of them.

    A count is a label, as it has no NaN for nothing.
    """
    estimate, tables = stack.estimate, range(len(stack.tables))
    found: Columns = {
        "temperature_degC": stack.plan.levels.ravel(),
        "readings": _counts(list(map(estimate.readings, tables))),
        "dof": _counts(list(map(estimate.dof, tables))),
        "residual_rms": np.stack(list(map(estimate.residual_rms, tables)), axis=1).ravel(),
    }
    for quantities in stack.quantities:
        found |= quantities.columns()
    return found


def _counts(of_tables: Sequence[Places]) -> Labels[int]:
    """Counts of each table, shape (R,), record after record."""
    count, cell, _ = grouped(np.stack(of_tables, axis=1).ravel())
    return Labels(cell, count.tolist())


def _verdicts(stack: CalibrationStack) -> Columns:
    """Verdicts of the gates of the tables and of the record, which all its tables share."""
    codes = {
        gates[0].name: np.stack([gate.verdict for gate in gates], axis=1).ravel()
        for gates in zip(*stack.gates, strict=True)
    }
    codes |= {gate.name: np.repeat(gate.verdict, len(stack.tables)) for gate in stack.record_gates}
    return {gate_column(name): Labels(code, list(VERDICTS)) for name, code in codes.items()}


def how_many_warn(stack: CalibrationStack) -> int:
    """Count the records of which a gate warns."""
    gates = (*chain(*stack.gates), *stack.record_gates)
    return len({place for gate in gates for place in gate.warned()})


def _warnings(stack: CalibrationStack) -> Labels[str]:
    """Sentences about each table and its record, and of the gates that warn, joined."""
    warned = stack.warnings
    told = Labels.joined([both(own, warned.of_record) for own in warned.of_tables])
    code = told.code.reshape(len(stack.tables), -1).T.ravel()
    values = told.values
    for row, found in _gate_warnings(stack).items():
        values.append((*values[code[row]], *found))
        code[row] = len(values) - 1
    return Labels(code, list(map(JOINT.join, values)))


def _gate_warnings(stack: CalibrationStack) -> dict[int, list[str]]:
    """Sentences of the gates of a table that warn, then of its record, by the row of the table."""
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


def stacked_laws(stack: CalibrationStack) -> tuple[Columns, Places]:
    """Columns of the temperature laws of a stack, record after record.

    Returns cells of each of `LAWS`, and the place in the stack of the record of each row.
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
    have = _mountings(stack)
    main, second = mountings_of_laws(have, telling_laws(stack.estimate))
    found = {main: stack.told_laws.main}
    if second is not None:
        found[second] = stack.told_laws.second_axis
    laws = ((mounting, found.get(mounting)) for mounting in dict.fromkeys(have))
    return [(mounting, own) for mounting, own in laws if own is not None]


def _laws_of(stack: CalibrationStack, laws: LawsOfRecords, mounting: str) -> tuple[Columns, Places]:
    record, term = np.nonzero(~np.isnan(laws.value))
    units = [_law_unit(name, stack.plan.records[0].unit) for name in laws.names]
    dof = laws.dof[record, term]
    found: Columns = {
        **_of_records(stack, record, LAWS),
        "mounting": Labels.everywhere(mounting, record.size),
        "coefficient": Labels(term, list(laws.names)),
        "value": laws.value[record, term],
        "standard_uncertainty": laws.standard[record, term],
        "expanded_uncertainty": laws.expanded[record, term],
        "dof": np.where(np.isinf(dof), np.nan, dof),
        "unit": Labels(term, units),
        "warnings": Labels.of([JOINT.join(said) for said in laws.warnings]).taken(record),
    }
    return _columns(found, LAWS, record.size), record


def _of_records(stack: CalibrationStack, row: Places, kinds: Mapping[str, FrameColumn]) -> Columns:
    """Cells that rows have from their records, those of one plan."""
    records = stack.plan.records
    return {
        **{
            name: Labels(row, list(map(read, records)))
            for name, read in _OF_RECORD.items()
            if name in kinds
        },
        "output_unit": Labels.everywhere(records[0].unit, row.size),
        "g_local_m_s2": np.full(row.size, records[0].apparatus.local_gravity, dtype=np.float64),
        "T0_degC": stack.references[row],
    }


_OF_RECORD: Mapping[str, Callable[[TumbleRecord], Any]] = {
    **{name: attrgetter(name) for name in ("source", "serial", "date", "sha256")},
    "line": lambda record: None if record.line is None else record.line.item(0),
    "notes": lambda record: JOINT.join(record.notes),
    "lot": lambda record: declared_lot(record.metadata),
}


def _columns(found: Columns, kinds: Mapping[str, FrameColumn], rows: int) -> Columns:
    """Cells of all columns; one that is not found is empty."""
    software = {"software": Labels.everywhere(SOFTWARE, rows)}
    every: Columns = {
        name: np.full(rows, np.nan) if kind.kind == "number" else Labels.everywhere(None, rows)
        for name, kind in kinds.items()
        if name not in found
    }
    every |= {**found, **software}
    return {name: every[name] for name in kinds}


def _law_unit(term: str, unit: str | None) -> str:
    law, _, part = term.partition(" ")
    return "g" if law == "hysteresis" else law_units(unit)[law][part != "at_T0"]


def verdicts_of(
    stack: CalibrationStack, tables: Columns, specification: Specification
) -> dict[str, list[str]]:
    """Judge the calibrations of a stack against a data sheet.

    The columns are those of their tables, record after record. Returns the worst outcome of each
    record, of `OUTCOMES`, and the names of the limits that it fails, joined, by their columns.
    """
    found = list(conformity(specification, _measured(stack, tables)))
    outcome = np.array([np.where(each.holds, each.outcome, len(OUTCOMES)) for each in found])
    names = [each.limit.name for each in found]
    told = cache(lambda *failed: JOINT.join(dict.fromkeys(compress(names, failed))))
    return {
        "verdict": [OUTCOMES[worst] for worst in outcome.min(axis=0).tolist()],
        "failed_limits": list(map(told, *(outcome == OUTCOMES.index("fail")).tolist())),
    }


def _measured(stack: CalibrationStack, tables: Columns) -> Measured:
    free = Found(*misalignment_stack(stack.tables, stack.estimate, stack.plan.levels))

    def quantity(symbol: str, place: int | str) -> Found:
        if isinstance(place, str):
            return _of_law(stack, place)
        columns = tables[symbol], tables[f"{symbol}_expanded_uncertainty"]
        own = Found(*(np.asarray(column).reshape(free.value.shape)[:, place] for column in columns))
        if symbol != "delta":
            return own
        known = ~np.isnan(own.value) & ~np.isnan(free.value[:, place])
        return Found(*(np.where(known, f[:, place], o) for f, o in zip(free, own, strict=True)))

    return Measured(
        output_unit=stack.plan.records[0].unit,
        mountings=_mountings(stack),
        temperatures=stack.plan.levels,
        reference=stack.references,
        quantity=quantity,
    )


def _of_law(stack: CalibrationStack, term: str) -> Found:
    is_second = term.startswith(SECOND_AXIS)
    laws = stack.told_laws.second_axis if is_second else stack.told_laws.main
    if laws is None:
        return Found(*np.full((2, len(stack)), np.nan))
    place = laws.names.index(term.removeprefix(SECOND_AXIS))
    return Found(laws.value[:, place], laws.expanded[:, place])
