"""Readings as they would be, had the head stood at its nominal angles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from accelcal.calibrate.plan import OnePlan
from accelcal.estimate.at_positions import as_read_there
from accelcal.estimate.tables import PreparedTable
from accelcal.record import naming

if TYPE_CHECKING:
    from accelcal.results.head_calibration import HeadCalibration


def at_true_angles(
    plan: OnePlan, head: HeadCalibration, tables: Sequence[PreparedTable], delta0: float
) -> OnePlan:
    """Take the known errors of the head out of the readings.

    Parameters
    ----------
    plan : OnePlan
        Records of one plan.
    head : HeadCalibration
        What is known of the head.
    tables : sequence of PreparedTable
        The tables of the first record.
    delta0 : float
        Fixture angle [rad].

    Returns
    -------
    OnePlan
        The records with Y(th) in place of Y(th + e), e the error of the position, and with the
        uncertainty that is left of the head as the declared one.

    Raises
    ------
    InputError
        If a position of the test is none of the head.

    Notes
    -----
    The coefficients that make the difference are those of the readings that it makes.
    """
    first = plan.records[0]
    whole = np.empty((len(plan.records), len(first)))
    for table, mask, readings in zip(tables, plan.masks, plan.outputs, strict=True):
        with naming(first):
            error, _ = head.at(table.head)
        true = table.record.angle + np.rad2deg(error)
        whole[:, mask] = as_read_there(table, readings, true, delta0)
    apparatus = replace(first.apparatus, head_uncertainty=head.uncertainty)
    records = [
        replace(record, output=output, apparatus=apparatus)
        for record, output in zip(plan.records, whole, strict=True)
    ]
    return plan._replace(records=records, outputs=tuple(whole[:, mask] for mask in plan.masks))
