"""How often the 95 % intervals of a triad hold, and how wide they are, with errors of attitudes.

Attitudes, their errors and the outputs are made here by rotations, with numpy alone. Each attitude
has an error of its own in all visits, about the shaft or, for faces, about any axis, and the block
may sit a little turned on each shaft, about any axis. Run::

    python benchmarks/triad.py --blocks 1000
    python benchmarks/triad.py --blocks 1000 --untold  # turns count as errors of single attitudes
"""

from __future__ import annotations

import argparse

import numpy as np

import accelcal
from accelcal.triad.record import TriadRecord

BIAS = np.array([0.02, -0.05, 0.1])
SCALE = np.array([1.3, 0.9, 1.1])
AXES = np.array([[1.0, 0.003, -0.005], [0.006, 1.0, 0.003], [-0.006, 0.002, 1.0]])
AXES /= np.linalg.norm(AXES, axis=1)[:, None]
NORMAL_FACTOR = 1.96

CASES = (
    ("six faces", 1, 1e-3, 1e-5, 0.0),
    ("six faces", 3, 1e-3, 1e-5, 0.0),
    ("six faces", 6, 1e-3, 1e-5, 0.0),
    ("six faces", 6, 1e-4, 1e-5, 0.0),
    ("six faces", 6, 1e-5, 1e-5, 0.0),
    ("six faces", 6, 3e-3, 1e-6, 0.0),
    ("x, y, z by 90 deg", 1, 1e-3, 1e-5, 0.0),
    ("x, y, z by 90 deg", 3, 1e-3, 1e-5, 0.0),
    ("x, y, z by 45 deg", 1, 1e-4, 1e-5, 0.0),
    ("x, y, z by 45 deg", 3, 1e-4, 1e-5, 0.0),
    ("z, x by 45 deg", 3, 1e-4, 1e-5, 0.0),
    ("x, y, z by 45 deg", 1, 0.0, 1e-5, 0.0),
    ("x, y, z by 45 deg", 1, 0.0, 1e-5, 1e-5),
    ("x, y, z by 45 deg", 1, 0.0, 1e-5, 1e-4),
    ("x, y, z by 45 deg", 1, 1e-4, 1e-5, 1e-4),
    ("z, x by 45 deg", 1, 0.0, 1e-5, 0.0),
    ("z, x by 45 deg", 1, 0.0, 1e-5, 1e-4),
)
"""Attitudes, visits, errors of attitudes [rad], noise [g], turns of the block on a shaft [rad]."""


def attitudes(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Directions up, and the axes of the shaft; all zeros where there is none."""
    if name == "six faces":
        return np.vstack([np.eye(3), -np.eye(3)]), np.zeros((6, 3))
    shafts, step = name.split(" by ")
    angles = np.radians(np.arange(0.0, 360.0, float(step.split()[0])))
    up, shaft = [], []
    for axis in shafts.split(", "):
        first, second, third = np.roll(np.eye(3), -"xyz".index(axis), axis=0)
        up += [np.cos(angle) * second + np.sin(angle) * third for angle in angles]
        shaft += [first] * len(angles)
    return np.array(up), np.array(shaft)


def turned(rng: np.random.Generator, up: np.ndarray, shaft: np.ndarray, size: float) -> np.ndarray:
    """Directions after an error of each attitude."""
    free = ~shaft.any(axis=1)[:, None]
    turn = np.where(free, rng.normal(size=up.shape), shaft * rng.normal(size=(len(up), 1))) * size
    return rotated(up, turn)


def rotated(up: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Directions turned by an angle about an axis each, the product of both given."""
    angle = np.linalg.norm(turn, axis=1)[:, None]
    axis = turn / np.maximum(angle, 1e-300)
    along = np.sum(axis * up, axis=1)[:, None] * axis
    return up * np.cos(angle) + np.cross(axis, up) * np.sin(angle) + along * (1.0 - np.cos(angle))


def truth() -> dict[str, float]:
    """What is true of the block."""
    named = {f"b_{a}": BIAS[i] for i, a in enumerate("xyz")}
    named |= {f"K_{a}": SCALE[i] for i, a in enumerate("xyz")}
    return named | {
        f"m_{a}{b}": AXES[i, j] for i, a in enumerate("xyz") for j, b in enumerate("xyz") if i != j
    }


def tried(
    rng: np.random.Generator,
    name: str,
    visits: int,
    error: float,
    noise: float,
    seat: float,
    *,
    told: bool = True,
) -> dict:
    """Error and half width of each result of one block, whose shafts are told or not."""
    up, shaft = attitudes(name)
    felt = turned(rng, up, shaft, error)
    if seat:
        felt = rotated(felt, shaft @ rng.normal(scale=seat, size=(3, 3)))  # a row for each shaft
    felt = np.tile(felt, (visits, 1))
    output = BIAS + SCALE * (felt @ AXES.T + noise * rng.normal(size=felt.shape))
    names = tuple(str(number) for number in range(len(up))) * visits
    shafts = tuple(map(str, shaft.tolist())) * visits if told and shaft.any() else None
    record = TriadRecord(output, np.tile(up, (visits, 1)), attitude=names, shaft=shafts)
    rows = {row["quantity"]: row for row in accelcal.calibrate_triad(record).rows()}
    return {
        what: (rows[what]["value"] - true, rows[what]["expanded_uncertainty"])
        for what, true in truth().items()
    }


def main() -> None:
    """Simulate and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--blocks", type=int, default=400)
    parser.add_argument("--smoke", action="store_true", help="few blocks, to see that it works")
    parser.add_argument(
        "--untold", action="store_true", help="turns on shafts that the record does not name"
    )
    options = parser.parse_args()
    untold = [case for case in CASES if case[-1]]
    print("% of intervals that hold, the fewest, and U over 1.96 rms errors, the widest")
    print("| attitudes | visits | errors | noise | turns | K | U | m | U | b | U |")
    print("| --- " * 11 + "|")
    for case in CASES[1:2] if options.smoke else untold if options.untold else CASES:
        rng = np.random.default_rng(1)
        number = 30 if options.smoke else options.blocks
        blocks = [tried(rng, *case, told=not options.untold) for _ in range(number)]
        told = []
        for kind in "Kmb":
            names = [what for what in truth() if what[0] == kind]
            found = np.array([[block[what] for what in names] for block in blocks])
            off, wide = found[:, :, 0], found[:, :, 1]
            held = 100.0 * np.mean(np.abs(off) <= wide, axis=0)
            width = wide.mean(axis=0) / (NORMAL_FACTOR * np.sqrt(np.mean(off**2, axis=0)))
            told.append(f"{held.min():.1f} | {width.max():.2f}")
        settings = " | ".join(map(str, case[:2])) + "".join(f" | {size:g}" for size in case[2:])
        print(f"| {settings} | {' | '.join(told)} |", flush=True)


if __name__ == "__main__":
    main()
