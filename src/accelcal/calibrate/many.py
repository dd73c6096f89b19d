"""Many records calibrated together, plan by plan."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Places
from accelcal.calibrate.options import Options
from accelcal.calibrate.plan import OnePlan, plans_of
from accelcal.calibrate.stack import CalibrationStack, calibration_stack
from accelcal.errors import InputError
from accelcal.record import TumbleRecord


class Many(NamedTuple):
    """Calibrations of many records.

    Attributes
    ----------
    stacks : tuple of tuple
        Places of the records of each plan among those given, and their calibrations.
    failures : mapping of int to InputError
        Place of each record that could not be calibrated, and why.
    """

    stacks: tuple[tuple[Places, CalibrationStack], ...]
    failures: Mapping[int, InputError]


def calibrate_many(records: Sequence[TumbleRecord], options: Options | None = None) -> Many:
    """Calibrate many records, those of one plan together.

    Returns
    -------
    Many
        Their calibrations: `CalibrationStack.one` gives what `accelcal.fit` gives, and
        `accelcal.calibrate.columns` the columns of all.

    Raises
    ------
    InputError
        If what is asked is asked of no record.

    Notes
    -----
    Alone are, beside those of `plans_of`, records that told of the head that is given: what they
    told is left out, so that each has a head of its own. The sizes of the effects of a model are
    found record by record; the records without them are calibrated together.

    Examples
    --------
    >>> import accelcal
    >>> found = calibrate_many([accelcal.simulate(seed=seed) for seed in range(3)])
    >>> [(places.tolist(), len(stack)) for places, stack in found.stacks]
    [([0, 1, 2], 3)]
    """
    asked = Options() if options is None else options
    asked.check()
    stacks: list[tuple[Places, CalibrationStack]] = []
    failures: dict[int, InputError] = {}
    for places, plan in plans_of(records, asked.delta0):
        for rows, part in _parts(plan, asked):
            for found in _attempts(places[rows], part, asked):
                if isinstance(found[1], InputError):
                    failures[int(found[0][0])] = found[1]
                else:
                    stacks.append((found[0], found[1]))
    return Many(tuple(stacks), failures)


def _parts(plan: OnePlan, options: Options) -> Iterator[tuple[Places, OnePlan]]:
    """Records that can be calibrated together, and each by itself that told of the head."""
    apart = options.left_out(plan.records)
    if not apart.any():
        yield np.arange(apart.size), plan
        return
    for rows in (*np.flatnonzero(apart)[:, None], np.flatnonzero(~apart)):
        if rows.size:
            yield rows, plan.of_records(rows)


def _attempts(
    places: Places, plan: OnePlan, options: Options
) -> Iterator[tuple[Places, CalibrationStack | InputError]]:
    """Calibrate records of a plan together, or each by itself where that fails."""
    try:
        yield places, calibration_stack(plan, options)
    except InputError as error:
        if len(places) == 1:
            yield places, error
            return
        for row in range(len(places)):
            yield from _attempts(places[[row]], plan.of_records(np.array([row])), options)
