"""Units on one head, clamped at several angles: by vectors, not by the columns of a model.

Each reading asks in which direction gravity pulls in the frame of the unit, and the sensor answers
with a polynomial of what its axes feel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

NOISE = 4e-6
"""Of one reading [g]."""


@dataclass(frozen=True)
class ClampedUnit:
    """What is true of a unit, and its table.

    Attributes
    ----------
    k2, k3, delta_ip : float
        Second and third order, and cross-coupling [g/g^n].
    text : str
        The long CSV.
    """

    k2: float
    k3: float
    delta_ip: float
    text: str


def units_on_one_head(
    rng: np.random.Generator,
    *,
    units: int = 1,
    clampings: Sequence[float] = (0.0, 90.0),
    positions: int = 8,
    strokes: int = 4,
    head: float = 2e-5,
    launch: float = 2e-5,
) -> tuple[np.ndarray, list[ClampedUnit]]:
    """Measure units on one head.

    Parameters
    ----------
    rng : numpy.random.Generator
        Everything random comes from it.
    units : int
        Number of units.
    clampings : sequence of float
        Angles at which the fixture of each is clamped; each is a run [deg].
    positions, strokes : int
        Of each run.
    head : float
        Standard deviation of the errors of the graduation [rad].
    launch : float
        Standard deviation of the bias from run to run [g].

    Returns
    -------
    graduation : ndarray
        True errors of the head at the multiples of 360 deg / positions [rad].
    units : list of ClampedUnit
        What is true of each, and its table.
    """
    graduation = head * rng.standard_normal(positions)
    made = [
        _unit(rng, f"unit {n + 1}", graduation, clampings, strokes, head, launch)
        for n in range(units)
    ]
    return graduation, made


def _unit(
    rng: np.random.Generator,
    serial: str,
    graduation: np.ndarray,
    clampings: Sequence[float],
    strokes: int,
    head: float,
    launch: float,
) -> ClampedUnit:
    gain, twist = 1.3 * (1 + 1e-3 * rng.standard_normal()), 1e-3 * rng.standard_normal()
    k2, k3, delta_ip = 1e-4 * rng.standard_normal(3)
    bias = 3e-3 * rng.standard_normal()
    lines = [f"# serial: {serial}", "# unit: mA", "# T0: 20", f"# head_uncertainty: {head:g}"]
    lines += [
        f"# launch_uncertainty: {launch:g}",
        "temperature,run,clamping,position,stroke,output",
    ]
    step = 2.0 * np.pi / graduation.size
    for clamping in clampings:
        own_bias = bias + launch * rng.standard_normal()
        askew = 1e-4 * rng.standard_normal()  # of the fixture in this clamp
        shift = round(np.radians(clamping) / step)
        for stroke in range(1, strokes + 1):
            order = range(graduation.size + 1) if stroke % 2 else range(graduation.size, -1, -1)
            for place in order:
                turn = complex(np.exp(1j * (place * step + askew)))
                turn *= np.exp(1j * graduation[(place + shift) % graduation.size])
                along, across = turn.real, turn.imag
                felt = along + twist * across
                answer = own_bias + felt + k2 * along**2 + k3 * along**3 + delta_ip * along * across
                output = gain * (answer + NOISE * rng.standard_normal())
                lines.append(f"20,{clamping:g},{clamping:g},{place + 1},{stroke},{output:.9f}")
    return ClampedUnit(k2, k3, delta_ip, "\n".join(lines) + "\n")
