"""Readings at the angles that an encoder told, brought to nominal ones; none given twice.

A head that is turned by hand, or a table under control, stops a little beside the angle that was
asked for, and an encoder reads where. Readings at 44.9996 and 45.0008 deg are at one position all
the same: the error of the head there is one and the same, and they are replicates of each other.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from accelcal.arrays import Array, Places
from accelcal.errors import InputError
from accelcal.estimate.tables import PreparedTable, linear_estimator, prepare
from accelcal.head_angles import (
    SAME_POSITION,
    counted_on,
    from_start,
    nominal_angles,
    start_of_turn,
)
from accelcal.numerics.grouping import cells, distinct
from accelcal.record import TumbleRecord, naming
from accelcal.reference import fixture_angle

_FEWEST = 8
"""Readings below which some that agree in all digits may do so by chance."""


def refuse_copies(record: TumbleRecord) -> None:
    """Refuse a record whose readings stand there several times, as each would count as a replicate.

    All that share position, stroke, run and temperature then agree to the last digit, and those of
    other strokes do not, or there are none. Those of a coarse step are no copies: of one position
    they agree from stroke to stroke too, with the next one in the same direction or, with one
    stroke each way, the one back.
    """
    position, every = (record.run, record.mounting, np.round(record.angle, 6)), record.output
    first = _first_of_each(cells(*position, record.stroke, np.nan_to_num(record.temperature)))
    copies = int(np.sum(first != np.arange(first.size)))
    if copies < _FEWEST or np.any(every != every[first]):
        return
    for direction in (record.stroke % 2, 0 * record.stroke):  # back may differ by a play
        before = _first_of_each(cells(*position, direction))
        anew = np.flatnonzero((first == np.arange(first.size)) & (before != first))
        if anew.size:
            break
    if 2 * np.sum(every[anew] == every[before[anew]]) <= anew.size:
        told = "repeat one of the same position, stroke and run to the last digit"
        with naming(record):
            raise InputError(
                f"{copies} of {len(record)} readings {told}, and tell nothing of the noise; give"
                " each reading once"
            )


def _first_of_each(cell: Places) -> Places:
    """Place of the first reading of the cell of each reading."""
    return np.unique(cell, return_index=True)[1][cell]


def refuse_twice(records: Iterable[TumbleRecord]) -> None:
    """Refuse the same readings twice, as a file and its copy, where each adds to what is told."""
    seen: dict[tuple[str | None, bytes], TumbleRecord] = {}
    for record in records:
        key = record.serial, record.output.tobytes()
        if key in seen and seen[key] == record:
            problem = f"the same readings as {seen[key].source}"
            raise InputError(f"{record.source}: {problem}; give each table once")
        seen[key] = record


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
        `accelcal.estimate.at_positions`.

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
