"""Strokes in a wrong order or of the wrong sign, tables turned as a whole, runs unlike the others.

Each table is fitted by itself. A run may be mounted anew, in another unit or over another resistor:
no residual shows another size, which temperature laws, or free shifts of the scale factor, take up.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask, Places
from accelcal.discovery.columns import dummies, orthonormal, without
from accelcal.effects.catalogue import catalogue
from accelcal.estimate.launch import same_levels
from accelcal.estimate.tables import PreparedTable, prepare
from accelcal.estimate.trend import moments
from accelcal.gates.order import OtherOrder, order_of_strokes
from accelcal.gates.record import is_turn
from accelcal.gates.sizes import LARGEST_RATIOS, other_positions, wrong_sign
from accelcal.gates.verdict import angle, times
from accelcal.geometry import accelerations, side_of
from accelcal.head_angles import head_positions
from accelcal.numerics.grouping import distinct
from accelcal.numerics.probability import f_survival, student_survival
from accelcal.record import TumbleRecord
from accelcal.results.findings import WRONG_ORDER, Fault
from accelcal.results.quantity import Quantity

SMALLEST = 1e-300
"""Smallest p-value told, and smallest error that is divided by."""

_LAGGING = 1.5
"""Squared residuals of another order, over those of a lag, from which on it is the lag."""

_FAR_BETTER = 50.0
"""How many times smaller another order of one direction must make the squared residuals: where it
leaves more, lags of any kind are likelier."""


def wrong_orders(record: TumbleRecord, delta0: float) -> tuple[tuple[Fault, ...], TumbleRecord]:
    """Find strokes that would fit far better in another order or sign, and put them right."""
    found: list[Fault] = []
    for own in tables_of(record):
        # with few strokes, a second wrong one may show only when the first is put right
        for _ in range(int(distinct(record.stroke[own]).size)):
            table = prepare(record.select(own), delta0=delta0)
            other = order_of_strokes(table, delta0)
            if other is None or _lags_instead(table.record, other):
                break
            places = np.flatnonzero(own)[other.chosen]
            found.append(_fault(record, table, other, places))
            record = _put_right(record, other, places)
    return tuple(found), record


def turned_tables(record: TumbleRecord, delta0: float, index: Places) -> tuple[Fault, ...]:
    """Find tables that are turned or negated as a whole, which leaves no residual.

    There is a fault for each, or one for all. They are left as they are. The index, shape (n,),
    tells what to call each reading.
    """
    tables = tables_of(record)
    turned = [_turned(record, own, delta0, index) for own in tables]
    found = [fault for fault in turned if fault is not None]
    alike = len({fault.name for fault in found}) == 1 and len(found) == len(tables)
    if not alike or len(found) < 2:
        return tuple(found)
    text = f"all tables alike, {found[0].finding}"
    readings = sorted(reading for fault in found for reading in fault.readings)
    p = max(fault.p_value for fault in found)
    return (replace(found[0], p_value=p, readings=tuple(readings), finding=text),)


def _lags_instead(record: TumbleRecord, other: OtherOrder) -> bool:
    """Whether an offset, a backlash or a hysteresis between the strokes fits better still.

    Only strokes of one direction look so: beside a small misalignment, a lag of b is M = b forward
    and M = -b back, as if back were mirrored. What is mirrored in truth looks like a lag as well,
    but none fits better. Whatever stands at a position in each of its readings tells nothing, as it
    may be another effect.
    """
    sense = np.where(record.stroke % 2 == 1, 1.0, -1.0)
    if abs(sense @ np.where(other.chosen, 1.0, -1.0)) < sense.size:  # not all of one direction
        return False
    if other.better < _FAR_BETTER:
        return True
    cross = np.sin(np.deg2rad(record.angle))
    by_sense = np.stack([np.ones_like(cross), cross, np.sign(np.round(cross, 9))], axis=1)
    lagging = np.hstack([dummies(head_positions(record.angle)), sense[:, None] * by_sense])
    ordered = dummies(head_positions(np.where(other.chosen, other.angle, record.angle)))
    output = np.where(other.chosen, other.sign, 1.0) * record.output
    rest = without(record.output, orthonormal(lagging)), without(output, orthonormal(ordered))
    lag, order = (float(each @ each) for each in rest)
    return lag < order / _LAGGING


def _fault(record: TumbleRecord, table: PreparedTable, other: OtherOrder, places: Places) -> Fault:
    dof = float(len(table.record) - len(table.estimability.kept))
    return told_fault(
        "wrong order of positions" if other.sign > 0.0 else "wrong sign",
        f"{of_run(record, int(places[0]))}{other.said}: the residuals are"
        f" {times(float(np.sqrt(other.better)))} times smaller so, and that is how they are taken;"
        " correct the table",
        {},
        f_survival(other.better, dof, dof),
        places.tolist(),
    )


def _put_right(record: TumbleRecord, other: OtherOrder, places: Places) -> TumbleRecord:
    angle, output, position = record.angle.copy(), record.output.copy(), record.position.copy()
    angle[places] = _within_the_turn(other.angle[other.chosen], record.angle[places])
    output[places] *= other.sign
    numbered = places[record.position[places] > 0]
    steps = np.mod(angle[numbered], 360.0 + 1e-6) * record.positions / 360.0
    position[numbered] = np.round(steps).astype(np.int64) + 1
    return replace(record, angle=angle, output=output, position=position)


def _within_the_turn(turned: Array, given: Array) -> Array:
    """The angles of a stroke within the turn in which they were given."""
    start = 360.0 * np.floor(given.min() / 360.0)
    # a stroke that was mirrored may have ended whole turns away
    turned = turned + 360.0 * np.round((given.mean() - turned.mean()) / 360.0)
    over = (turned > start + 360.0 + 1e-6) * 360.0
    under = (turned < start - 1e-6) * 360.0
    return np.asarray(turned - over + under)


def _turned(record: TumbleRecord, own: Mask, delta0: float, index: Places) -> Fault | None:
    found = single_table(record, own, delta0)
    k1 = found.values["K1"]
    over = {
        name: abs(found.values.get(name, 0.0)) / largest for name, largest in LARGEST_RATIOS.items()
    }
    if k1 > 0.0 and max(over.values()) <= k1:
        return None
    where, readings = of_run(record, int(own.argmax())), index[own].tolist()
    remedy = "correct the table, it is fitted as given"
    other = other_positions(found.table, found.table.record.output, delta0)
    if other is not None:
        # either the model leaves much, or it takes the other positions up by what is out of size
        better = float(found.rest @ found.rest) / max(other.squares, SMALLEST)
        left = f_survival(better, found.dof, found.dof)
        chance = min(left, found.chance(max(over, key=lambda name: over[name])))
        return told_fault(other.name, f"{where}{other.said}; {remedy}", {}, chance, readings)
    is_straight = over["M"] <= abs(k1)
    if k1 > 0.0 and is_straight:
        return None
    m = side_of(found.table.mounting) * found.values.get("M", 0.0)
    turn = float(np.degrees(np.arctan2(-m, k1)))
    name, said = (
        ("wrong sign", wrong_sign(k1, record.unit))
        if is_straight
        else ("positions shifted", f"all positions as if shifted by {turn:.1f} deg")
    )
    what = "K1" if is_straight else "M"
    turned = Quantity(turn, float(np.degrees(found.error(what) / np.hypot(k1, m))), "deg")
    finding = f"{where}{said}; {remedy}"
    return told_fault(name, finding, {"turn": turned}, found.chance(what), readings)


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
                    found.append(_remounted(record, own, reference, turn, error))
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


def _remounted(
    record: TumbleRecord, own: _Tilt, reference: _Tilt, turn: float, error: float
) -> Fault:
    run, earlier = (record.run_labels[record.run[tilt.readings][0]] for tilt in (own, reference))
    return told_fault(
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
    own_tables = [record.select(own) for own in tables_of(record) if readings[own][0]]
    prepared = (prepare(own, delta0=delta0) for own in own_tables)
    if is_turned or any(other_positions(own, own.record.output, delta0) for own in prepared):
        return (), record
    factor = 10.0 ** round(np.log10(ratio[odd]))
    factor = factor if abs(ratio[odd] / factor - 1.0) < _OF_ANOTHER_SIZE else ratio[odd]
    finding = (
        f"K1 of run {record.run_labels[odd]} is {ratio[odd]:.3g} times that of the others: another"
        f" unit, resistor or accelerometer; taken over {factor:.3g}, mend that first"
    )
    mended = replace(record, output=np.where(readings, record.output / factor, record.output))
    where = np.flatnonzero(readings).tolist()
    return (told_fault("run of another size", finding, {}, 0.0, where),), mended


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


class SingleTable(NamedTuple):
    """A table with its least-squares coefficients."""

    table: PreparedTable
    values: Mapping[str, float]  # coefficients that the angles determine [output unit / g^n]
    rest: Array  # what they leave of the readings, (n,) [output unit]
    dof: float  # degrees of freedom of that, 1 where there are none

    def error(self, name: str) -> float:
        """Standard uncertainty of a coefficient, by what is left of the readings."""
        row = self.table.least_squares.map[self.table.estimability.kept.index(name)]
        return float(max(np.sqrt(row @ row * (self.rest @ self.rest) / self.dof), SMALLEST))

    def chance(self, name: str) -> float:
        """Chance of the size of a coefficient, if it is 0."""
        return 2.0 * student_survival(abs(self.values[name]) / self.error(name), self.dof)


def tables_of(record: TumbleRecord) -> list[Mask]:
    """Readings of each table that has more than one."""
    return [own for own in record.table_masks() if own.sum() > 1]


def single_table(record: TumbleRecord, readings: Mask, delta0: float) -> SingleTable:
    """Fit one of the tables of a record, with a fixture angle [rad]."""
    table = prepare(record.select(readings), delta0=delta0)
    values = table.least_squares.solve(table.record.output)
    rest = table.record.output - table.kept_design @ values
    told = dict(zip(table.estimability.kept, values.tolist(), strict=True))
    return SingleTable(table, told, rest, max(float(rest.size - values.size), 1.0))


def told_fault(
    name: str,
    finding: str,
    parameters: Mapping[str, Quantity],
    chance: float,
    readings: Sequence[int] = (),
) -> Fault:
    """Tell a fault by the id of its entry in the catalogue, or one of the order that has none."""
    names = {entry.id: entry.name for entry in catalogue()}
    kind = name if name in names else WRONG_ORDER
    p_value = max(chance, SMALLEST)
    return Fault(kind, names.get(name, name), finding, parameters, p_value, tuple(readings))


def of_run(record: TumbleRecord, reading: int) -> str:
    """Begin to say where a reading is: of which run, where there are several."""
    label = record.run_labels[record.run[reading]]
    return f"run {label}, " if len(record.run_labels) > 1 else ""
