"""The plan of a tumble test: which reading comes when, at which angle and level."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Sequence(NamedTuple):
    """Readings in the order in which they are taken; arrays of shape (n,), numbers from 1."""

    run: Ints
    stroke: Ints
    position: Ints
    angle: Floats  # deg, nominal, 0..360
    sense: Floats  # of the stroke: 1 forward, -1 back
    level: Floats  # degC


@dataclass(frozen=True)
class Design:
    """A test, and what its table tells.

    Attributes
    ----------
    positions : int
        In a turn; each stroke also returns to the first (8 positions: 9 readings).
    temperatures : tuple of float
        Level of each run in order [degC]; a level may be met again.
    cycles : int
        Of a forward and a back stroke, in each run.
    time : bool
        Whether the table has a column of time.
    declared : bool
        Whether its header declares the uncertainties.
    actual_temperature : bool
        Whether the temperature of each reading is recorded, or the level of the run alone.
    angles : bool
        Whether the CSV gives angles in place of positions.
    reference : float
        T0 [degC].
    """

    positions: int = 8
    temperatures: tuple[float, ...] = (20.0, 80.0, -40.0)
    cycles: int = 3
    time: bool = True
    declared: bool = True
    actual_temperature: bool = False
    angles: bool = False
    reference: float = 20.0

    @cached_property
    def sequence(self) -> Sequence:
        """All readings; designs of the same plan share them."""
        return _sequence(self.positions, self.temperatures, self.cycles)


@lru_cache(maxsize=64)
def _sequence(positions: int, temperatures: tuple[float, ...], cycles: int) -> Sequence:
    forward = np.arange(1, positions + 2)
    runs, strokes = len(temperatures), 2 * cycles
    position = np.tile(np.concatenate([forward, forward[::-1]]), runs * cycles)
    stroke = np.tile(np.repeat(np.arange(1, strokes + 1), positions + 1), runs)
    run = np.repeat(np.arange(1, runs + 1), strokes * (positions + 1))
    return Sequence(
        run=run,
        stroke=stroke,
        position=position,
        angle=(position - 1) * (360.0 / positions),
        sense=np.where(stroke % 2 == 1, 1.0, -1.0),
        level=np.asarray(temperatures, dtype=float)[run - 1],
    )


LOOP = (20.0, 50.0, 80.0, 50.0, 20.0, -10.0, -40.0, -10.0)
TEN = (20.0, 35.0, 50.0, 65.0, 80.0, 50.0, 20.0, -10.0, -40.0, -10.0)

DESIGNS = MappingProxyType(
    {
        "three": Design(),
        "loop": Design(temperatures=LOOP),
        "one": Design(temperatures=(20.0,)),
        "twelve": Design(positions=12),
        "twelve-loop": Design(positions=12, temperatures=LOOP),
        "twenty-four": Design(positions=24),
        "five": Design(temperatures=(20.0, 50.0, 80.0, -10.0, -40.0)),
        "ten": Design(temperatures=TEN),
        "three-bare": Design(time=False, declared=False),
        "loop-untimed": Design(temperatures=LOOP, time=False),
        "loop-actual": Design(temperatures=LOOP, actual_temperature=True),
        "twelve-angles": Design(positions=12, angles=True, declared=False),
    }
)
"""162 readings in 3 runs, 432 in 8 runs (levels met by heating and by cooling), and others."""
