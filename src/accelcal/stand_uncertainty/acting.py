"""A component of the stand on the readings of a test: how it enters, and which share an error."""

from __future__ import annotations

from dataclasses import dataclass

from accelcal.arrays import Array, Places
from accelcal.stand_uncertainty.kinds import KINDS
from accelcal.stand_uncertainty.readings import Readings
from accelcal.stand_uncertainty.stand import StandComponent


@dataclass(frozen=True, slots=True, eq=False)
class Acting:
    """A component on the n readings of a test.

    Attributes
    ----------
    component : StandComponent
        The component.
    channel : str
        What it changes, one of `accelcal.stand_uncertainty.readings.CHANNELS`.
    pattern : ndarray, shape (n, 1) or (n, 2)
        Change of the channel per unit, as of `accelcal.stand_uncertainty.kinds.Kind`.
    error : ndarray, shape (n,)
        Number of the independent error that each reading has.
    errors : int
        How many there are.
    """

    component: StandComponent
    channel: str
    pattern: Array
    error: Places
    errors: int


def acting(component: StandComponent, readings: Readings) -> Acting:
    """Let a component act on the readings of a test.

    Parameters
    ----------
    component : StandComponent
        The component.
    readings : Readings
        The test.

    Returns
    -------
    Acting
        What the linear budget and Monte Carlo both start from.
    """
    kind = KINDS[component.kind]
    pattern = kind.pattern(readings, component.order)
    error, errors = readings.groups(component.varies)
    return Acting(component, kind.channel, pattern, error, errors)
