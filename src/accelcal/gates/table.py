"""All gates of one table, or of many tables of one plan."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

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

__all__ = ["gates_of_plan", "gates_of_stack", "gates_of_tables", "table_gates"]


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


def gates_of_plan(stacks: Sequence[TableStack]) -> list[tuple[GateStack, ...]]:
    """Check all tables of R records of one plan, those of one plan of readings together.

    Parameters
    ----------
    stacks : sequence of TableStack
        Each table in all R records, see `TableStack.of_records`. The tables of a record share the
        false alarms of each gate.

    Returns
    -------
    list of tuple of GateStack
        The gates of each table in all records, see `gates_of_stack`.
    """
    found: dict[int, tuple[GateStack, ...]] = {}
    for places in of_one_plan([stack.table for stack in stacks]):
        own = [stacks[place] for place in places]
        gates = gates_of_stack(TableStack.joined(own), len(stacks))
        ends = np.cumsum([0, *map(len, own)]).tolist()
        for place, span in zip(places, pairwise(ends), strict=True):
            found[place] = tuple(gate.part(*span) for gate in gates)
    return [found[place] for place in range(len(stacks))]


def gates_of_tables(
    tables: Sequence[PreparedTable],
    coefficients: Sequence[NDArray[np.float64]],
    noises: Sequence[ReadingNoise],
    delta0: float = 0.0,
) -> list[tuple[Gate, ...]]:
    """Check all tables of one record.

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
    stacks = [
        TableStack.of([table], [k], [noise], delta0)
        for table, k, noise in zip(tables, coefficients, noises, strict=True)
    ]
    return [tuple(gate.gate(0) for gate in gates) for gates in gates_of_plan(stacks)]


def table_gates(
    table: PreparedTable,
    coefficients: NDArray[np.float64],
    noise: ReadingNoise,
    delta0: float = 0.0,
    tables: int = 1,
) -> tuple[Gate, ...]:
    """Check one table.

    Parameters
    ----------
    table : PreparedTable
        The table.
    coefficients : ndarray, shape (6,)
        Its least-squares coefficients, zero where not estimated [output unit / g^n].
    noise : ReadingNoise
        Its reading noise.
    delta0 : float, default 0
        Fixture angle of the fit [rad].
    tables : int, default 1
        Tables of the record, which share the false alarms of each gate.

    Returns
    -------
    tuple of Gate
        See `gates_of_stack`.
    """
    stack = TableStack.of([table], [coefficients], [noise], delta0)
    return tuple(found.gate(0) for found in gates_of_stack(stack, tables))
