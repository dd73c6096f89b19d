"""A laboratory as a whole, and its readings."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from hidden.chamber import Chamber
from hidden.clock import Session
from hidden.design import Floats
from hidden.readout import Readout
from hidden.sensor import Sensor
from hidden.stand import Stand


@dataclass(frozen=True)
class World:
    """One unit on one stand in one chamber at one voltmeter."""

    sensor: Sensor
    stand: Stand = field(default_factory=Stand)
    chamber: Chamber = field(default_factory=Chamber)
    readout: Readout = field(default_factory=Readout)

    def having(self, room: str, **values: object) -> World:
        """Have other values in one of its parts."""
        return replace(self, **{room: replace(getattr(self, room), **values)})


def observe(world: World, session: Session, noise: Floats | float = 0.0) -> Floats:
    """Take the readings of a session, in their order, shape (n,) [mA]."""
    angle = world.stand.angle(session)
    current = world.sensor.current(session, angle, world.chamber.unit(session))
    return world.readout.written(current[session.read] + noise)
