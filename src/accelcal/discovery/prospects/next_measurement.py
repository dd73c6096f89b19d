"""What to measure next: the readings that would tell apart what the present ones cannot.

For each entry of a menu the readings are foreseen, and with them how far the best explanation
would be from each of its rivals, the rival and the base model being fitted as well as they can
(T-optimality).

Errors of the head positions are unknowns with the declared uncertainty, so that old and new
readings at one position share them. All else is independent from run to run, so that further
blocks like the first add up; a shift that is free in each run counts as one in all of them.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from accelcal.apparatus import Apparatus
from accelcal.arrays import Array
from accelcal.discovery.base import BaseModel, base_model, solve, without_shifts
from accelcal.discovery.columns import head_columns, lengths, orthonormal, without
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.instance import Instance, amplitude_columns, column_of, columns_of
from accelcal.discovery.noise.of_readings import ReadingNoise, covariance
from accelcal.discovery.prospects.further_readings import Block, blank, joined, menu
from accelcal.discovery.space import Whitener, whitener_of
from accelcal.discovery.untold import scales, smooth
from accelcal.effects.conditions import Conditions, conditions_of
from accelcal.record import TumbleRecord
from accelcal.units import HOUR

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
    blocks: int  # blocks after which the noncentrality is `ENOUGH` beside each rival
    readings: int  # readings of these blocks
    hours: float | None  # time that they take; None where the record tells no times
    text: str  # the proposal in a line


def proposals(
    comparison: Comparison,
    foreseen: Sequence[Outlook],
    best: Instances,
    rivals: Sequence[Instances],
) -> list[Proposal]:
    """Rank what tells the best explanation from all its rivals by what it takes.

    First comes what takes the least time, or the fewest readings where the record tells no times,
    in the clamping of the record; then what turns the unit in its clamp.

    Notes
    -----
    The best explanation has the sizes that fit the record. A rival is fitted with all its
    amplitudes and smooth nonlinear parameters; a number of a reading or of a position stays as the
    record has it.
    """
    columns = comparison.space.see(columns_of(best, comparison.model.conditions))
    sizes = np.asarray(np.linalg.lstsq(columns, comparison.seen, rcond=None)[0])
    tried = [_proposal(outlook, best, sizes, rivals) for outlook in foreseen]
    return sorted(
        (one for one in tried if one is not None),
        key=lambda one: (one.block.clocking, one.readings if one.hours is None else one.hours),
    )


def _proposal(
    outlook: Outlook, best: Instances, sizes: Array, rivals: Sequence[Instances]
) -> Proposal | None:
    """As many blocks as it takes; None where `MOST` are too few."""
    c = outlook.conditions
    apart = sum(size * column_of(item, c) for item, size in zip(best, sizes, strict=True))
    beside = [outlook.beside(_span(rival, c), np.asarray(apart)[:, None]) for rival in rivals]

    def hardest(number: int) -> float:
        return min(float(left.lengths(number)[0]) for left in beside)

    fewer = bisect_left(range(1, MOST + 1), ENOUGH, key=hardest)
    if fewer == MOST:
        return None
    blocks, readings = fewer + 1, (fewer + 1) * outlook.readings
    times = f"{blocks} times " if blocks > 1 else ""
    name, *others = (" + ".join(sorted(i.effect.id for i in own)) for own in (best, *rivals))
    return Proposal(
        block=outlook.block,
        blocks=blocks,
        readings=readings,
        hours=None if outlook.hours is None else blocks * outlook.hours,
        text=f"measure {times}{outlook.block.action}: {readings} readings tell {name} from"
        f" {', '.join(others)}",
    )


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


class Outlook(NamedTuple):
    """A record with a block of readings that are foreseen."""

    block: Block  # what is measured
    readings: int  # readings of the block
    hours: float | None  # time that it takes; None where the record tells no times
    conditions: Conditions  # of the readings of record and block
    whiteners: tuple[Whitener, Whitener]
    """Of the errors of the readings of the record, and of those of the block, without the head."""
    taken: Array  # columns of the base model, and of the head, (n, p) [g]
    heads: int  # how many of them, at the end, are of the head, with the standard deviation 1

    def beside(self, others: Array, columns: Array) -> Left:
        """What base model, head and others, shape (n, h), leave of columns, shape (n, k) [g]."""
        every = np.hstack([self.taken, others, columns])
        before, last = every.shape[0] - self.readings, self.taken.shape[1]
        prior = np.zeros((self.heads, every.shape[1]))
        prior[:, last - self.heads : last] = np.eye(self.heads)
        old, new = (
            whitener.whitened(rows)
            for whitener, rows in zip(self.whiteners, (every[:before], every[before:]), strict=True)
        )
        whole = np.vstack([old, prior])
        return Left(_triangle(whole), _triangle(new), last + others.shape[1])


def _triangle(columns: Array) -> Array:
    return np.asarray(np.linalg.qr(columns, mode="r"))


class Left(NamedTuple):
    """What columns leave of other columns."""

    old: Array  # triangle of all whitened columns over the readings of the record, (r, t + k)
    new: Array  # the same over those of a block, (r, t + k)
    taken: int  # number t of columns that take

    def lengths(self, blocks: int) -> Array:
        """Lengths that are left after a number of blocks, (k,), in standard deviations of noise."""
        rows = np.vstack([self.old, np.sqrt(blocks) * self.new])
        basis, wanted = orthonormal(rows[:, : self.taken]), rows[:, self.taken :]
        return lengths(without(wanted, basis))


def outlooks(
    record: TumbleRecord, noise: ReadingNoise, reference_temperature: float, delta0: float = 0.0
) -> tuple[Outlook, ...]:
    """Foresee each entry of the menu of further readings, of the noise of the record."""
    own = base_model(record, reference_temperature, delta0)
    return tuple(
        _outlook(record, block, noise, own) for block in menu(record, reference_temperature)
    )


def _outlook(record: TumbleRecord, block: Block, noise: ReadingNoise, own: BaseModel) -> Outlook:
    whole, model = _foreseen(record, blank(block, record), own)
    n = len(record)
    old = np.arange(len(whole)) < n
    clocking = np.where(old, 0.0, block.clocking)
    c = replace(model.conditions, angle=whole.angle - clocking)
    declared = record.apparatus
    if noise.relative is not None:
        noise = noise._replace(relative=np.append(noise.relative, np.ones(len(whole) - n)))
    spread = covariance(c, noise, replace(declared, head_uncertainty=None))
    head = _head(c, declared)
    return Outlook(
        block=block,
        readings=len(whole) - n,
        hours=None
        if whole.time is None
        else float(whole.time[n:].max() - whole.time[:n].max()) / HOUR,
        conditions=c,
        whiteners=(whitener_of(spread.among(old)), whitener_of(spread.among(~old))),
        taken=np.hstack([model.jacobian(solve(model)), head]),
        heads=head.shape[1],
    )


def _head(c: Conditions, declared: Apparatus) -> Array:
    """What a standard deviation of each head position does to the readings [g]."""
    if not declared.head_uncertainty:
        return np.empty((c.angle.size, 0))
    return np.asarray(declared.head_uncertainty * head_columns(c))


def _foreseen(
    record: TumbleRecord, form: TumbleRecord, own: BaseModel
) -> tuple[TumbleRecord, BaseModel]:
    """Record and block, with the outputs that the base model of the record foresees.

    A new run follows the laws; a slope that the record does not tell is none.
    """
    whole = joined(record, form)
    old = np.arange(len(whole)) < len(record)
    reference, delta0 = own.T0, own.delta0
    ideal = own.nominal * conditions_of(whole, reference, delta0).input
    first = base_model(replace(whole, output=np.where(old, whole.output, ideal)), reference, delta0)
    first = without_shifts(first, {name.partition(" ")[2] for name in own.names})
    gain, inside = first.split(solve(first, lambda columns: columns[old]))
    whole = replace(whole, output=np.where(old, whole.output, first.nominal * gain * inside))
    return whole, base_model(whole, reference, delta0)
