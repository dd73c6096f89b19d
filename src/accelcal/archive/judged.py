"""Verdicts of the records of a stack against a data sheet, from its arrays."""

from __future__ import annotations

from itertools import compress
from typing import NamedTuple

import numpy as np

from accelcal.archive.cells import Columns
from accelcal.archive.rows import JOINT
from accelcal.calibrate.stack import CalibrationStack
from accelcal.conformity import Found, Measured, conformity
from accelcal.results.verdict import OUTCOMES
from accelcal.specification import Specification

__all__ = ["StackVerdicts", "verdicts_of"]


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

    Parameters
    ----------
    stack : CalibrationStack
        R calibrations, none of them alone.
    tables : mapping of str to ndarray
        Columns of their tables, record after record.
    specification : Specification
        The data sheet.

    Returns
    -------
    StackVerdicts
        What `accelcal.verdict.judge` says of each.

    Raises
    ------
    InputError
        If the unit of the scale factor does not fit the output of the calibrations.
    """
    found = list(conformity(specification, _measured(stack, tables)))
    outcome = np.array([np.where(each.holds, each.outcome, len(OUTCOMES)) for each in found])
    names = [each.limit.name for each in found]
    failed = (outcome == OUTCOMES.index("fail")).T.tolist()
    return StackVerdicts(
        [OUTCOMES[worst] for worst in outcome.min(axis=0).tolist()],
        [JOINT.join(dict.fromkeys(compress(names, own))) for own in failed],
    )


def _measured(stack: CalibrationStack, tables: Columns) -> Measured:
    laws, shape = stack.laws.main, (len(stack), len(stack.tables))
    unknown = np.full(len(stack), np.nan)

    def quantity(symbol: str, place: int | str) -> Found:
        if isinstance(place, int):
            columns = tables[symbol], tables[f"{symbol}_expanded_uncertainty"]
            return Found(*(np.reshape(column, shape)[:, place] for column in columns))
        if laws is None:
            return Found(unknown, unknown)
        term = laws.names.index(place)
        return Found(laws.value[:, term], laws.expanded[:, term])

    return Measured(
        output_unit=stack.plan.records[0].unit,
        mountings=[str(table.record.mounting[0]) for table in stack.tables],
        temperatures=stack.plan.levels,
        reference=stack.references,
        quantity=quantity,
    )
