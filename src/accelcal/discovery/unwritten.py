"""What nobody wrote down in a record: temperatures, the order, how long pauses between runs were.

A search takes a record in one clamping, with temperatures, at its positions, in order. Effects may
go on between runs, where no times tell how long that was.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain

import numpy as np

from accelcal.arrays import Array, Places
from accelcal.discovery.columns import dummies
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.explanation import chance_beside
from accelcal.discovery.instance import (
    Instance,
    all_own_columns,
    amplitude_columns,
    contributions,
    instance_of,
)
from accelcal.discovery.untold import fitted_sizes
from accelcal.effects.conditions import Conditions, is_timed, order_of_measuring
from accelcal.effects.effect import Disturbance
from accelcal.effects.found import disturbances
from accelcal.errors import InputError
from accelcal.estimate.at_positions import at_positions
from accelcal.head_angles import head_positions
from accelcal.numerics.grouping import distinct
from accelcal.plural import counted, listed
from accelcal.record import TumbleRecord
from accelcal.results.findings import FoundEffect
from accelcal.units import HOUR

_OF_THE_RUN = (
    "without temperature counts as at the mean of its run",
    "without temperature count as at the mean of their run",
)
_AT_ONE = "no temperature is known: all runs count as at one, and those at others would disagree"


def as_searched(record: TumbleRecord, delta0: float | None) -> TumbleRecord:
    """Bring a record to what a search takes, with the fixture angle [rad] if another is meant.

    Raises
    ------
    InputError
        If it is of several clampings, or a run has no temperature and others have.
    """
    refuse_several_clampings(record)
    record = at_positions(with_temperatures_of_runs(record), delta0)
    order = order_of_measuring(record)  # so that noise is drawn alike for any other
    return record if (np.diff(order) > 0).all() else record.taken(order)


def refuse_several_clampings(record: TumbleRecord) -> None:
    """Refuse a record whose fixture was clamped at more than one angle.

    The errors of the head and the misalignment are the same in all runs of a search; from one
    clamping to the next both are others, and would look like a missing effect.
    """
    met = [] if record.clamping is None else distinct(head_positions(record.clamping)).tolist()
    if len(met) > 1:
        raise InputError(
            f"{record.source}: clampings at {listed(f'{angle:g}' for angle in met)} deg; head"
            " errors and misalignment differ from one to the next, so give the runs of one clamping"
            " in a file of their own (fit and head take all of them)"
        )


def with_temperatures_of_runs(record: TumbleRecord) -> TumbleRecord:
    """Give readings of unknown temperature the mean of the known ones of their run.

    A note tells of it. It is the very same record where all temperatures are known, or none is.

    Raises
    ------
    InputError
        If a run has no temperature and others have, as its place among their levels is open.
    """
    unknown = np.isnan(record.temperature)
    if not unknown.any() or unknown.all():
        return record
    temperature = record.temperature.copy()
    for run in distinct(record.run[unknown]).tolist():
        own = record.run == run
        if unknown[own].all():
            raise InputError(
                f"run {record.run_labels[run]} has no temperature, and others have; write it, or"
                " leave the run out"
            )
        temperature[own & unknown] = record.temperature[own & ~unknown].mean()
    number = int(unknown.sum())
    note = f"{counted(number, 'reading')} {_OF_THE_RUN[number > 1]}"
    return replace(record, temperature=temperature, notes=(*record.notes, note))


def said_of_temperatures(record: TumbleRecord) -> list[str]:
    """Say what was taken for temperatures that nobody wrote down."""
    if len(record.run_labels) > 1 and np.isnan(record.temperature).all():
        return [_AT_ONE]
    return [note for note in record.notes if note.endswith(_OF_THE_RUN)]


_HOURS = 24

_DENIED = 1e-3
"""Chance of noise below which the readings deny that there were no pauses."""


def shows_pauses(comparison: Comparison, effects: Sequence[Instance] = ()) -> bool:
    """Whether runs of a record without times differ by more than noise and some effects."""
    if is_timed(comparison.record):
        return False
    c, space = comparison.model.conditions, comparison.space
    runs, tables = dummies(c.run), dummies(c.run, comparison.record.mounting)
    moved = np.hstack([runs, runs * c.indicated[:, None], tables * c.cross[:, None]])
    free, shown = space.shown(c.gain[:, None] * moved)
    return chance_beside(comparison, free[:, shown], comparison.span(effects)) < _DENIED


def shows_going_on(comparison: Comparison, effects: Sequence[Instance]) -> bool:
    """Whether a record without times denies that effects stood still between its runs."""
    moving = going_on(comparison.model.conditions, effects)
    return bool(moving) and shows_pauses(comparison, effects)


def in_pauses(
    comparison: Comparison,
    explanations: Sequence[Sequence[Instance]],
    held: Sequence[Disturbance],
) -> tuple[Array, tuple[str, ...]]:
    """Tell what effects may do in the pauses between runs, where no times tell these.

    Their sizes are fitted in one or several sets, but for those that are held. Returned are the
    errors of the n readings by each set if there are no pauses, shape (n, k) [g], whose sum of
    squares is the mean square over pauses of up to a day, and what a reader must know of it.
    """
    c = comparison.model.conditions
    names = {place: going_on(c, own, held) for place, own in enumerate(explanations)}
    acting = [explanations[place] for place, own in names.items() if own]
    if is_timed(comparison.record) or not acting:
        return np.empty((len(comparison.record), 0)), ()
    columns = [
        _taken(comparison, effects, held, later) - _taken(comparison, effects, held, 0.0)
        for effects in acting
        for later in _delays(c)
    ]
    own = listed(dict.fromkeys(chain(*names.values())))
    said = (
        f"no times: {own} may go on between the runs, and nothing tells how long: taken"
        " out as if there were no pauses, and U counts each as any up to a day; give the readings a"
        " column time"
    )
    return np.stack(columns, axis=1) / np.sqrt(_HOURS), (said,)


def simulated_in_pauses(
    record: TumbleRecord, c: Conditions, effects: Sequence[FoundEffect]
) -> tuple[Array, tuple[str, ...]]:
    """Tell the same of effects that a calibration simulates for the conditions of a record."""
    held = disturbances(effects)
    names = () if is_timed(record) else going_on(c, (), held)
    if not names:
        return np.empty((len(record), 0)), ()
    now = contributions(held, c)
    columns = [contributions(held, replace(c, time=c.time + later)) - now for later in _delays(c)]
    said = (
        f"no times: {listed(names)} may go on between the runs of the record, and nothing tells how"
        " long: each pause counts as any up to a day; give the readings a column time"
    )
    return np.stack(columns, axis=1) / np.sqrt(_HOURS), (said,)


def _delays(c: Conditions) -> Iterator[Array]:
    """How much later each reading is [s], by pauses of up to a day that are drawn."""
    place = _place(c)
    hours = np.tile(np.arange(_HOURS) + 0.5, (place.max() + 1, 1))
    hours[0] = 0.0
    starts = HOUR * np.cumsum(np.random.default_rng(0).permuted(hours, axis=1), axis=0)
    yield from starts[place].T


def by_pauses(comparison: Comparison, effects: Sequence[Instance]) -> Array:
    """What each pause between runs that no times tell may do to effects [g], shape (n, k)."""
    c = comparison.model.conditions
    place, columns = _place(c), [np.empty((c.angle.size, 0))]
    for run in range(1, 1 if is_timed(comparison.record) else place.max() + 1):
        later = replace(c, time=c.time + HOUR * (place >= run))
        columns.append(all_own_columns(effects, later) - all_own_columns(effects, c))
    return np.hstack(columns)


def going_on(
    c: Conditions, instances: Sequence[Instance], held: Sequence[Disturbance] = ()
) -> list[str]:
    """Name the effects that act otherwise after pauses between the runs."""
    later = replace(c, time=c.time + HOUR * _place(c))
    every = (*instances, *map(instance_of, held))
    return [
        item.effect.id
        for item in every
        if np.any(amplitude_columns(item, later) != amplitude_columns(item, c))
    ]


def _place(c: Conditions) -> Places:
    """Number of runs before that of each reading."""
    return np.unique(c.run, return_inverse=True)[1]


def _taken(
    comparison: Comparison,
    effects: Sequence[Instance],
    held: Sequence[Disturbance],
    later: Array | float,
) -> Array:
    """What is taken out of readings that are later by so much [g]."""
    c = comparison.model.conditions
    c = replace(c, time=c.time + later)
    then = comparison._replace(model=replace(comparison.model, conditions=c))
    fitted = all_own_columns(effects, c) @ fitted_sizes(then, effects).whole
    return contributions(held, c) + fitted
