"""The stand: which angle to the vertical a head reaches that was driven to a position."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hidden.clock import Session
from hidden.design import Floats
from hidden.memory import play

DAY = 86400.0


@dataclass(frozen=True)
class Stand:
    """A head on a foundation; all angles in rad.

    Attributes
    ----------
    graduation : tuple of float
        Error of each position of the turn, empty for none.
    backlash : float
        Slack of the gear between forward and back.
    fixture : float
        Angle of the unit in its clamp.
    eccentricity, eccentricity_phase : float
        Of the divided circle: its error is a sine of the angle.
    wrong_position, wrong_by : int, float
        One position, from 1, that lies off.
    tilt_rate : float
        Of the foundation [rad/s].
    tilt_daily, tilt_phase : float
        Of the foundation in the course of a day.
    shaking : float
        Rms of the momentary angle while a reading is taken.
    """

    graduation: tuple[float, ...] = ()
    backlash: float = 0.0
    fixture: float = 0.0
    eccentricity: float = 0.0
    eccentricity_phase: float = 0.0
    wrong_position: int = 0
    wrong_by: float = 0.0
    tilt_rate: float = 0.0
    tilt_daily: float = 0.0
    tilt_phase: float = 0.0
    shaking: float = 0.0

    def angle(self, session: Session) -> Floats:
        """From the vertical to the input axis at each stop [rad]."""
        head = self._driven(session)
        head = head + self.eccentricity * np.sin(head + self.eccentricity_phase)
        head = head + self._off(session) + self.fixture + self.shaking * session.vibration
        return head - self._vertical(session.time)

    def _driven(self, session: Session) -> Floats:
        """The table trails the worm by half the slack, whichever way it is driven."""
        if self.backlash == 0.0:
            return session.angle
        slack = self.backlash / 2
        return play(session.angle, slack, float(session.angle[0]) - slack)

    def _off(self, session: Session) -> Floats:
        """A position is off by the same angle whenever the head comes to it."""
        mark = (session.position - 1) % session.design.positions
        off = np.zeros(session.design.positions)
        off[: len(self.graduation)] = self.graduation
        off[self.wrong_position - 1] += self.wrong_by
        return off[mark]

    def _vertical(self, time: Floats) -> Floats:
        day = np.sin(2 * np.pi * time / DAY + self.tilt_phase) - np.sin(self.tilt_phase)
        return self.tilt_rate * time + self.tilt_daily * day
