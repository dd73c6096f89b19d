"""Readings whose temperature nobody wrote down: what a search may take for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from accelcal.errors import InputError
from accelcal.numerics.sorting import distinct
from accelcal.plural import counted
from accelcal.record import TumbleRecord

_OF_THE_RUN = (
    "without temperature counts as at the mean of its run",
    "without temperature count as at the mean of their run",
)
_AT_ONE = "no temperature is known: all runs count as at one, and those at others would disagree"


def with_temperatures_of_runs(record: TumbleRecord) -> TumbleRecord:
    """Give readings of unknown temperature the mean of the known ones of their run.

    Parameters
    ----------
    record : TumbleRecord
        The readings.

    Returns
    -------
    TumbleRecord
        The same, with a note that tells of it; the very same record where all temperatures are
        known, or none is.

    Raises
    ------
    InputError
        If a run has no temperature and others have, as its place among their levels is open.

    Examples
    --------
    >>> import accelcal
    >>> record = accelcal.simulate(seed=1)
    >>> with_temperatures_of_runs(record) is record
    True
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
