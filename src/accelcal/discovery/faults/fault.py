"""How faults of the readings are told."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from accelcal.effects.catalogue import effect
from accelcal.record import TumbleRecord
from accelcal.results.findings import WRONG_ORDER, Fault
from accelcal.results.quantity import Quantity

SMALLEST = 1e-300
"""Smallest p-value told, and smallest error that is divided by."""


def entry_fault(
    name: str,
    finding: str,
    parameters: Mapping[str, Quantity],
    chance: float,
    readings: Sequence[int] = (),
) -> Fault:
    """Tell a fault that the catalogue of effects has an entry for, by its id."""
    p_value = max(chance, SMALLEST)
    return Fault(name, effect(name).name, finding, parameters, p_value, tuple(readings))


def order_fault(
    name: str,
    finding: str,
    parameters: Mapping[str, Quantity],
    chance: float,
    readings: Sequence[int],
) -> Fault:
    """Tell a fault of the order, the sign or the mounting, which is no entry of the catalogue."""
    p_value = max(chance, SMALLEST)
    return Fault(WRONG_ORDER, name, finding, parameters, p_value, tuple(readings))


def of_run(record: TumbleRecord, reading: int) -> str:
    """Begin to say where a reading is: of which run, where there are several."""
    label = record.run_labels[record.run[reading]]
    return f"run {label}, " if len(record.run_labels) > 1 else ""
