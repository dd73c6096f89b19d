"""Further readings foreseen: what a record and they would show together.

Errors of the head positions are unknowns with the declared uncertainty, so that old and new
readings at one position share them. All else is independent from run to run, so that further
blocks like the first add up; a shift that is free in each run counts as one in all of them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from accelcal.apparatus import Apparatus
from accelcal.arrays import Array
from accelcal.discovery.base import BaseModel, base_model, solve, without_shifts
from accelcal.discovery.columns import head_columns
from accelcal.discovery.noise.covariance import Whitener, whitener_of
from accelcal.discovery.noise.of_readings import ReadingNoise, covariance
from accelcal.discovery.prospects.further_readings import Block, blank, joined, menu
from accelcal.discovery.spans import lengths, orthonormal, without
from accelcal.effects.conditions import Conditions, conditions_of
from accelcal.record import TumbleRecord
from accelcal.units import HOUR


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
        hours=_hours(whole, n),
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


def _hours(whole: TumbleRecord, before: int) -> float | None:
    if whole.time is None:
        return None
    return float(whole.time[before:].max() - whole.time[:before].max()) / HOUR


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
