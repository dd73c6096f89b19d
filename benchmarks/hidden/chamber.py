"""The chamber: how warm the unit is at each stop, and what its thermometer tells of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hidden.clock import Session
from hidden.design import Floats

ROOM = 20.0  # degC, where the unit comes from


@dataclass(frozen=True)
class Chamber:
    """A chamber in one test.

    Attributes
    ----------
    approach : float
        Time constant of the approach to a level, 0 for one that is there at once [s].
    swing, period : float
        Of the controller about the level [degC, s].
    drift : float
        Of the unit away from the thermometer, from the start of each run [degC/s].
    """

    approach: float = 0.0
    swing: float = 0.0
    period: float = 1200.0
    drift: float = 0.0

    def shown(self, session: Session) -> Floats:
        """Temperature at the thermometer at each stop [degC]."""
        shown = session.level + self.swing * np.sin(2 * np.pi * session.time / self.period)
        if self.approach > 0:
            shown = shown + self._left_to_go(session)
        return shown

    def unit(self, session: Session) -> Floats:
        """Temperature of the unit at each stop [degC]."""
        return self.shown(session) + self.drift * session.in_run

    def _left_to_go(self, session: Session) -> Floats:
        """What a soak has left of the way from the level before."""
        levels = np.array([ROOM, *session.design.temperatures])
        way = (levels[:-1] - levels[1:])[session.run - 1]
        starts = np.flatnonzero(np.diff(session.run, prepend=0))
        before = np.concatenate([[-7200.0], session.time[starts[1:] - 1]])[session.run - 1]
        return way * np.exp(-(session.time - before) / self.approach)


def recording_chamber(rng: np.random.Generator) -> Chamber:
    """A chamber whose thermometer is read each time, so that it need not stand still."""
    return Chamber(
        approach=rng.uniform(1000.0, 1800.0),
        swing=rng.uniform(0.02, 0.1),
        period=rng.uniform(900.0, 2400.0),
    )
