"""Verdicts of the records of a stack against a data sheet, from its arrays."""

from __future__ import annotations

from functools import cache
from itertools import compress
from typing import NamedTuple

import numpy as np

from accelcal.archive.cells import Columns
from accelcal.archive.stacked_rows import JOINT
from accelcal.calibrate.columns import mountings_of
from accelcal.calibrate.stack import CalibrationStack
from accelcal.estimate.reversal import misalignment_stack
from accelcal.results.verdict import OUTCOMES
from accelcal.specification import Specification
from accelcal.verdict.conformity import SECOND_AXIS, Found, Measured, conformity


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
        What `accelcal.judge` says of each.

    Raises
    ------
    InputError
        If the unit of the scale factor does not fit the output of the calibrations.
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
        own = Found(*(np.reshape(column, free.value.shape)[:, place] for column in columns))
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
