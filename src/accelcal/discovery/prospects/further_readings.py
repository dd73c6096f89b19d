"""Further readings that a laboratory could take: the menu, and how they join a record."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arguments.temperatures import HIGHEST, LOWEST
from accelcal.arrays import Array
from accelcal.effects.conditions import LEVEL_CHANGE, SECONDS_PER_READING
from accelcal.head_angles import head_positions, turn_angles
from accelcal.numerics.grouping import distinct, median
from accelcal.record import TumbleRecord
from accelcal.simulation import NOISE_FREE, TumblePlan, simulate

STROKES = 2
"""Strokes in a run of a block: one forward, one back."""

_SECONDS_BETWEEN_RUNS = 3600.0
_RANGE = 60.0
"""How far levels go from T0 on a side where a record has none [degC]."""


class Block(NamedTuple):
    """Readings that are taken together."""

    id: str  # name of the entry of the menu
    action: str  # what is measured, to follow "measure"
    plan: TumblePlan
    """How; its angles are those of the input axis, that is head angle plus `clocking`."""
    clocking: float = 0.0
    """How far the unit is turned in its clamp on the head [deg]. A record cannot tell it: readings
    of a turned unit join one at the angle of the input axis."""


def menu(record: TumbleRecord, reference_temperature: float) -> tuple[Block, ...]:
    """List what could be measured next; a single level is that of the record nearest to T0."""
    levels = _levels(record, reference_temperature)
    here = min(levels, key=lambda level: abs(level - reference_temperature))
    at = f" at {here:g} degC" if len(set(levels)) > 1 else ""
    plan = replace(_plan_of(record), temperatures=(here,), strokes=STROKES)
    strokes, angles = int(record.stroke.max()), np.array(plan.angles)
    again = replace(plan, temperatures=tuple(levels), strokes=strokes)
    longer = replace(plan, strokes=2 * strokes)
    heads = distinct(head_positions(angles))
    half = median(np.diff(np.append(heads, heads[0] + 360.0))) / 2.0
    every = distinct(np.concatenate([angles, angles[angles < angles.max()] + half]))
    axis, side = plan.mountings[-1][0], plan.mountings[-1][1]
    turned_over, other = axis + "+-"[side == "+"], "op"[axis == "o"] + side

    def block(name: str, how: str, own: TumblePlan, clocking: float = 0.0) -> Block:
        return Block(name, f"2 strokes{at} {how}", own, clocking)

    def positions(own: Array) -> TumblePlan:
        return replace(plan, angles=tuple(own.tolist()))

    old = f"at positions {half:g} deg apart from the old ones"
    finer = f"at the old positions and those {half:g} deg on"
    clocked = "with the unit turned by 90 deg in its clamp on the head"
    over = f"with the unit turned by 180 deg about its input axis, mounting {turned_over}"
    across = f"with the other cross axis in the rotation plane, mounting {other}"
    return (
        Block("same-test", "the same test again", again),
        Block("longer-run", f"a run of {2 * strokes} strokes{at}", longer),
        block("offset-positions", old, positions(angles + half)),
        block("finer-positions", finer, positions(every)),
        block("30-deg-positions", "at positions 30 deg apart", positions(turn_angles(12))),
        block("re-clocked", clocked, positions(angles + 90.0), 90.0),
        block("reversed-mounting", over, replace(plan, mountings=(turned_over,))),
        block("other-axis", across, replace(plan, mountings=(other,))),
        *_temperatures(plan, levels, reference_temperature),
    )


def _temperatures(plan: TumblePlan, visited: list[float], reference: float) -> Iterator[Block]:
    low, *above = sorted(set(visited))
    if above:
        start = [] if visited[-1] == low else [low]
        loop = [*start, *above, *reversed(above[:-1])]
        yield _at_levels("other-sense", "levels met both by heating and by cooling", plan, loop)
    down = _span(reference - low) / 3.0
    up = _span(max(visited) - reference) / 3.0
    steps = np.array([-2.0 * down, -down, up, 2.0 * up])
    more = distinct(np.clip(reference + steps, LOWEST, HIGHEST))
    yield _at_levels("more-levels", "two more levels on either side of T0", plan, more.tolist())


def _span(given: float) -> float:
    return given if given >= LEVEL_CHANGE else _RANGE


def _at_levels(name: str, which: str, plan: TumblePlan, levels: list[float]) -> Block:
    rounded = tuple(round(level, 1) for level in levels)
    listed = ", ".join(f"{level:g}" for level in rounded)
    return Block(name, f"2 strokes at {listed} degC, {which}", replace(plan, temperatures=rounded))


def _levels(record: TumbleRecord, unknown: float) -> list[float]:
    """Level of each run in the mounting of the last one, in order [degC]."""
    last = record.mounting[record.run == record.run.max()][0]
    runs = distinct(record.run[record.mounting == last]).tolist()
    levels = [record.select(record.run == run).mean_temperature for run in runs]
    return [unknown if np.isnan(level) else round(level, 1) for level in levels]


def _plan_of(record: TumbleRecord) -> TumblePlan:
    """Positions, mounting and pace of a record."""
    pace, pause = _pace(record)
    return TumblePlan(
        angles=tuple(distinct(np.round(record.angle, 6)).tolist()),
        mountings=(str(record.mounting[record.run == record.run.max()][0]),),
        seconds_per_reading=pace,
        seconds_between_runs=pause,
        timed=record.time is not None,
    )


def _pace(record: TumbleRecord) -> tuple[float, float]:
    """Time from reading to reading, and what comes on top of it between runs [s]."""
    if record.time is None:
        return SECONDS_PER_READING, _SECONDS_BETWEEN_RUNS
    order = np.argsort(record.time)
    steps, run = np.diff(record.time[order]), record.run[order]
    within = steps[(run[1:] == run[:-1]) & (steps > 0.0)]
    between = steps[run[1:] != run[:-1]]
    pace = median(within) if within.size else SECONDS_PER_READING
    pause = max(median(between) - pace, 0.0) if between.size else _SECONDS_BETWEEN_RUNS
    return pace, pause


def blank(block: Block, record: TumbleRecord) -> TumbleRecord:
    """Form of the readings of a block that are to join a record, with no outputs of worth."""
    form = simulate(plan=block.plan, noise=NOISE_FREE, seed=0, declare=False)
    return replace(
        form,
        serial=record.serial,
        unit=record.unit,
        reference_temperature=record.reference_temperature,
        apparatus=record.apparatus,
        metadata=record.metadata,
    )


def joined(first: TumbleRecord, second: TumbleRecord) -> TumbleRecord:
    """Add the readings of a later test of the same accelerometer on the same stand.

    What is declared is that of the first. The runs are numbered, and the clock of the second
    starts one pause between runs after the first one.
    """
    numbered = first.positions == second.positions
    both: dict[str, Any] = {
        name: _appended(getattr(first, name), getattr(second, name))
        for name in ("output", "angle", "temperature", "stroke", "mounting", "std", "count")
    }
    return replace(
        first,
        **both,
        run=np.concatenate([first.run, second.run + len(first.run_labels)]),
        run_labels=tuple(map(str, range(1, 1 + len(first.run_labels + second.run_labels)))),
        position=np.concatenate([first.position, second.position * numbered]),
        time=_appended(first.time, _clock(first, second)),
        line=None,
    )


def _appended(one: NDArray[Any] | None, other: NDArray[Any] | None) -> NDArray[Any] | None:
    return None if one is None or other is None else np.asarray(np.concatenate([one, other]))


def _clock(first: TumbleRecord, second: TumbleRecord) -> Array | None:
    if first.time is None or second.time is None:
        return None
    start = float(first.time.max()) + sum(_pace(first))
    return np.asarray(second.time - second.time.min() + start)
