"""How long a tumble test takes: readings, turns of the head, soaks and mountings."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np

from accelcal.arguments.numbers import check_number
from accelcal.effects.conditions import SECONDS_PER_READING
from accelcal.errors import InputError
from accelcal.simulation import TumblePlan
from accelcal.units import HOUR

__all__ = ["Pace", "hours_of", "per_run", "strokes_within"]

_MOST_STROKES = 1000


@dataclass(frozen=True, slots=True)
class Pace:
    """Time that each action of a test takes.

    Attributes
    ----------
    reading : float
        A reading, with the time to settle before it [s].
    turn : float
        Turning the head to another position [s].
    soak : float
        Reaching a level of temperature and soaking there, once in each run [h].
    mount : float
        Mounting the unit, once in each mounting [h].

    Raises
    ------
    InputError
        If one is negative or not finite, or a reading takes no time.

    Notes
    -----
    The paper tells no times. The defaults are **set by us**.

    Examples
    --------
    >>> import accelcal
    >>> pace = accelcal.Pace(soak=4.0)
    >>> compared = accelcal.design(positions=[8], strokes=[6], pace=pace, effects=False)
    >>> compared.designs[0].hours > 3 * 4.0  # three levels
    True
    """

    reading: float = SECONDS_PER_READING
    turn: float = 30.0
    soak: float = 2.0
    mount: float = 1.0

    def __post_init__(self) -> None:
        check_number(
            0.0, 1e12, **{f"time of a {name}": value for name, value in asdict(self).items()}
        )
        check_number(1e-3, **{"time of a reading": self.reading})


def hours_of(plan: TumblePlan, pace: Pace) -> float:
    """Time of a whole test [h].

    Notes
    -----
    A stroke begins where the last one ended, so the head does not turn between strokes, nor between
    two readings at one angle.

    Examples
    --------
    >>> hours_of(TumblePlan(), Pace(reading=60.0, turn=30.0, soak=2.0, mount=1.0))
    10.925
    """
    stops = plan.stops
    turns = 1 + plan.strokes * np.count_nonzero(np.diff(stops))
    run = (plan.strokes * stops.size * pace.reading + turns * pace.turn) / HOUR
    runs = len(plan.temperatures) * len(plan.mountings)
    return float(runs * (run + pace.soak) + len(plan.mountings) * pace.mount)


def per_run(plan: TumblePlan, pace: Pace, hours: float) -> float:
    """Time that is left for the readings of each run [s], of hours for the whole test.

    Raises
    ------
    InputError
        If soaks and mountings leave nothing.
    """
    mountings = len(plan.mountings)
    runs = len(plan.temperatures) * mountings
    waiting = runs * pace.soak + mountings * pace.mount
    if not waiting < hours < np.inf:
        raise InputError(
            f"{hours:g} h for a test whose soaks and mountings alone take {waiting:g} h; allow more"
            " hours, or fewer levels and mountings"
        )
    return (hours - waiting) / runs * HOUR


def strokes_within(plan: TumblePlan, pace: Pace, hours: float) -> int:
    """Find the most strokes, in whole cycles, that some hours allow; 0 where not one fits.

    Examples
    --------
    >>> strokes_within(TumblePlan(), Pace(reading=60.0, turn=30.0, soak=2.0, mount=1.0), 10.925)
    6
    """
    per_run(plan, pace, hours)  # refuses hours that leave nothing
    cycle, two = (hours_of(replace(plan, strokes=n), pace) for n in (2, 4))
    cycles = 1 + int((hours - cycle) / (two - cycle) + 1e-9) if hours >= cycle else 0
    return 2 * min(cycles, _MOST_STROKES)
