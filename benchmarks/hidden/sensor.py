"""The accelerometer: from the accelerations along and across its axis to a current."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from hidden.chamber import ROOM
from hidden.clock import Session
from hidden.design import Floats
from hidden.memory import play

THERMAL_SLACK = 4.0  # degC either way until the suspension follows the temperature

Stranger = Callable[[Session, Floats, Floats], Floats]
"""Of session, angle [rad] and dT [degC] to an acceleration of size 1 at most, or about."""


@dataclass(frozen=True)
class Law:
    """A quantity over temperature: two slopes that meet at a break, and a square.

    Attributes
    ----------
    at : float
        Value at T0.
    above, below : float
        Slopes above and below the break [1/degC].
    square : float
        Of dT [1/degC^2].
    bend : float
        The break, from T0 [degC].
    """

    at: float
    above: float = 0.0
    below: float = 0.0
    square: float = 0.0
    bend: float = 0.0

    def __call__(self, warmer: Floats) -> Floats:
        """Value at each temperature difference from T0."""
        return self.at + self._climb(warmer) - self._climb(0.0) + self.square * warmer * warmer

    def _climb(self, warmer):
        beyond = warmer - self.bend
        return self.above * np.maximum(beyond, 0.0) + self.below * np.minimum(beyond, 0.0)


@dataclass(frozen=True)
class Sensor:
    """A pendulous accelerometer; accelerations in local g, time in s, temperature in degC.

    Attributes
    ----------
    gain : Law
        K1 over its value at T0, which is `scale`.
    scale : float
        K1 at T0 [mA/g].
    bias, delta : Law
        k0 [g] and misalignment [rad].
    k2, k3, cross : float
        k2 [g/g^2], k3 [g/g^3], delta_ip [g/g^2].
    launch_bias, launch_gain : tuple of float
        Of each run: shift of the bias [g], of the scale factor [1]; empty for none.
    asymmetry : float
        Scale factor of positive over that of negative accelerations, minus 1.
    fourth, odd_square, across_cube, across_square : float
        Responses to a_i^4, to a_i^2 with the sign of a_i, to a_p^3 and a_p^2.
    dead_zone : float
        Force along the true input axis that friction holds [g].
    slack : float
        Half-width of the play between that force and the pendulum [g].
    k2_warmth, k3_warmth : float
        Change of k2 and k3 with temperature [1/degC].
    thermal_lag : float
        Half the bias between a level reached by heating and by cooling [g].
    thermal_start : float
        State at the beginning, from -1, as after cooling, to 1, as after heating.
    bias_rate, gain_rate : float
        Drift of k0 [g/s] and of K1 [1/s].
    warm_up, warm_up_time : float
        Bias that dies away from the start of each run [g], and its time constant [s].
    step, step_time : float
        Jump of the bias [g], and when [s].
    stroke_offset : float
        Output on forward minus that on back strokes [g].
    strangers : tuple of (Stranger, float)
        What no catalogue knows, and its size [g].
    """

    scale: float
    gain: Law
    bias: Law
    delta: Law
    k2: float = 0.0
    k3: float = 0.0
    cross: float = 0.0
    launch_bias: tuple[float, ...] = ()
    launch_gain: tuple[float, ...] = ()
    asymmetry: float = 0.0
    fourth: float = 0.0
    odd_square: float = 0.0
    across_cube: float = 0.0
    across_square: float = 0.0
    dead_zone: float = 0.0
    slack: float = 0.0
    k2_warmth: float = 0.0
    k3_warmth: float = 0.0
    thermal_lag: float = 0.0
    thermal_start: float = 0.0
    bias_rate: float = 0.0
    gain_rate: float = 0.0
    warm_up: float = 0.0
    warm_up_time: float = 1.0
    step: float = 0.0
    step_time: float = 0.0
    stroke_offset: float = 0.0
    strangers: tuple[tuple[Stranger, float], ...] = field(default=())

    def current(self, session: Session, angle: Floats, temperature: Floats) -> Floats:
        """Output current at each stop [mA]."""
        warmer = temperature - session.design.reference
        along, across = np.cos(angle), np.sin(angle)
        answer = self._felt(along, across, warmer) + self._bent(along, across, warmer)
        answer = answer + self._bias(session, temperature, warmer)
        for stranger, size in self.strangers:
            answer = answer + size * stranger(session, angle, warmer)
        return self.scale * self._gain(session, warmer) * answer

    def _felt(self, along: Floats, across: Floats, warmer: Floats) -> Floats:
        """Force on the pendulum along its true axis, behind its play and its friction."""
        felt = along + self.delta(warmer) * across
        if self.slack:
            felt = play(felt, self.slack, float(felt[0]))
        if self.dead_zone:
            felt = np.where(
                felt > self.dead_zone,
                felt - self.dead_zone,
                np.where(felt < -self.dead_zone, felt + self.dead_zone, 0.0),
            )
        return felt

    def _bent(self, along: Floats, across: Floats, warmer: Floats) -> Floats:
        """All that is not proportional to the force."""
        size, square, aside = np.abs(along), along * along, across * across
        sided = np.where(along > 0, self.asymmetry / 2 * along, -self.asymmetry / 2 * along)
        even = (self.k2 + self.k2_warmth * warmer + self.fourth * square) * square
        odd = ((self.k3 + self.k3_warmth * warmer) * square + self.odd_square * size) * along
        lateral = (self.across_square + self.across_cube * across) * aside
        return sided + even + odd + lateral + self.cross * along * across

    def _bias(self, session: Session, temperature: Floats, warmer: Floats) -> Floats:
        bias = self.bias(warmer) + self.bias_rate * session.time
        if self.launch_bias:
            bias = bias + np.array(self.launch_bias)[session.run - 1]
        if self.thermal_lag:
            start = ROOM - self.thermal_start * THERMAL_SLACK
            behind = temperature - play(temperature, THERMAL_SLACK, start)
            bias = bias + self.thermal_lag * behind / THERMAL_SLACK
        if self.warm_up:
            powered = np.maximum(session.in_run, 0.0)
            bias = bias + self.warm_up * np.exp(-powered / self.warm_up_time)
        bias = bias + self.step * (session.time >= self.step_time)
        return bias + self.stroke_offset / 2 * session.sense

    def _gain(self, session: Session, warmer: Floats) -> Floats:
        gain = self.gain(warmer) * (1.0 + self.gain_rate * session.time)
        if self.launch_gain:
            gain = gain * (1.0 + np.array(self.launch_gain)[session.run - 1])
        return gain


def al15(rng: np.random.Generator) -> Sensor:
    """A unit of the AL-15 kind, each with its own coefficients and laws."""
    about = rng.uniform(0.6, 1.4, 10)
    lean, slopes, cross = rng.choice([-1.0, 1.0], 2), rng.normal(0, 2e-6, 2), rng.normal(0, 3e-5)
    return Sensor(
        scale=rng.uniform(1.25, 1.35),
        gain=Law(1.0, 520e-6 * about[0], 480e-6 * about[1]),
        bias=Law(3.324e-3 * about[2] * lean[0], -3.9e-5 * about[3], -4.5e-5 * about[4]),
        delta=Law(1.15e-3 * about[5] * lean[1], slopes[0], slopes[1]),
        k2=105e-6 * about[6],
        k3=87e-6 * about[7],
        cross=cross,
    )
