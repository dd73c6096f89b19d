"""Regimes of noise: what scatters, how large it is, and what of it is declared."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from hidden.clock import Session
from hidden.design import Floats
from hidden.world import World

SIGMA = 5e-6
"""Standard deviation of the noise of a reading [g]."""

RESOLUTION = 1e-7
"""Step of the voltmeter [mA]."""


@dataclass(frozen=True)
class Regime:
    """Noise of a kind; sizes are standard deviations.

    Attributes
    ----------
    head : float
        Error of each position, the same in all strokes and runs [rad].
    launch, launch_gain : float
        Shift of the bias [g] and of the scale factor [1] from run to run.
    launch_declared : bool
        Whether a header that declares anything declares the launches.
    memory : float
        Correlation of the noise of a reading with that of the one before it in its run.
    freedom : int
        Degrees of freedom of Student's noise, 0 for a normal one.
    wander : float
        White noise that a bias of each run wanders by, over that of a reading.
    falls_with : float
        Power of the frequency that the power of the wandering falls with: 1 of flicker noise, 2 of
        a random walk.
    """

    head: float = 0.0
    launch: float = 0.0
    launch_gain: float = 0.0
    launch_declared: bool = True
    memory: float = 0.0
    freedom: int = 0
    wander: float = 0.0
    falls_with: float = 2.0

    def disturbed(self, world: World, session: Session, rng: np.random.Generator) -> World:
        """The same laboratory with errors of this head and of these launches."""
        runs = len(session.design.temperatures)
        graduation = self.head * rng.standard_normal(session.design.positions)
        bias, gain = rng.standard_normal((2, runs)) * [[self.launch], [self.launch_gain]]
        world = world.having("stand", graduation=tuple(graduation.tolist()))
        return world.having(
            "sensor", launch_bias=tuple(bias.tolist()), launch_gain=tuple(gain.tolist())
        )

    def scatter(self, session: Session, rng: np.random.Generator) -> Floats:
        """Noise of each reading, in units of its standard deviation, shape (n,)."""
        noise = self._remembered(self._fresh(len(session.read), rng), session)
        if self.wander:
            noise = noise + self._wandering(session) @ rng.standard_normal(len(noise))
        return noise

    def _remembered(self, fresh: Floats, session: Session) -> Floats:
        if not self.memory:
            return fresh
        run, share, noise = session.run[session.read].tolist(), np.sqrt(1 - self.memory**2), []
        for number, value in enumerate(fresh.tolist()):
            new = number == 0 or run[number] != run[number - 1]
            noise.append(value if new else self.memory * noise[-1] + share * value)
        return np.array(noise)

    def _wandering(self, session: Session) -> Floats:
        """How a run answers to white noise: a filter of fractional order (Kasdin, 1995)."""
        run = session.run[session.read]
        behind = np.subtract.outer(np.arange(len(run)), np.arange(len(run)))
        steps = np.arange(1, len(run))
        answer = np.cumprod(np.append(1.0, (steps - 1 + self.falls_with / 2) / steps))
        within = (behind >= 0) & (run[:, None] == run)
        return self.wander * np.where(within, answer[behind], 0.0)

    def covariance(self, world: World, session: Session) -> Floats:
        """Of all that scatters, to first order, shape (n, n) [mA^2]."""
        run, angle = session.run[session.read], session.angle[session.read]
        mark = (session.position[session.read] - 1) % session.design.positions
        same_run = run[:, None] == run
        apart = np.abs(np.subtract.outer(np.arange(len(run)), np.arange(len(run))))
        wandering = self._wandering(session)
        reading = np.where(same_run, self.memory**apart, 0.0) + wandering @ wandering.T
        head = self.head**2 * np.outer(np.sin(angle), np.sin(angle)) * (mark[:, None] == mark)
        gain = self.launch_gain**2 * np.outer(np.cos(angle), np.cos(angle))
        launch = same_run * (self.launch**2 + gain)
        return world.sensor.scale**2 * (SIGMA**2 * reading + head + launch)

    def _fresh(self, size: int, rng: np.random.Generator) -> Floats:
        if not self.freedom:
            return rng.standard_normal(size)
        return rng.standard_t(self.freedom, size) * np.sqrt((self.freedom - 2) / self.freedom)


REGIMES = MappingProxyType(
    {
        "iid": Regime(),
        "head": Regime(head=2e-5),
        "head-1-sigma": Regime(head=SIGMA),
        "launch": Regime(launch=1e-5, launch_gain=5e-6),
        "launch-undeclared": Regime(launch=1e-5, launch_gain=5e-6, launch_declared=False),
        "ar1": Regime(memory=0.5),
        "t5": Regime(freedom=5),
        "all": Regime(head=2e-5, launch=1e-5, launch_gain=5e-6, memory=0.5, freedom=5),
        "ar1-weak": Regime(memory=0.3),
        "ar1-strong": Regime(memory=0.7),
        "flicker": Regime(wander=1.0, falls_with=1.0),
        "walk": Regime(wander=0.3),
    }
)
"""The launches are of 2 sigma in the bias and 1 sigma in the scale factor."""

SLOW = ("ar1-weak", "ar1-strong", "flicker", "walk")
"""Regimes for a test of one run, which tells the memory of its noise poorly."""
