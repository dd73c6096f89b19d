"""Wide tables whose columns are positions and whose rows are strokes, though headed otherwise."""

from __future__ import annotations

import numpy as np

from accelcal.arguments.kinds import shown
from accelcal.arrays import Array, Ints
from accelcal.errors import TableError
from accelcal.io.columns import Table
from accelcal.io.readings import Readings

_ALONG, _DOWN = 0.5, 0.25
"""Parts of the span of all outputs: more than the one along a row, less than the other down it."""


def refuse_swapped(table: Table, readings: Readings) -> None:
    """Refuse numbered columns of strokes that differ as positions do, while the rows do not.

    Raises
    ------
    TableError
        If outputs of one position span most of all outputs, and those of one column a small part.
    """
    across = table.across
    numbered = [own.heading for own in table.outputs if own.heading[:1].isdigit()]
    if across is None or across.role != "stroke" or len(numbered) < len(table.outputs):
        return
    span = float(np.ptp(readings.output))
    along = _spread(readings.output, readings.line) / span if span else 0.0
    if along < _ALONG or span < _DOWN * np.abs(readings.output).max():
        return  # readings of one position differ by noise alone
    if _spread(readings.output, readings.stroke) < _DOWN * span:
        problem = (
            f"columns {shown(', '.join(numbered))} differ as positions do, and rows as strokes"
        )
        remedy = "call the first column stroke, or these Y1, Y2, ... if they are strokes indeed"
        line = int(across.lines[0])
        raise TableError(problem, remedy, source=readings.source, line=line)


def _spread(output: Array, group: Ints) -> float:
    """Median of the spans of the outputs of each group."""
    groups, index = np.unique(group, return_inverse=True)
    top, low = np.full(groups.size, -np.inf), np.full(groups.size, np.inf)
    np.maximum.at(top, index, output)
    np.minimum.at(low, index, output)
    return float(np.median(top - low))
