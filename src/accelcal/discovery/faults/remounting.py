"""A unit that was mounted anew, or turned in its fixture, between runs at one temperature."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.discovery.faults.fault import SMALLEST, order_fault
from accelcal.discovery.faults.single_tables import SingleTable, single_table, tables_of
from accelcal.estimate.launch import same_levels
from accelcal.estimate.trend import moments
from accelcal.gates.record import is_turn
from accelcal.gates.verdict import angle
from accelcal.numerics.probability import student_survival
from accelcal.record import TumbleRecord
from accelcal.results.findings import Fault
from accelcal.results.quantity import Quantity

_MOVES = 4.0  # standard uncertainties of a misalignment that moves within a run


class _Tilt(NamedTuple):
    """Misalignment of a table with its standard uncertainty by the noise, and K1 a_p."""

    readings: Mask
    value: float  # [rad]
    error: float  # [rad]
    dof: float
    column: Array  # change of its readings by it, shape (m,) [output unit / rad]
    moves: bool  # within the run, as on a foundation that tilts


def mounted_anew(record: TumbleRecord, delta0: float) -> tuple[tuple[Fault, ...], TumbleRecord]:
    """Find runs whose misalignment is another than that of an earlier run at the same temperature.

    There is a fault for each, and the run is turned back to the misalignment of the earlier one.
    One that moves within a run, too, is none of a mounting: all are left as they are. The fixture
    angle is in rad.
    """
    found, output = [], record.output.copy()
    tables = tables_of(record)
    for mounting in dict.fromkeys(record.mounting.tolist()):
        masks = [own for own in tables if record.mounting[own][0] == mounting]
        level = np.array([record.select(own).mean_temperature for own in masks])
        for first, *others in (at.tolist() for at in same_levels(level)):
            reference, *later = (_tilt(record, masks[i], delta0) for i in (first, *others))
            if any(own.moves for own in (reference, *later)):
                return (), record
            for own in later:
                turn = own.value - reference.value
                error = float(np.hypot(own.error, reference.error))
                if is_turn(abs(turn), max(own.error, reference.error)):
                    output[own.readings] -= turn * own.column
                    found.append(_fault(record, own, reference, turn, error))
    return tuple(found), replace(record, output=output) if found else record


def _tilt(record: TumbleRecord, readings: Mask, delta0: float) -> _Tilt:
    found = single_table(record, readings, delta0)
    if "M" not in found.values:
        return _Tilt(readings, 0.0, np.inf, 1.0, np.zeros(int(readings.sum())), moves=False)
    k1 = abs(found.values["K1"])
    tilt, error = (each / max(k1, SMALLEST) for each in (found.values["M"], found.error("M")))
    column = found.table.kept_design[:, found.table.estimability.kept.index("M")]
    return _Tilt(readings, tilt, error, found.dof, k1 * column, moves=_moves(found, column))


def _moves(found: SingleTable, column: Array) -> bool:
    """Tell whether what the coefficients leave grows as M that moves with time would."""
    table, record = found.table, found.table.record
    time = None if record.time is None else record.time[None]
    (moment,) = moments(record.angle, record.stroke, time)
    moving = column * (moment - moment.mean())
    moving -= table.kept_design @ table.least_squares.solve(moving)
    size, dof = float(moving @ moving), found.rest.size - len(found.values) - 1
    if dof < 1 or size <= 0.0:
        return False
    rate = float(moving @ found.rest) / size
    left = found.rest - rate * moving
    return abs(rate) > _MOVES * float(np.sqrt(left @ left / dof / size))


def _fault(record: TumbleRecord, own: _Tilt, reference: _Tilt, turn: float, error: float) -> Fault:
    run, earlier = (record.run_labels[record.run[tilt.readings][0]] for tilt in (own, reference))
    return order_fault(
        "mounted anew",
        f"run {run}: the misalignment differs by {angle(abs(turn))} from that of run {earlier}"
        " at the same temperature, as of a unit that was mounted anew; the run is taken as turned"
        " back; calibrate each mounting alone",
        {"turn": Quantity(turn, error, "rad")},
        2.0 * student_survival(abs(turn) / max(error, SMALLEST), own.dof),
        np.flatnonzero(own.readings).tolist(),
    )
