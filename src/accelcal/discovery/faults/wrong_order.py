"""Strokes in a wrong order or of the wrong sign, and tables turned as a whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from accelcal.arrays import Array, Mask, Places
from accelcal.discovery.columns import dummies
from accelcal.discovery.faults.fault import SMALLEST, of_run, order_fault
from accelcal.discovery.faults.single_tables import single_table, tables_of
from accelcal.discovery.spans import orthonormal, without
from accelcal.estimate.tables import PreparedTable, prepare
from accelcal.gates.order import OtherOrder, order_of_strokes
from accelcal.gates.sizes import LARGEST_RATIOS, other_positions, wrong_sign
from accelcal.gates.verdict import times
from accelcal.geometry import side_of
from accelcal.head_angles import head_positions
from accelcal.numerics.grouping import distinct
from accelcal.numerics.probability import f_survival
from accelcal.record import TumbleRecord
from accelcal.results.findings import Fault
from accelcal.results.quantity import Quantity

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
    return (_of_all(found),) if alike and len(found) > 1 else tuple(found)


def _of_all(found: list[Fault]) -> Fault:
    """The same fault of all tables as one."""
    text = f"all tables alike, {found[0].finding}"
    readings = sorted(reading for fault in found for reading in fault.readings)
    p = max(fault.p_value for fault in found)
    return replace(found[0], p_value=p, readings=tuple(readings), finding=text)


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
    return order_fault(
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
        return order_fault(other.name, f"{where}{other.said}; {remedy}", {}, chance, readings)
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
    return order_fault(name, finding, {"turn": turned}, found.chance(what), readings)
