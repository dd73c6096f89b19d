"""Readings that stand at the end of a range: several have the largest output, or the least."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.gates.copies import NO_CHANCE, chance_of_agreement
from accelcal.gates.stack import TableStack
from accelcal.numerics.decimal_steps import decimal_step

_FEWEST = 4  # readings that are equal
_FINE = 0.2  # chance that two agree: coarser ones leave readings of less noise equal as well


class RangeEnd(NamedTuple):
    """The largest or the least output, and how many readings have it."""

    word: str
    output: float
    readings: int

    def said(self, unit: str) -> str:
        """Say so, with what it may mean and the remedy."""
        return (
            f"{self.readings} readings have the {self.word} output, {self.output:.9g} {unit}, to"
            " the last digit: the range seems to end there; use a wider one"
        )


def range_ends(stack: TableStack, step: Array) -> dict[int, RangeEnd]:
    """Find tables of which several readings are equal at the end of the range.

    Parameters
    ----------
    stack : TableStack
        The tables.
    step : ndarray, shape (T,)
        Steps of their readings, 0 where there is none [output unit].

    Returns
    -------
    dict of int to RangeEnd
        Tables with such readings.

    Notes
    -----
    Of others m agree with one by the m-th power of the chance that two do, for each choice of m
    among those at the positions of the equal ones. The noise is that at the other end, as it may
    be smaller at the ends than between them; the step is no finer than the digits of the reading,
    as numbers of so many digits have coarser ones where they are larger.
    """
    high, low = stack.output.max(axis=0), stack.output.min(axis=0)
    found: dict[int, RangeEnd] = {}
    for word, end, other in (("largest", high, low), ("least", low, high)):
        equal = stack.output == end
        number = equal.sum(axis=0)
        for table in np.flatnonzero(number >= _FEWEST).tolist():
            far = stack.output[:, table] == other[table]
            if _is_no_chance(stack, table, equal[:, table], far, float(step[table])):
                found.setdefault(table, RangeEnd(word, float(end[table]), int(number[table])))
    return found


def _is_no_chance(stack: TableStack, table: int, equal: Mask, far: Mask, step: float) -> bool:
    """Tell whether equal readings of a table are so by more than chance."""
    head, output = stack.plan.head, stack.output[:, table]
    noise, there = float(stack.noise[table] * stack.scatter[table]), output[head == head[far][0]]
    if there.size > 1:
        noise = min(noise, float(np.std(there, ddof=1)))
    smallest = float(np.spacing(np.abs(output).max()))
    written = max(step, decimal_step(output[equal][:1]))
    share = chance_of_agreement(written, noise, smallest)
    others, near = int(equal.sum()) - 1, int(np.isin(head, head[equal]).sum())
    return share < _FINE and math.comb(near - 1, others) * share**others < NO_CHANCE
