"""Effects of time and of history: what depends on when, and on what came before."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from itertools import pairwise

import numpy as np

from accelcal.arrays import Array, Places
from accelcal.effects.conditions import Conditions
from accelcal.effects.effect import Effect
from accelcal.effects.parameter import Parameter
from accelcal.errors import InputError
from accelcal.numerics.grouping import distinct
from accelcal.units import DAY, HOUR

_SHOWN_BY = 2
"""Readings on either side that a step within a run takes; one alone is an outlier."""

_APPROACH = 45.0
"""The head comes to the first position of a run from this far beside it [deg]."""

APPROACH, USUAL = "approach", 1.0
"""Parameter that tells how it comes there, and its value where nothing else is said."""

_NARROW, _WIDE = 1e-5, 1e-3
"""Half widths of a play, of which the second is far above what is at an extreme of a [g]."""

_AT_EXTREME, _FAR = 5e-6, 4e-3
"""So far behind an extreme of a, readings are at it, as with a tilt of 3 mrad, or far away [g]."""

_MUCH = 64.0
"""Times as wide as readings are behind an extreme, a play acts there as at the extreme."""

_SENSES = (0.0, -1.0, USUAL)
"""Senses in which it comes there, against or with the stroke; 0 where it is at rest there."""

_RUNS = 10.0
"""Time constants are searched to so many runs, in which a decay is all but straight."""


def _time_constants(c: Conditions) -> Array:
    """From half the interval between readings to ten longest runs, about two a factor of e."""
    intervals = np.diff(np.sort(c.time))
    intervals = intervals[intervals > 0.0]
    shortest = 0.5 * float(np.median(intervals)) if intervals.size else 1.0
    longest = _RUNS * max(float(c.run_time.max()), 2.0 * shortest)
    return np.geomspace(shortest, longest, 1 + math.ceil(2.0 * math.log(longest / shortest)))


def _first_run_alone(c: Conditions) -> Array:
    """A decay in the first run that the others do not have."""
    length = max(float(c.run_time.max()), 1.0)
    return np.where(c.run == c.run[c.order[0]], np.exp(-4.0 * c.run_time / length), 0.0)


def _curved(c: Conditions) -> Array:
    """Squares of the time in the record and in the run, shape (n, 2)."""
    return np.stack([c.time, c.run_time], axis=1) ** 2 / HOUR**2


def _moments(c: Conditions) -> Array:
    """First readings after a step that shows in some readings of a run, or lies between runs."""
    run = c.run[c.order]
    starts = np.flatnonzero(np.concatenate([[True], run[1:] != run[:-1], [True]]))
    place = np.arange(c.number.size)
    behind = place - starts[np.searchsorted(starts, place, side="right") - 1]
    ahead = starts[np.searchsorted(starts, place, side="right")] - place
    seen = (np.minimum(behind, ahead) >= _SHOWN_BY) | ((behind == 0) & (place > 0))
    return np.asarray(place[seen] + 1.0)


def _bias_step(c: Conditions, step: float, reading: float) -> Array:
    first = reading or c.number.size // 2 + 1
    if not 2 <= first <= c.number.size or first % 1:
        raise InputError(
            f"bias-step: reading is {reading:g}; the first reading after the step is a whole number"
            f" from 2 to {c.number.size}, or 0 for the middle"
        )
    return np.where(c.number >= first, step, 0.0)


def _play(c: Conditions, half_width: float, approach: float) -> Array:
    """Play operator on a along the way of the head in each run, readings or not."""
    if approach not in _SENSES:
        raise InputError(
            f"hysteresis: approach is {approach:g}; the head comes to the first position of a run"
            " in the sense of the stroke (1) or against it (-1), or is at rest there (0)"
        )
    lag = np.zeros(c.angle.size)
    for run in distinct(c.run).tolist():
        own = c.order[c.run[c.order] == run]
        passed = list(_passed(c, own, approach))
        state = passed[0][0]
        for index, values in zip(own, passed, strict=True):
            sensed = float(c.axial[index])
            for value in (*values, sensed):
                state = min(max(state, value - half_width), value + half_width)
            lag[index] = state - sensed
    return lag


def _passed(c: Conditions, own: Places, approach: float) -> Iterator[list[float]]:
    """Extremes of a that the head passes on its way to each reading of a run, in their order.

    It begins by coming to the first position. The stroke of a reading that is missing at either end
    of the turn goes there nevertheless.
    """
    ends = (float(c.angle.min()), float(c.angle.max()))
    wave = _wave(c.angle[own], c.axial[own])
    before: int | None = None
    for index in own.tolist():
        here, forward = float(c.angle[index]), c.stroke[index] % 2 == 1
        if before is None:
            way = [here - approach * (_APPROACH if forward else -_APPROACH), here]
        elif c.stroke[before] == c.stroke[index]:
            way = [float(c.angle[before]), here]
        else:
            ended, begun = ends[int(c.stroke[before] % 2 == 1)], ends[int(not forward)]
            way = [float(c.angle[before]), ended, begun, here]
        yield [value for start, end in pairwise(way) for value in _extremes(start, end, *wave)]
        before = index


def _wave(angle: Array, axial: Array) -> tuple[float, float]:
    """Amplitude of a in a turn [g], and head angle where it is largest [deg].

    What positions such as 90 and 270 deg alone do not tell of it is that of cos th.
    """
    turn = np.radians(angle)
    waves = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    beside = np.linalg.lstsq(waves, axial - waves[:, 0], rcond=None)[0]
    cosine, sine = (beside + np.array([1.0, 0.0])).tolist()
    return math.hypot(cosine, sine), math.degrees(math.atan2(sine, cosine))


def _usual_width(c: Conditions) -> float:
    """Half width that acts as others do: a wide one, if all readings are at extremes or far."""
    return _NARROW if _beside_extremes(c).size else _WIDE


def _widths(c: Conditions) -> Array:
    """Half widths that act unlike each other, by readings close behind an extreme of a."""
    behind = _beside_extremes(c)
    if not behind.size:
        return np.array([_WIDE])
    lowest, highest = 0.5 * float(behind.min()), _MUCH * float(behind.max())
    return np.geomspace(lowest, highest, 1 + math.ceil(4.0 * math.log2(highest / lowest)))


def _beside_extremes(c: Conditions) -> Array:
    """How far behind an extreme of a readings are that are neither at it nor far away [g]."""
    behind = []
    for run in distinct(c.run).tolist():
        own = c.run == run
        behind.append(_wave(c.angle[own], c.axial[own])[0] - np.abs(c.axial[own]))
    every = np.concatenate(behind)
    return every[(every > _AT_EXTREME) & (every < _FAR)]


@lru_cache(maxsize=4)  # a search asks for those of one record again and again
def _approaches(c: Conditions) -> Array:
    """Ways to come to the first position of each run that the readings can tell apart."""
    tried: dict[float, Array] = {}
    for sense in reversed(_SENSES):
        lag = _play(c, _NARROW, sense)
        if all(np.abs(lag - other).max() > 0.5 * _NARROW for other in tried.values()):
            tried[sense] = lag
    return np.sort(np.array(list(tried)))


@lru_cache(maxsize=1024)  # of a long test many turns are alike
def _extremes(start: float, end: float, amplitude: float, largest: float) -> tuple[float, ...]:
    """Values of a where a turn begins, and where it is extreme on its way [g]."""
    low, high = sorted((start - largest, end - largest))
    halves = range(math.floor(low / 180.0) + 1, math.ceil(high / 180.0))
    turned = [-amplitude if half % 2 else amplitude for half in halves]
    first = amplitude * math.cos(math.radians(start - largest))
    return (first, *(turned if start < end else turned[::-1]))


def _tilt(c: Conditions, rate: float, sine: float, cosine: float) -> Array:
    day = 2.0 * np.pi * c.time / DAY
    return rate * c.time / HOUR + sine * np.sin(day) + cosine * np.cos(day)


EFFECTS = (
    Effect(
        id="bias-drift",
        name="drift of the bias",
        physics="The bias changes linearly with time over the whole record.",
        formula="r t",
        signature="The closure Y9 - Y1 of each stroke has the sign of the stroke; k0 of the runs"
        " rises or falls.",
        to_tell_apart="times of the readings, and a longer record",
        parameters=(Parameter("rate", "g/h", "change of the bias with time"),),
        term=lambda c, rate: rate * c.time / HOUR,
        bend=_curved,
    ),
    Effect(
        id="scale-factor-drift",
        name="drift of the scale factor",
        physics="The scale factor changes linearly with time over the whole record.",
        formula="K1 (1 + r t)",
        signature="Residuals grow with time times a_i.",
        to_tell_apart="times of the readings, a longer record, and a log of what else multiplies"
        " everything: load resistor, voltmeter, room temperature",
        parameters=(Parameter("rate", "1/h", "relative change of the scale factor with time"),),
        term=lambda c, rate: rate * c.time / HOUR * c.indicated,
        bend=lambda c: _curved(c) * c.indicated[:, None],
    ),
    Effect(
        id="warm-up",
        name="warm-up of the bias",
        physics="From the start of each run the bias settles exponentially.",
        formula="A exp(-t / tau), t from the start of the run",
        signature="The first readings of each run lie on one side; k0 absorbs their mean. Nearly"
        " the same as a drift where tau is long.",
        to_tell_apart="a longer run, and readings at rest just after switching on",
        parameters=(
            Parameter("amplitude", "g", "excess A at the start of the run"),
            Parameter(
                "tau",
                "s",
                "time constant",
                default=600.0,
                minimum=1e-3,
                linear=False,
                search=_time_constants,
            ),
        ),
        term=lambda c, amplitude, tau: amplitude * np.exp(-c.run_time / tau),
        bend=_first_run_alone,
    ),
    Effect(
        id="bias-step",
        name="step of the bias",
        physics="The bias jumps once.",
        formula="s from one reading on",
        signature="Residuals change their level at one moment.",
        to_tell_apart="a repeated run: a step of the unit does not come back at the same moment",
        parameters=(
            Parameter("step", "g", "size of the jump"),
            Parameter(
                "reading",
                "1",
                "first reading after the jump, in the order of measuring; 0 is the middle",
                default=0.0,
                minimum=0.0,
                linear=False,
                search=_moments,
                discrete=True,
            ),
        ),
        term=_bias_step,
    ),
    Effect(
        id="stroke-offset",
        name="offset between forward and back strokes",
        physics="The output is higher on forward than on back strokes, by a constant.",
        formula="+c/2 forward, -c/2 back",
        signature="Forward minus back is the same at all positions.",
        to_tell_apart="strokes in another order, to exclude a drift",
        parameters=(Parameter("offset", "g", "forward minus back, c"),),
        term=lambda c, offset: 0.5 * offset * c.rotation,
    ),
    Effect(
        id="hysteresis",
        name="hysteresis of the sensor",
        physics="The output lags behind the input by a constant, after the sign of its last"
        " change.",
        formula="play operator of half width w on a = a_i + delta a_p",
        signature="Forward minus back goes with sign(sin th): its ratio at 45 and 90 deg is 1.",
        to_tell_apart="positions between 0 and 45 deg in both senses, where backlash falls with"
        " sin th",
        parameters=(
            Parameter(
                "half_width",
                "g",
                "half the width w of the play",
                minimum=0.0,
                small=_usual_width,
                sizes=_widths,
            ),
            Parameter(
                APPROACH,
                "1",
                "how the head comes to the first position of each run: in the sense of the stroke"
                " (1), against it (-1), or at rest there (0)",
                default=USUAL,
                minimum=-1.0,
                linear=False,
                search=_approaches,
                discrete=True,
            ),
        ),
        term=_play,
    ),
    Effect(
        id="foundation-tilt",
        name="tilt of the foundation",
        physics="The vertical moves in the frame of the head, linearly in time and daily.",
        formula="d th = r t + s sin(2 pi t / 24 h) + c cos(2 pi t / 24 h)",
        signature="delta of the strokes wanders with time, as sin th.",
        to_tell_apart="times of the readings, a record over a day, or level readings beside it",
        acts_on="angle",
        parameters=(
            Parameter("rate", "rad/h", "linear part"),
            Parameter("sine", "rad", "daily part in phase with sin, t from the first reading", 0.0),
            Parameter("cosine", "rad", "daily part in phase with cos", 0.0),
        ),
        term=_tilt,
    ),
)
