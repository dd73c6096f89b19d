"""The clock of a test: when each reading is taken, and from where the head comes to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hidden.design import Design, Floats, Ints, Sequence

APPROACH = -1  # stands before the first reading of a run, and is not read


@dataclass(frozen=True, eq=False)
class Session:
    """All stops of the head in order: the readings, and an unread approach before each run.

    The head comes to the first position of a run forwards, from one position before it. Arrays
    have shape (m,), m being the number of readings plus that of runs.

    Attributes
    ----------
    design : Design
        The plan.
    read : ndarray of int, shape (n,)
        Stops at which a reading is taken.
    run, stroke, position : ndarray of int
        From 1; the approach belongs to the stroke behind it.
    angle : ndarray
        To which the head is driven, not wrapped [rad].
    sense : ndarray
        Of rotation: 1 forward, -1 back.
    level : ndarray
        Of the chamber [degC].
    time : ndarray
        From the first reading of the test [s].
    in_run : ndarray
        From the first reading of the run [s].
    vibration : ndarray
        Momentary angles of a head that shakes by 1 rad rms [rad].
    """

    design: Design
    read: Ints
    run: Ints
    stroke: Ints
    position: Ints
    angle: Floats
    sense: Floats
    level: Floats
    time: Floats
    in_run: Floats
    vibration: Floats

    @property
    def cycle(self) -> Ints:
        """Of a forward and a back stroke, from 1 in each run."""
        return (self.stroke + 1) // 2

    @property
    def run_length(self) -> float:
        """Mean time from the first to the last reading of a run [s]."""
        ends = np.flatnonzero(np.diff(self.run, append=-1))
        return float(self.in_run[ends].mean())


def session(design: Design, rng: np.random.Generator) -> Session:
    """Drive a plan by the clock: every dwell, turn and soak takes its own time."""
    plan = design.sequence
    stops = _stops(plan)
    first = stops == APPROACH
    row = np.where(first, np.roll(stops, -1), stops)
    angle = plan.angle[row] - first * (360.0 / design.positions)
    time, in_run = _times(angle, first, rng)
    return Session(
        design=design,
        read=np.flatnonzero(~first),
        run=plan.run[row],
        stroke=plan.stroke[row],
        position=np.where(first, design.positions, plan.position[row]),
        angle=np.deg2rad(angle),
        sense=plan.sense[row],
        level=plan.level[row],
        time=time,
        in_run=in_run,
        vibration=rng.standard_normal(len(row)),
    )


def _stops(plan: Sequence) -> Ints:
    starts = np.flatnonzero(np.diff(plan.run, prepend=0))
    return np.insert(np.arange(len(plan.run)), starts, APPROACH)


def _times(angle: Floats, first: np.ndarray, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Time of each stop, and since the first reading of its run [s]."""
    dwell, per_degree = rng.uniform(20.0, 60.0), rng.uniform(0.2, 0.6)
    soak = rng.uniform(5400.0, 10800.0) * rng.uniform(0.9, 1.1, len(angle))
    turned = np.abs(np.diff(angle, prepend=angle[0]))
    took = (dwell + per_degree * turned) * rng.uniform(0.95, 1.05, len(angle))
    clock = np.cumsum(np.where(first, soak, took))
    starts = clock[np.flatnonzero(first) + 1]
    return clock - starts[0], clock - starts[np.cumsum(first) - 1]
