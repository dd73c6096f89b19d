"""The catalogued effects: for each id, what is changed in the laboratory, drawn off any grid."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from types import MappingProxyType

import numpy as np

from hidden.clock import Session
from hidden.design import Design
from hidden.recipe import Recipe, lever
from hidden.world import World

NEXT_BREAK = 10.0  # degC from T0: no break is drawn where no level is farther

Maker = Callable[[np.random.Generator, Session], Recipe]


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _plain_lever(
    room: str, name: str, signed: bool, _rng: np.random.Generator, _session: Session
) -> Recipe:
    return lever(room, name, signed=signed)


def _lever(room: str, name: str, *, signed: bool = True) -> Maker:
    return partial(_plain_lever, room, name, signed)


def _with_law(world: World, law: str, **values: float) -> World:
    return world.having("sensor", **{law: replace(getattr(world.sensor, law), **values)})


def _square(law: str, _rng: np.random.Generator, _session: Session) -> Recipe:
    return Recipe(
        alter=lambda world, size: _with_law(world, law, square=size),
        truth=lambda size: {"square": size},
    )


def break_shift(rng: np.random.Generator, session: Session) -> Recipe:
    """The slopes of the bias meet off T0; the size is by how much they differ [g/degC]."""
    reached = session.level - session.design.reference
    sides = [side for side in (1.0, -1.0) if (side * reached).max() > NEXT_BREAK]
    if not sides:
        raise ValueError("this design has no level beyond a break of the law")
    side = float(rng.choice(sides))
    bend = side * log_uniform(rng, 6.0, min(26.0, 0.8 * float((side * reached).max())))

    def slopes(world: World, size: float) -> World:
        return _with_law(world, "bias", below=world.sensor.bias.above + size)

    return Recipe(
        alter=lambda world, size: _with_law(slopes(world, size), "bias", bend=bend),
        truth=lambda size: {"contrast": size, "bend": bend},
        plain=slopes,
    )


def warm_up(rng: np.random.Generator, session: Session) -> Recipe:
    tau = session.run_length * log_uniform(rng, 0.03, 0.5)
    return lever("sensor", "warm_up", warm_up_time=tau)


def bias_step(rng: np.random.Generator, session: Session) -> Recipe:
    run = rng.integers(1, len(session.design.temperatures) + 1)
    inside = session.time[(session.run == run) & (session.in_run >= 0.0)]
    moment = inside[0] + rng.uniform(0.15, 0.85) * (inside[-1] - inside[0])
    return lever("sensor", "step", step_time=float(moment))


def foundation_tilt(rng: np.random.Generator, _session: Session) -> Recipe:
    if rng.random() < 0.5:
        return lever("stand", "tilt_rate")
    return lever("stand", "tilt_daily", tilt_phase=rng.uniform(0.0, 2 * np.pi))


def head_eccentricity(rng: np.random.Generator, _session: Session) -> Recipe:
    return lever("stand", "eccentricity", eccentricity_phase=rng.uniform(0.0, 2 * np.pi))


def position_error(rng: np.random.Generator, session: Session) -> Recipe:
    """At a position where an angle counts: near the top and the bottom of the turn none does."""
    turn = np.arange(1, session.design.positions + 1)
    counts = turn[np.abs(np.sin((turn - 1) * 2 * np.pi / len(turn))) > 0.35]
    return lever("stand", "wrong_by", wrong_position=int(rng.choice(counts)))


def outlier(rng: np.random.Generator, session: Session) -> Recipe:
    return lever("readout", "outlier", outlier_at=int(rng.integers(len(session.read))))


def swapped_positions(rng: np.random.Generator, session: Session) -> Recipe:
    """Two positions of a stroke; those of one angle would change nothing."""
    positions = session.design.positions
    stroke = int(rng.integers(len(session.read) // (positions + 1))) * (positions + 1)
    first, second = rng.choice(positions, 2, replace=False)
    pair = (stroke + int(first), stroke + int(second))
    return Recipe(
        alter=lambda world, _size: world.having("readout", swapped=pair),
        truth=lambda _size: {"first": pair[0], "second": pair[1]},
        sizes=False,
    )


def quantization(_rng: np.random.Generator, _session: Session) -> Recipe:
    return replace(lever("readout", "resolution", signed=False), half_steps=True)


def thermal_lag(rng: np.random.Generator, session: Session) -> Recipe:
    """The bias lags behind the temperature; nobody knows how the unit came to the first level."""
    if np.ptp(session.level) == 0.0:
        raise ValueError("this design has no level that is reached from another")
    return lever("sensor", "thermal_lag", thermal_start=float(rng.uniform(-1.0, 1.0)))


CATALOGUE: MappingProxyType[str, Maker] = MappingProxyType(
    {
        "scale-factor-asymmetry": _lever("sensor", "asymmetry"),
        "fourth-order": _lever("sensor", "fourth"),
        "odd-quadratic": _lever("sensor", "odd_square"),
        "cross-axis-cubic": _lever("sensor", "across_cube"),
        "cross-axis-quadratic": _lever("sensor", "across_square"),
        "dead-zone": _lever("sensor", "dead_zone", signed=False),
        "k2-temperature": _lever("sensor", "k2_warmth"),
        "k3-temperature": _lever("sensor", "k3_warmth"),
        "bias-temperature-quadratic": partial(_square, "bias"),
        "scale-factor-temperature-quadratic": partial(_square, "gain"),
        "break-shift": break_shift,
        "temperature-hysteresis": thermal_lag,
        "chamber-drift": _lever("chamber", "drift"),
        "bias-drift": _lever("sensor", "bias_rate"),
        "scale-factor-drift": _lever("sensor", "gain_rate"),
        "warm-up": warm_up,
        "bias-step": bias_step,
        "stroke-offset": _lever("sensor", "stroke_offset"),
        "hysteresis": _lever("sensor", "slack", signed=False),
        "foundation-tilt": foundation_tilt,
        "backlash": _lever("stand", "backlash", signed=False),
        "fixture-offset": _lever("stand", "fixture"),
        "head-eccentricity": head_eccentricity,
        "position-error": position_error,
        "outlier": outlier,
        "swapped-positions": swapped_positions,
        "quantization": quantization,
        "vibration-noise": _lever("stand", "shaking", signed=False),
    }
)
"""Id -> what makes its recipe."""

OF_TEMPERATURE = (
    "k2-temperature",
    "k3-temperature",
    "bias-temperature-quadratic",
    "scale-factor-temperature-quadratic",
    "temperature-hysteresis",
)


def has_a_subject(name: str, design: Design) -> bool:
    """Whether a design has readings that an effect changes."""
    away = max(abs(level - design.reference) for level in design.temperatures)
    if name == "break-shift":
        return away > NEXT_BREAK
    return away > 0.0 or name not in OF_TEMPERATURE


DATA_FAULTS = ("outlier", "swapped-positions", "quantization", "vibration-noise")
"""Effects on the readings, not on what is measured."""
