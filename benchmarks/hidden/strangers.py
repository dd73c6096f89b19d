"""Effects that stand in no catalogue: each real enough, none a term that anybody lists."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from types import MappingProxyType

import numpy as np

from hidden.catalogue import log_uniform
from hidden.clock import Session
from hidden.design import Design, Floats
from hidden.recipe import Recipe
from hidden.sensor import Stranger
from hidden.world import World


def direction_cos3(session: Session, angle: Floats, _warmer: Floats) -> Floats:
    """The gear runs differently forward and back, three times in a turn."""
    return session.sense * np.cos(3 * angle)


def direction_sin5(session: Session, angle: Floats, _warmer: Floats) -> Floats:
    """The same five times in a turn; on 8 positions nothing but backlash and hysteresis."""
    return session.sense * np.sin(5 * angle)


def temperature_cos4(_session: Session, angle: Floats, warmer: Floats) -> Floats:
    """The unit's case bends fourfold as it warms."""
    return warmer / 60.0 * np.cos(4 * angle)


def temperature_direction(session: Session, _angle: Floats, warmer: Floats) -> Floats:
    """An offset of the strokes that follows the temperature, as the oil of a bearing does."""
    return session.sense * warmer / 60.0


def root_time_bias(session: Session, _angle: Floats, _warmer: Floats) -> Floats:
    """Aging by diffusion."""
    return np.sqrt(np.maximum(session.time, 0.0) / session.time[-1])


def growing_third_harmonic(session: Session, angle: Floats, _warmer: Floats) -> Floats:
    """A shape that grows by the clock."""
    return session.time / session.time[-1] * np.cos(3 * angle)


def alternating_bias(session: Session, _angle: Floats, _warmer: Floats) -> Floats:
    """Two channels of a switch that take turns."""
    return np.where(np.cumsum(session.in_run >= 0.0) % 2 == 0, 1.0, -1.0)


def periodic_bias(
    session: Session, _angle: Floats, _warmer: Floats, period: float, phase: float
) -> Floats:
    """The air of the room goes on and off."""
    return np.sin(2 * np.pi * session.time / period + phase)


def one_run_k2(session: Session, angle: Floats, _warmer: Floats, run: int) -> Floats:
    """One launch with another K2."""
    return (session.run == run) * np.cos(angle) ** 2


def position_cycle(session: Session, _angle: Floats, _warmer: Floats, position: int) -> Floats:
    """One position that wears from cycle to cycle."""
    return ((session.position - 1) % session.design.positions == position - 1) * (
        session.cycle / session.design.cycles
    )


def bias_pulse(
    session: Session, _angle: Floats, _warmer: Floats, since: float, until: float
) -> Floats:
    """A disturbance that comes and goes."""
    return ((session.time >= since) & (session.time < until)).astype(float)


def bad_stroke_noise(
    session: Session, _angle: Floats, _warmer: Floats, run: int, stroke: int
) -> Floats:
    """One stroke during which somebody walked about; the head's shaking is its noise."""
    return ((session.run == run) & (session.stroke == stroke)) * session.vibration


def range_offset(_session: Session, angle: Floats, _warmer: Floats) -> Floats:
    """The voltmeter changes its range at half of full scale, and the ranges have other zeros."""
    return (np.abs(np.cos(angle)) > 0.6).astype(float)


def range_gain(_session: Session, angle: Floats, _warmer: Floats) -> Floats:
    """One of its ranges is steeper."""
    return np.where(np.cos(angle) > 0.6, np.cos(angle), 0.0)


def harmonic(_session: Session, angle: Floats, _warmer: Floats, times: int, phase: float) -> Floats:
    """Iron in the stand, whose field the magnet of the unit feels so many times a turn."""
    return np.cos(times * angle + phase)


def uneven_head(session: Session, angle: Floats, _warmer: Floats, seed: int) -> Floats:
    """A head that is far worse than its declaration, at each position otherwise."""
    return -np.sin(angle) * at_each_position(session, angle, _warmer, seed)


