"""Readings of a tumble test from the physics, sharing no code with accelcal.

The generator behind the benchmarks: it walks through the test as the operator does, reading by
reading, and keeps the truth.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

__all__ = ["Stand", "Unit", "readings", "samples"]


@dataclass(frozen=True)
class Unit:
    """Truth of an accelerometer; slopes above and below 20 degC."""

    K1: float = 1.35
    k0: float = 3.324e-3
    k2: float = 105e-6
    k3: float = 87e-6
    delta: float = 1.15e-3
    delta_ip: float = 20e-6
    lam: tuple[float, float] = (-3.9e-5, -4.5e-5)
    beta: tuple[float, float] = (520e-6, 480e-6)
    gam: tuple[float, float] = (2e-6, -1e-6)

    def at(self, temperature: float) -> dict[str, float]:
        """Coefficients of the output (1) at a temperature."""
        rise = temperature - 20.0
        side = 0 if rise > 0 else 1
        scale = self.K1 * (1.0 + self.beta[side] * rise)
        return {
            "K0": scale * (self.k0 + self.lam[side] * rise),
            "K1": scale,
            "K2": scale * self.k2,
            "K3": scale * self.k3,
            "M": scale * (self.delta + self.gam[side] * rise),
            "M_ip": scale * self.delta_ip,
        }


@dataclass(frozen=True)
class Stand:
    """Standard deviations of the errors of a stand, and how they come."""

    reading: float = 5e-6
    across: float = 1.0  # the noise near 90 and 270 deg over that near 0 and 180
    neighbours: float = 0.0  # correlation of the noise of each reading with the next
    head: float = 0.0
    launch: float = 0.0
    launch_sf: float = 0.0
    step: float = 0.0
    temperature: float = 0.0  # of a run, degC
    stops: float = 0.0  # how far beside its position the head stops, as its encoder tells [deg]
    wrong: float = 0.0  # share of the readings that are off by up to 30 standard deviations


def readings(
    unit: Unit,
    stand: Stand,
    rng: np.random.Generator,
    *,
    positions: int = 8,
    strokes: int = 6,
    temperatures: tuple[float, ...] = (20.0,),
    head: Sequence[float] | None = None,
    side: float = 1.0,
) -> dict[str, list[float]]:
    """Columns run, temperature, angle [deg], stroke and output of one test.

    `head` are the errors of the positions [rad], by default those of a new head; on the side -1 the
    unit is turned by 180 deg about its input axis.
    """
    step = 2.0 * math.pi / positions
    if head is None:
        head = (rng.standard_normal(positions) * stand.head).tolist()
    columns: dict[str, list[float]] = {
        name: [] for name in ("run", "temperature", "angle", "stroke", "output")
    }
    for run, temperature in enumerate(temperatures):
        missed = stand.temperature * rng.standard_normal() if stand.temperature else 0.0
        k = unit.at(temperature + missed)
        bias = k["K0"] + k["K1"] * stand.launch * rng.standard_normal()
        scale = k["K1"] * (1.0 + stand.launch_sf * rng.standard_normal())
        noise = rng.standard_normal() if stand.neighbours else 0.0
        for stroke in range(1, strokes + 1):
            walk = range(positions + 1) if stroke % 2 else range(positions, -1, -1)
            for j in walk:
                noise *= stand.neighbours
                noise += math.sqrt(1.0 - stand.neighbours**2) * rng.standard_normal()
                beside = stand.stops * rng.standard_normal() if stand.stops else 0.0
                angle = j * step + math.radians(beside) + head[j % positions]
                a_i, a_p = math.cos(angle), side * math.sin(angle)
                output = (
                    bias
                    + scale * a_i
                    + k["K2"] * a_i * a_i
                    + k["K3"] * a_i * a_i * a_i
                    + k["M"] * a_p
                    + k["M_ip"] * a_i * a_p
                    + k["K1"] * stand.reading * noise * (1.0 + (stand.across - 1.0) * abs(a_p))
                )
                if stand.wrong and rng.random() < stand.wrong:
                    output += k["K1"] * stand.reading * rng.uniform(-30.0, 30.0)
                if stand.step:
                    output = stand.step * round(output / stand.step)
                row = (run, temperature, 360.0 * j / positions + beside, stroke, output)
                for name, value in zip(columns, row, strict=True):
                    columns[name].append(value)
    return columns


def samples(
    columns: dict[str, list[float]], unit: Unit, kind: str, rng: np.random.Generator
) -> dict[str, list[float]]:
    """Columns std and, unless the kind says without, count of the samples of each reading.

    Of a few samples, as "5", the std is theirs. Of 10,000 it is of what the strokes do not show: it
    is five times larger near 0 and 180 deg, or differs from reading to reading by chance.
    """
    if kind[0].isdigit():
        few, size = int(kind.split()[0]), len(columns["angle"])
        u = 5e-6 * unit.K1 * np.sqrt(rng.chisquare(few - 1, size) / (few - 1))
        if kind.endswith("without n"):
            return {"std": u.tolist()}
        return {"std": (u * math.sqrt(few)).tolist(), "count": [float(few)] * size}
    turned = np.abs(np.cos(np.radians(columns["angle"])))
    random = np.exp(0.7 * rng.standard_normal(turned.size))
    std = 6e-6 * unit.K1 * (random if kind == "random" else 1.0 + 4.0 * turned)
    return {"std": std.tolist(), "count": [10_000.0] * turned.size}
