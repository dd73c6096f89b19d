"""The conditions under which each reading was taken: what the term of an effect may depend on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from accelcal.arrays import Array, Ints
from accelcal.errors import InputError
from accelcal.frozen_mapping import freeze
from accelcal.geometry import accelerations
from accelcal.pace import too_quick
from accelcal.record import TumbleRecord

__all__ = ["LEVEL_CHANGE", "SAME_ANGLE", "SECONDS_PER_READING", "Conditions", "conditions_of"]

SECONDS_PER_READING = 60.0
"""Time from one reading to the next where a record has no times [s]."""

SAME_ANGLE = 1e-6
"""Head angles closer than this are one position [deg]."""

LEVEL_CHANGE = 2.0
"""Runs closer than this are at one level, reached the same way [degC]."""


@dataclass(frozen=True, slots=True, eq=False)
class Conditions:
    """Conditions of n readings; every array has shape (n,).

    Attributes
    ----------
    number : ndarray of int
        Number of the reading in the order of measuring, from 1.
    angle : ndarray
        Head angle [deg].
    input : ndarray
        Acceleration along the input axis a_i [local g].
    cross : ndarray
        Acceleration along the cross axis in the rotation plane, called a_p [local g].
    axial : ndarray
        Acceleration along the true input axis, which the misalignment tilts [local g].
    excess : ndarray
        Temperature above the reference, dT = T - T0 [degC].
    heating : ndarray
        How the level of the run was reached: +1 by heating, -1 by cooling, 0 first level.
    stroke : ndarray of int
        Stroke k from 1.
    run : ndarray of int
        Index of the run.
    time : ndarray
        Time since the first reading of the record [s].
    run_time : ndarray
        Time since the first reading of the run [s].
    indicated : ndarray
        What the accelerometer indicates without the effect, Y / K1 [local g].
    gain : ndarray
        Scale factor at the temperature of the reading over that at T0 [1].
    per_radian : ndarray
        Change of `indicated` with the head angle [g/rad].
    per_degree : ndarray
        Change of `indicated` with the temperature as it rises [g/degC].
    per_degree_falling : ndarray
        The same as it falls: another one at T0, where bilinear laws have a break.
    draws : ndarray
        Standard normal numbers, for effects that are random; zero where nothing is drawn.
    """

    number: Ints
    angle: Array
    input: Array
    cross: Array
    axial: Array
    excess: Array
    heating: Array
    stroke: Ints
    run: Ints
    time: Array
    run_time: Array
    indicated: Array
    gain: Array
    per_radian: Array
    per_degree: Array
    per_degree_falling: Array
    draws: Array

    def __post_init__(self) -> None:
        freeze(self)  # all terms see the same conditions, whatever one of them does with them

    if not TYPE_CHECKING:

        def __getattr__(self, name):
            known = ", ".join((*self.__dataclass_fields__, "rotation", "order"))
            raise AttributeError(f"conditions have no {name!r}; they have {known}")

    @property
    def rotation(self) -> Array:
        """Sense of rotation of the head: +1 on forward strokes, -1 on back strokes."""
        return np.where(self.stroke % 2 == 1, 1.0, -1.0)

    @property
    def order(self) -> Ints:
        """Indices of the readings in the order of measuring, shape (n,)."""
        return np.argsort(self.number)


def conditions_of(
    record: TumbleRecord, reference_temperature: float, delta0: float = 0.0
) -> Conditions:
    """Conditions of the readings of a record, as the record states them.

    Parameters
    ----------
    record : TumbleRecord
        The readings.
    reference_temperature : float
        T0 [degC].
    delta0 : float, default 0
        Fixture angle [rad].

    Returns
    -------
    Conditions
        Those of an ideal accelerometer: `indicated` and `axial` are a_i, `gain` 1, `per_radian` the
        derivative of a_i, `per_degree` 0. Who knows better replaces them.

    Raises
    ------
    InputError
        If the times are in another unit than s, as readings follow one another too quickly.

    Notes
    -----
    Without times, readings follow one another by run, stroke and, on back strokes, falling head
    angle, one in `SECONDS_PER_READING`. An unknown temperature counts as T0.

    Examples
    --------
    >>> import numpy as np
    >>> from accelcal.record import TumbleRecord
    >>> record = TumbleRecord(
    ...     output=np.zeros(4), angle=np.array([0.0, 90.0, 0.0, 90.0]),
    ...     temperature=np.full(4, 80.0), stroke=np.array([1, 1, 2, 2]),
    ...     run=np.zeros(4, dtype=int), run_labels=("1",), mounting=np.full(4, "o+"),
    ...     position=np.zeros(4, dtype=int))
    >>> conditions = conditions_of(record, 20.0)
    >>> conditions.number.tolist(), conditions.rotation.tolist(), conditions.excess.tolist()
    ([1, 2, 4, 3], [1.0, 1.0, -1.0, -1.0], [60.0, 60.0, 60.0, 60.0])
    """
    number, time = _sequence(record)
    sensed = accelerations(record.angle, delta0, record.mounting)
    excess = np.nan_to_num(record.temperature - reference_temperature, nan=0.0)
    nothing = np.zeros(len(record))
    return Conditions(
        number=number,
        angle=record.angle,
        input=sensed.input,
        cross=sensed.cross,
        axial=sensed.input,
        excess=excess,
        heating=_heating(record.run, excess),
        stroke=record.stroke,
        run=record.run,
        time=time,
        run_time=_since_start_of_run(record.run, time),
        indicated=sensed.input,
        gain=np.ones(len(record)),
        per_radian=accelerations(record.angle + 90.0, delta0).input,  # d cos / d th = cos(th + 90)
        per_degree=nothing,
        per_degree_falling=nothing,
        draws=nothing,
    )


def _sequence(record: TumbleRecord) -> tuple[Ints, Array]:
    """Numbers of the readings in the order of measuring, and their times from the first one."""
    time = record.time if is_timed(record) else None
    if time is not None and (said := too_quick(time)):
        raise InputError(f"{said}; times are in s, so name their unit, as in the heading time [d]")
    number = np.empty(len(record), dtype=np.int64)
    number[order_of_measuring(record)] = np.arange(1, len(record) + 1)
    steps = np.asarray(number - 1, dtype=np.float64)
    return number, steps * SECONDS_PER_READING if time is None else time - np.min(time)


def order_of_measuring(record: TumbleRecord) -> Ints:
    """Indices of the readings as they follow one another, whatever the order of their rows.

    Rows that agree in time, run, mounting, stroke and angle are taken as they come.
    """
    travel = np.where(record.stroke % 2 == 1, record.angle, -record.angle)
    by_layout = (travel, record.stroke, record.mounting, record.run)
    by_time = (record.time,) if is_timed(record) else ()
    return np.lexsort((*by_layout, *by_time))


def is_timed(record: TumbleRecord) -> bool:
    """Whether the time of each reading is known."""
    return record.time is not None and bool(np.isfinite(record.time).all())


def _since_start_of_run(run: Ints, time: Array) -> Array:
    start = np.full(run.max() + 1, np.inf)
    np.minimum.at(start, run, time)
    return time - start[run]


def _heating(run: Ints, excess: Array) -> Array:
    """Sense of the last change of level before each run."""
    heating = np.zeros(run.size)
    sense, before = 0.0, None
    for index in np.unique(run):
        level = excess[run == index].mean()
        if before is not None and abs(level - before) >= LEVEL_CHANGE:
            sense = np.sign(level - before)
        heating[run == index] = sense
        before = level
    return heating
