"""From the calibrations of a stack to columns of the two frames, and to verdicts, all at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from itertools import chain, compress
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.archive.columns import (
    LAWS,
    ROWS,
    Columns,
    FrameColumn,
    gate_column,
    put_together,
)
from accelcal.arrays import Labels, Places
from accelcal.calibrate.columns import gate_warnings, mountings_of, numbers_of, verdict_codes
from accelcal.calibrate.stack import CalibrationStack
from accelcal.estimate.reversal import misalignment_stack
from accelcal.gates.verdict import VERDICTS
from accelcal.io.values.lots import declared_lot
from accelcal.model import law_units
from accelcal.numerics.grouping import grouped
from accelcal.record import TumbleRecord
from accelcal.results.table import mountings_of_laws
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
    """Columns of the tables of a stack, record after record.

    Of R records of t tables these are R * t cells of each of `ROWS`.
    """
    records, count = stack.plan.records, len(stack.tables)
    record = np.repeat(np.arange(len(records)), count)
    table = np.tile(np.arange(count), len(records))
    stands_for = [
        JOINT.join(f"{n}: {m}" for n, m in own.items()) for own in stack.estimate.stands_for
    ]
    runs = Labels.of([record.run_labels for record in records])
    verdicts = {
        gate_column(name): Labels(code, list(VERDICTS))
        for name, code in verdict_codes(stack).items()
    }
    found: Columns = {
        **_numbers(numbers_of(stack)),
        **_of_records(stack, record, ROWS),
        **verdicts,
        "run": Labels(
            np.add.outer(count * runs.code, np.arange(count)).ravel(),
            [labels[run] for labels in runs.values for run in stack.plan.runs],
        ),
        "mounting": Labels(table, mountings_of(stack)),
        "stands_for": Labels(table, stands_for),
        "warnings": _warnings(stack),
    }
    same = {"method": stack.options.method, "robust": stack.options.robust, "failed_limits": ""}
    found |= {name: Labels.everywhere(value, record.size) for name, value in same.items()}
    found["delta0_rad"] = np.full(record.size, stack.delta0)
    return _columns(found, ROWS, record.size)


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
    for row, found in gate_warnings(stack).items():
        values.append((*values[code[row]], *found))
        code[row] = len(values) - 1
    return Labels(code, list(map(JOINT.join, values)))


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
    have = mountings_of(stack)
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


def _numbers(found: Mapping[str, NDArray[Any]]) -> Columns:
    """Columns of numbers; a count is a label, as it has no NaN for nothing."""
    return {
        name: column if column.dtype == np.float64 else _counts(column)
        for name, column in found.items()
    }


def _counts(column: NDArray[Any]) -> Labels[int]:
    values, code, _ = grouped(column)
    return Labels(code, values.tolist())


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


class StackVerdicts(NamedTuple):
    """Verdicts of R records.

    Attributes
    ----------
    outcomes : list of str, length R
        The worst outcome of each, of `OUTCOMES`.
    failed_limits : list of str, length R
        Names of the limits that each fails, joined.
    """

    outcomes: list[str]
    failed_limits: list[str]


def verdicts_of(
    stack: CalibrationStack, tables: Columns, specification: Specification
) -> StackVerdicts:
    """Judge the calibrations of a stack against a data sheet.

    The columns are those of their tables, record after record.
    """
    found = list(conformity(specification, _measured(stack, tables)))
    outcome = np.array([np.where(each.holds, each.outcome, len(OUTCOMES)) for each in found])
    names = [each.limit.name for each in found]
    told = cache(lambda *failed: JOINT.join(dict.fromkeys(compress(names, failed))))
    return StackVerdicts(
        [OUTCOMES[worst] for worst in outcome.min(axis=0).tolist()],
        list(map(told, *(outcome == OUTCOMES.index("fail")).tolist())),
    )


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
        mountings=mountings_of(stack),
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
