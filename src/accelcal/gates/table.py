"""All gates of the tables of a record, and of many tables of one plan."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.noise import ReadingNoise
from accelcal.estimate.tables import PreparedTable
from accelcal.gates.drift import drift
from accelcal.gates.order import order_of_positions
from accelcal.gates.replicates import closure, forward_against_back, outlier
from accelcal.gates.resolution import resolution
from accelcal.gates.sizes import proportions, units
from accelcal.gates.stack import TableStack, of_one_plan
from accelcal.gates.verdict import SIGNIFICANT, GateStack
from accelcal.results.quantity import Gate

__all__ = ["gates_of_stack", "gates_of_tables"]


def gates_of_stack(stack: TableStack, tables: int = 1) -> tuple[GateStack, ...]:
    """Check tables of one plan.

    Parameters
    ----------
    stack : TableStack
        The T tables.
    tables : int, default 1
        Tables of the record of each, which share the false alarms of each gate.

    Returns
    -------
    tuple of GateStack
        Closure, drift, forward against back, order of positions, outlier, proportions,
        resolution, units, each for all T tables.
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


def gates_of_tables(
    tables: Sequence[PreparedTable],
    coefficients: Sequence[NDArray[np.float64]],
    noises: Sequence[ReadingNoise],
    delta0: float = 0.0,
) -> list[tuple[Gate, ...]]:
    """Check all tables of a record, those of one plan together.

    Parameters
    ----------
    tables : sequence of PreparedTable
        The tables, which share the false alarms of each gate.
    coefficients : sequence of ndarray, shape (6,)
        Their least-squares coefficients, zero where not estimated [output unit / g^n].
    noises : sequence of ReadingNoise
        Their reading noise.
    delta0 : float, default 0
        Fixture angle of the fit [rad].

    Returns
    -------
    list of tuple of Gate
        The gates of each table, see `gates_of_stack`.
    """
    found: dict[int, tuple[Gate, ...]] = {}
    for places in of_one_plan(tables):
        own, k = [tables[i] for i in places], [coefficients[i] for i in places]
        stack = TableStack.of(own, k, [noises[i] for i in places], delta0)
        gates = gates_of_stack(stack, len(tables))
        found |= {place: tuple(g.gate(i) for g in gates) for i, place in enumerate(places)}
    return [found[place] for place in range(len(tables))]
