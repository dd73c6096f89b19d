"""A record as a search takes it: in one clamping, with temperatures, at its positions, in order."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from accelcal.effects.conditions import order_of_measuring
from accelcal.errors import InputError
from accelcal.estimate.at_positions import at_positions
from accelcal.head_angles import head_positions
from accelcal.numerics.sorting import distinct
from accelcal.plural import counted, listed
from accelcal.record import TumbleRecord

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
