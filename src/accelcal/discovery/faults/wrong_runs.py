"""Runs unlike the others: mounted anew, in another unit, over another resistor.

No residual shows another size: temperature laws, or free shifts of the scale factor, take it up.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.discovery.faults.fault import SMALLEST, order_fault
from accelcal.discovery.faults.single_tables import SingleTable, single_table, tables_of
from accelcal.estimate.launch import same_levels
from accelcal.estimate.tables import prepare
from accelcal.estimate.trend import moments
from accelcal.gates.record import is_turn
from accelcal.gates.sizes import other_positions
from accelcal.gates.verdict import angle
from accelcal.geometry import accelerations
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


_OF_ANOTHER_SIZE = 0.2
"""Part by which a run's scale factor must differ to be that of another unit or accelerometer."""


def run_of_another_size(
    record: TumbleRecord, delta0: float
) -> tuple[tuple[Fault, ...], TumbleRecord]:
    """Find the run whose scale factor is least that of the others, and bring it to their size.

    There is a fault where it is further off than any temperature brings it, with a fixture angle
    [rad], but not where other positions explain that. The outputs of that run are taken over a
    power of ten, where that is what the others differ by, else over the ratio of the scale factors.
    """
    slopes = _slopes(record, delta0)
    size = {run: along for run, (along, _) in slopes.items()}
    usual = sorted(size.values())[(len(size) - 1) // 2] if len(size) > 1 else np.nan
    ratio = {run: abs(own / usual) for run, own in size.items()} if usual else {}
    odd = max(ratio, key=lambda run: abs(np.log(ratio[run])), default=-1)
    if odd < 0 or not abs(ratio[odd] - 1.0) > _OF_ANOTHER_SIZE:
        return (), record
    readings = record.run == odd
    is_turned = abs(np.hypot(*slopes[odd]) / abs(usual) - 1.0) < _OF_ANOTHER_SIZE
    own_tables = [own for own in tables_of(record) if readings[own][0]]
    if is_turned or any(_at_other_positions(record, own, delta0) for own in own_tables):
        return (), record
    factor = 10.0 ** round(np.log10(ratio[odd]))
    factor = factor if abs(ratio[odd] / factor - 1.0) < _OF_ANOTHER_SIZE else ratio[odd]
    finding = (
        f"K1 of run {record.run_labels[odd]} is {ratio[odd]:.3g} times that of the others: another"
        f" unit, resistor or accelerometer; taken over {factor:.3g}, mend that first"
    )
    mended = replace(record, output=np.where(readings, record.output / factor, record.output))
    where = np.flatnonzero(readings).tolist()
    return (order_fault("run of another size", finding, {}, 0.0, where),), mended


def _at_other_positions(record: TumbleRecord, readings: Mask, delta0: float) -> bool:
    table = prepare(record.select(readings), delta0=delta0)
    return other_positions(table, table.record.output, delta0) is not None


def _slopes(record: TumbleRecord, delta0: float) -> dict[int, tuple[float, float]]:
    """Slopes of each run that tells them over a_i and a_p [output unit / g]."""
    sensed = accelerations(record.angle, delta0, record.mounting)
    cross = sensed.cross
    design = np.stack([np.ones(len(record)), sensed.input, cross], axis=1)
    found = {}
    for run in np.unique(record.run).tolist():
        own = record.run == run
        fitted, _, rank, _ = np.linalg.lstsq(design[own], record.output[own], rcond=1e-9)
        if rank == design.shape[1]:
            found[run] = (float(fitted[1]), float(fitted[2]))
    return found
