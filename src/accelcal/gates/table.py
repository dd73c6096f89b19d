"""All gates of tables of one plan."""

from __future__ import annotations

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
    return (
        closure(stack, level),
        drift(stack, level),
        forward_against_back(stack, level),
        order_of_positions(stack),
        outlier(stack, level),
        proportions(stack),
        resolution(stack),
        units(stack),
    )
