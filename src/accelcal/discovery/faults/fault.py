"""What a fault of the readings is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from accelcal.effects.effect import Effect
from accelcal.record import TumbleRecord

SMALLEST = 1e-300
"""Smallest p-value told, and smallest error that is divided by."""


class Fault(NamedTuple):
    """A fault of the readings.

    Attributes
    ----------
    effect : Effect or None
        Entry of the catalogue; None for a wrong order or sign, which is none.
    finding : str
        Its name.
    parameters : mapping of str to (float, float, str)
        Value, standard uncertainty and unit of each parameter.
    p_value : float
        Chance of as much without the fault, over all readings that it was looked for in.
    readings : tuple of int
        Indices of the readings that it touches, in the record as given.
    text : str
        What, where, how sure, and the remedy, in a line.
    """

    effect: Effect | None
    finding: str
    parameters: Mapping[str, tuple[float, float, str]]
    p_value: float
    readings: tuple[int, ...]
    text: str


def of_run(record: TumbleRecord, reading: int) -> str:
    """Begin to say where a reading is: of which run, where there are several."""
    label = record.run_labels[record.run[reading]]
    return f"run {label}, " if len(record.run_labels) > 1 else ""
