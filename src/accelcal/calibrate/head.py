"""Readings as they would be, had the head stood at its nominal angles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from accelcal.calibrate.plan import OnePlan
from accelcal.estimate.linear import linear_estimator
from accelcal.estimate.tables import PreparedTable
from accelcal.geometry import accelerations
from accelcal.model import design_matrix
from accelcal.record import naming
from accelcal.results.head_calibration import HeadCalibration

__all__ = ["at_true_angles"]


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
    The coefficients that make the difference are those of a fit without the head; as they are wrong
    by some e at most, what is left is of the order of e^2, 1e-9 g where e is 3e-5 rad.
    """
    outputs = [record.output.copy() for record in plan.records]
    masks = list(plan.records[0].table_masks())
    for table, mask, readings in zip(tables, masks, plan.outputs, strict=True):
        with naming(plan.records[0]):
            error, _ = head.at(table.head)
        mounting = str(table.record.mounting[0])
        true = table.record.angle + np.rad2deg(error)
        change = design_matrix(accelerations(true, delta0, mounting), mounting) - table.design
        k = linear_estimator(table).coefficients(readings)
        for output, y, off in zip(outputs, readings, k @ change.T, strict=True):
            output[mask] = y - off
    left = head.uncertainty
    return OnePlan.of(
        [
            replace(record.with_apparatus(head_uncertainty=left), output=output)
            for record, output in zip(plan.records, outputs, strict=True)
        ]
    )
