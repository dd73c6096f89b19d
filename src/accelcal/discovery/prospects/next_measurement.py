"""What to measure next: the readings that would tell apart what the present ones cannot.

For each entry of a menu the readings are foreseen, and with them how far the best explanation
would be from each of its rivals, the rival and the base model being fitted as well as they can
(T-optimality).
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.instance import Instance, amplitude_columns, column_of, columns_of
from accelcal.discovery.prospects.further_readings import Block
from accelcal.discovery.prospects.outlook import Outlook
from accelcal.discovery.untold import scales, smooth
from accelcal.effects.conditions import Conditions

Instances = Sequence[Instance]

ENOUGH = 6.0
"""Noncentrality at which a name is right in nearly all cases."""

MOST = 64
"""Blocks that are worth while."""

_STEP = 0.01
"""Step of a nonlinear parameter for a derivative, in the range searched or in a time constant."""


class Proposal(NamedTuple):
    """A measurement that would tell explanations apart."""

    block: Block  # what is measured
    separation: tuple[float, ...]
    """Noncentrality of the best explanation beside each rival, after one block."""
    blocks: int | None
    """Blocks after which it is `ENOUGH` beside each rival; None where `MOST` are too few."""
    readings: int | None  # readings of these blocks
    hours: float | None  # time that they take
    text: str  # the proposal in a line


def proposals(
    comparison: Comparison,
    foreseen: Sequence[Outlook],
    best: Instances,
    rivals: Sequence[Instances],
) -> tuple[Proposal, ...]:
    """Rank the menu by what it takes to tell the best explanation from all its rivals.

    First comes what takes the least time, or the fewest readings where the record tells no times;
    what would not tell them apart comes last. There are none without rivals.

    Notes
    -----
    The best explanation has the sizes that fit the record. A rival is fitted with all its
    amplitudes and smooth nonlinear parameters; a number of a reading or of a position stays as the
    record has it.
    """
    if not rivals:
        return ()
    names = _names(best), ", ".join(_names(rival) for rival in rivals)
    c, space = comparison.model.conditions, comparison.space
    columns = space.see(columns_of(best, c))
    sizes = np.asarray(np.linalg.lstsq(columns, comparison.seen, rcond=None)[0])
    found = [_proposal(outlook, best, sizes, rivals, names) for outlook in foreseen]
    return tuple(sorted(found, key=_cost))


def _cost(proposal: Proposal) -> tuple[float, float]:
    if proposal.readings is None:
        return np.inf, -min(proposal.separation)
    return proposal.readings if proposal.hours is None else proposal.hours, 0.0


def _names(instances: Instances) -> str:
    return " + ".join(sorted(item.effect.id for item in instances))


def _proposal(
    outlook: Outlook,
    best: Instances,
    sizes: Array,
    rivals: Sequence[Instances],
    names: tuple[str, str],
) -> Proposal:
    c = outlook.conditions
    apart = sum(size * column_of(item, c) for item, size in zip(best, sizes, strict=True))
    beside = [outlook.beside(_span(rival, c), np.asarray(apart)[:, None]) for rival in rivals]

    def hardest(number: int) -> float:
        return min(float(left.lengths(number)[0]) for left in beside)

    fewer = bisect_left(range(1, MOST + 1), ENOUGH, key=hardest)
    blocks = fewer + 1 if fewer < MOST else None
    return Proposal(
        block=outlook.block,
        separation=tuple(float(left.lengths(1)[0]) for left in beside),
        blocks=blocks,
        readings=None if blocks is None else blocks * outlook.readings,
        hours=None if blocks is None or outlook.hours is None else blocks * outlook.hours,
        text=_text(outlook, blocks, names),
    )


def _text(outlook: Outlook, blocks: int | None, names: tuple[str, str]) -> str:
    action = outlook.block.action
    if blocks is None:
        return f"{MOST} times {action} would not tell {names[0]} from {names[1]}"
    times = f"{blocks} times " if blocks > 1 else ""
    readings = blocks * outlook.readings
    return f"measure {times}{action}: {readings} readings tell {names[0]} from {names[1]}"


def _span(instances: Instances, c: Conditions) -> Array:
    """All that some effects can do near where they fit: amplitudes, and nonlinear parameters."""
    columns = [np.empty((c.input.size, 0))]
    for item in instances:
        columns.append(amplitude_columns(item, c))
        for parameter in smooth(item.effect):
            value = item.shape[parameter.name]
            is_scale = parameter in scales(item.effect)
            step = _STEP * (value if is_scale else float(np.ptp(parameter.searched_at(c))))
            low = max(value - step, parameter.minimum)
            above, below = (column_of(item.at(parameter.name, at), c) for at in (value + step, low))
            columns.append((above - below)[:, None])
    return np.hstack(columns)
