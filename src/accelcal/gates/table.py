"""All gates of tables of one plan."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial

from accelcal.gates.drift import drift
from accelcal.gates.order import order_of_positions
from accelcal.gates.replicates import closure, forward_against_back, outlier
from accelcal.gates.resolution import resolution
from accelcal.gates.sizes import proportions, units
from accelcal.gates.stack import TableStack
from accelcal.gates.verdict import SIGNIFICANT, GateStack


def gates_of_stack(stack: TableStack, tables: int = 1) -> tuple[GateStack, ...]:
    """Check T tables of one plan.

    The tables of the record of each share the false alarms of each gate.
    """
    level = SIGNIFICANT / tables
    gates: tuple[Callable[[TableStack], GateStack], ...] = (
        partial(closure, level=level),
        partial(drift, level=level),
        partial(forward_against_back, level=level),
        order_of_positions,
        partial(outlier, level=level),
        proportions,
        resolution,
        units,
    )
    return tuple(_checked(gate, stack) for gate in gates)


def _checked(gate: Callable[[TableStack], GateStack], stack: TableStack) -> GateStack:
    """Check the tables by one gate; those with gaps of which it may warn are looked at alone."""
    found, alone = gate(stack), stack.alone
    if alone is None:
        return found
    at = cache(lambda index: gate(alone(index)))
    for index in found.warned():
        found.verdict[index] = at(index).verdict[0]
    return found._replace(finding=lambda index: at(index).finding(0))
