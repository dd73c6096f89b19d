"""Readings at the angles that an encoder told, brought to the nominal ones of their positions.

A head that is turned by hand, or a table under control, stops a little beside the angle that was
asked for, and an encoder reads where. Readings at 44.9996 and 45.0008 deg are at one position all
the same: the error of the head there is one and the same, and they are replicates of each other.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from accelcal.arrays import Array
from accelcal.errors import InputError
from accelcal.estimate.given_twice import refuse_copies
from accelcal.estimate.linear import linear_estimator
from accelcal.estimate.tables import PreparedTable, prepare
from accelcal.head_angles import (
    SAME_POSITION,
    counted_on,
    from_start,
    nominal_angles,
    start_of_turn,
)
from accelcal.numerics.sorting import distinct
from accelcal.record import TumbleRecord
from accelcal.reference import fixture_angle

_AS_READ = "angles as read"
_ROUNDS = 3  # each leaves the square of the angles of what the one before left: 1e-9 g after two


def at_positions(record: TumbleRecord, delta0: float | None = None) -> TumbleRecord:
    """Bring the readings of each position to its nominal angle.

    Each reading is changed by what the model (1) of its table makes of the difference, with the
    fixture angle [rad], by default that of the record; a note tells of it. It is the very same
    record where each position has one angle.

    Raises
    ------
    InputError
        If the fixture angle that the record declares is none, or readings are copies of others, see
        `accelcal.estimate.given_twice`.

    Examples
    --------
    >>> import accelcal
    >>> record = accelcal.simulate(seed=1)
    >>> at_positions(record) is record
    True
    """
    refuse_copies(record)
    read = record.graduation
    nominal = nominal_angles(read)
    if nominal is read:
        return record
    there = replace(record, angle=_by_strokes(record, nominal - (read - record.angle)))
    output = record.output.copy()
    for mask in record.table_masks():
        table = there.select(mask)
        output[mask] = _brought(table, record.angle[mask], fixture_angle(record, delta0))
    return replace(there, output=output, notes=(*record.notes, _said(read - nominal)))


def _by_strokes(record: TumbleRecord, angle: Array) -> Array:
    """Count the angles of each stroke on over the turn."""
    for mask in record.table_masks():
        numbers = distinct(record.stroke[mask])
        strokes = [np.flatnonzero(mask & (record.stroke == number)) for number in numbers]
        starts = [start for own in strokes if (start := start_of_turn(angle[own]))]
        within = np.abs(angle[mask] - 180.0).max() < 180.0 + SAME_POSITION
        start = starts[0] if starts and np.ptp(starts) < SAME_POSITION and within else 0.0
        for own in strokes:
            angle[own] = start + counted_on(from_start(angle[own], start) if start else angle[own])
    return angle


def _brought(record: TumbleRecord, read: Array, delta0: float) -> Array:
    try:
        table = prepare(record, delta0=delta0)
    except InputError:
        return record.output  # no table of an accelerometer: whoever works on it says why
    return as_read_there(table, record.output, read, delta0)


def as_read_there(table: PreparedTable, readings: Array, read: Array, delta0: float) -> Array:
    """Readings at the angles of a table in place of others nearby [output unit].

    They were taken at angles of shape (n,) [deg], with a fixture angle [rad]. It is Y(th) in place
    of Y(read), by the coefficients of the table that these readings make, shape (..., n).
    """
    change = table.design_at(read, delta0) - table.design
    estimator, there = linear_estimator(table), readings
    for _ in range(_ROUNDS):
        there = readings - estimator.coefficients(there) @ change.T
    return there


def said_of_positions(record: TumbleRecord) -> tuple[str, ...]:
    """Return what `at_positions` noted in a record, nothing where it left it as it was."""
    return tuple(note for note in record.notes if note.startswith(_AS_READ))


def _said(away: Array) -> str:
    return (
        f"{_AS_READ} lie up to {np.abs(away).max():.2g} deg beside those of their positions:"
        " readings are brought there by the slope of the fit, as one position has one head error"
    )