def at_each_position(session: Session, _angle: Floats, _warmer: Floats, seed: int) -> Floats:
    """A cable that pulls otherwise at each position."""
    count = session.design.positions
    return np.random.default_rng(seed).standard_normal(count)[(session.position - 1) % count]


def _harmonic(rng: np.random.Generator, _session: Session) -> dict[str, float]:
    return {"times": int(rng.integers(5, 7)), "phase": rng.uniform(0.0, 2 * np.pi)}


def _seed(rng: np.random.Generator, _session: Session) -> dict[str, float]:
    return {"seed": int(rng.integers(2**31))}


def _period(rng: np.random.Generator, session: Session) -> dict[str, float]:
    return {
        "period": session.run_length * log_uniform(rng, 0.1, 0.6),
        "phase": rng.uniform(0.0, 2 * np.pi),
    }


def _run(rng: np.random.Generator, session: Session) -> dict[str, float]:
    return {"run": int(rng.integers(1, len(session.design.temperatures) + 1))}


def _position(rng: np.random.Generator, session: Session) -> dict[str, float]:
    return {"position": int(rng.integers(1, session.design.positions + 1))}


def _stroke(rng: np.random.Generator, session: Session) -> dict[str, float]:
    return _run(rng, session) | {"stroke": int(rng.integers(1, 2 * session.design.cycles + 1))}


def _pulse(rng: np.random.Generator, session: Session) -> dict[str, float]:
    inside = session.time[(session.run == _run(rng, session)["run"]) & (session.in_run >= 0.0)]
    length = log_uniform(rng, 0.1, 0.3) * (inside[-1] - inside[0])
    since = rng.uniform(inside[0], inside[-1] - length)
    return {"since": float(since), "until": float(since + length)}


Draw = Callable[[np.random.Generator, Session], dict[str, float]]

STRANGERS: MappingProxyType[str, tuple[Stranger, Draw | None]] = MappingProxyType(
    {
        "direction-cos3": (direction_cos3, None),
        "direction-sin5": (direction_sin5, None),
        "temperature-cos4": (temperature_cos4, None),
        "temperature-direction": (temperature_direction, None),
        "root-time-bias": (root_time_bias, None),
        "growing-third-harmonic": (growing_third_harmonic, None),
        "alternating-bias": (alternating_bias, None),
        "periodic-bias": (periodic_bias, _period),
        "one-run-k2": (one_run_k2, _run),
        "position-cycle": (position_cycle, _position),
        "bias-pulse": (bias_pulse, _pulse),
        "bad-stroke-noise": (bad_stroke_noise, _stroke),
    }
)
"""Name -> acceleration of size 1, and what draws its parameters."""


OF_POSITION: MappingProxyType[str, tuple[Stranger, Draw | None]] = MappingProxyType(
    {
        "range-offset": (range_offset, None),
        "range-gain": (range_gain, None),
        "harmonic": (harmonic, _harmonic),
        "uneven-head": (uneven_head, _seed),
        "at-each-position": (at_each_position, _seed),
    }
)
"""The same of patterns of the position alone, of which few positions show few."""


def is_outside(name: str, design: Design) -> bool:
    """Whether a stranger is one under a design: not empty, and no mix of catalogued effects."""
    if name == "direction-sin5":
        return design.positions > 8
    if name == "one-run-k2":
        return len(design.temperatures) > 2
    if name.startswith("temperature"):
        return len(set(design.temperatures)) > 1
    return True


def stranger(name: str, rng: np.random.Generator, session: Session) -> Recipe:
    """Hide a stranger."""
    shape, draws = (STRANGERS | OF_POSITION)[name]
    drawn = draws(rng, session) if draws else {}
    term = partial(shape, **drawn)

    def alter(world: World, size: float) -> World:
        strangers = (*world.sensor.strangers, (term, size))
        return replace(world, sensor=replace(world.sensor, strangers=strangers))

    return Recipe(alter=alter, truth=lambda size: {"size": size, **drawn})
