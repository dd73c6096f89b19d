"""How often U holds the truth between levels, by levels and by laws, where the truth is curved.

The tests are drawn here, by numpy alone, of units whose bias, scale factor and misalignment follow
a curve in temperature: the laws, a parabola, a cubic, waves. Each is calibrated as a user would;
coefficients at many temperatures between the levels, and accelerations of new launches there, are
compared with the truth. Run ``python benchmarks/levels_coverage.py`` (half an hour) or with
``--smoke`` (seconds)::

    python benchmarks/levels_coverage.py --units 200
"""

from __future__ import annotations

import argparse
import warnings
from itertools import pairwise
from typing import NamedTuple

import numpy as np

import accelcal

NOISE, HEAD, LAUNCH, LAUNCH_SF = 5e-6, 6.7e-6, 6.7e-6, 5e-6  # [g], [rad], [g], relative
DECLARED = {
    "head_uncertainty": HEAD,
    "launch_uncertainty": LAUNCH,
    "launch_sf_uncertainty": LAUNCH_SF,
}
POSITIONS, STROKES, T0, NEW_LAUNCHES = 8, 4, 20.0, 5
K1, NAMES = 1.35, ("k0", "K1", "delta")

THREE, TWICE = (20.0, 80.0, -40.0), 2 * (20.0, 80.0, -40.0)
FOUR, SEVEN = (-40.0, 0.0, 40.0, 80.0), (-40.0, -20.0, 0.0, 20.0, 40.0, 60.0, 80.0)
UNEVEN = (-40.0, 10.0, 20.0, 30.0, 80.0)
LOOP = (-40.0, -10.0, 20.0, 50.0, 80.0, 50.0, 20.0, -10.0, -40.0)


def bilinear(rise):
    """Laws of the AL-15 of the paper: k0 [g], K1 relative, delta [rad], less those at T0."""
    warm = rise > 0.0
    slopes = ((-3.9e-5, -4.5e-5), (520e-6, 480e-6), (1.5e-6, 1.2e-6))
    return np.array([np.where(warm, above, below) * rise for above, below in slopes])


SIZES = np.array([[1.0], [7.0], [0.2]])
"""Of curves of k0, of K1 and of delta, one to another."""


def straight(rise):
    """One slope each."""
    return np.array([-4.2e-5, 500e-6, 1.3e-6])[:, None] * rise


def parabola(size):
    """Parabola that leaves the chord over 60 degC by a size of k0 [g]."""
    return lambda rise: straight(rise) + SIZES * size * (rise / 30.0) ** 2


def cubic(rise):
    """Cubic with its turn at T0."""
    return straight(rise) + SIZES * 3e-5 * (rise / 30.0) ** 3


def waves(rise):
    """Waves of 150 degC."""
    return straight(rise) + SIZES * 3e-5 * np.sin(2.0 * np.pi * (rise + 11.0) / 150.0)


class Case(NamedTuple):
    """A truth, and the temperatures of the runs."""

    name: str
    truth: object
    levels: tuple[float, ...]
    loop: float = 0.0
    declared: bool = True


CASES = (
    Case("laws; 3 levels", bilinear, THREE),
    Case("laws; 4 levels, T0 between them", bilinear, FOUR),
    Case("laws; 7 levels", bilinear, SEVEN),
    Case("straight; 3 levels", straight, THREE),
    Case("straight; 3 levels twice, nothing declared", straight, TWICE, declared=False),
    Case("straight; levels -40, 10, 20, 30, 80", straight, UNEVEN),
    Case("straight; 5 levels up and down, loop 30 ug", straight, LOOP, 3e-5),
    Case("parabola of 3 ug; 3 levels", parabola(3e-6), THREE),
    Case("parabola of 10 ug; 3 levels", parabola(1e-5), THREE),
    Case("parabola of 100 ug; 3 levels", parabola(1e-4), THREE),
    Case("parabola of 10 ug; 7 levels", parabola(1e-5), SEVEN),
    Case("parabola of 30 ug; levels -40, 10, 20, 30, 80", parabola(3e-5), UNEVEN),
    Case("parabola of 30 ug; 5 levels up and down, loop 30 ug", parabola(3e-5), LOOP, 3e-5),
    Case("cubic; 3 levels", cubic, THREE),
    Case("cubic; 4 levels", cubic, FOUR),
    Case("cubic; 7 levels", cubic, SEVEN),
    Case("waves; 3 levels", waves, THREE),
    Case("waves; 4 levels", waves, FOUR),
    Case("waves; 7 levels", waves, SEVEN),
)


def output(truth, angle, temperature, bias=0.0, scale_factor=0.0):
    """Output by equation (1) in its product form [mA]."""
    k0, relative, delta = truth(np.asarray(temperature) - T0)
    a_i, a_p = np.cos(angle), np.sin(angle)
    terms = a_i + 105e-6 * a_i**2 + 87e-6 * a_i**3 + (1.15e-3 + delta) * a_p + 2e-5 * a_i * a_p
    return K1 * (1.0 + relative) * (1.0 + scale_factor) * (3.324e-3 + k0 + bias + terms)


def calibrated(case: Case, random: np.random.Generator) -> accelcal.Calibration:
    """Draw the readings of a test, and calibrate."""
    order = np.arange(POSITIONS + 1)
    place = np.concatenate([order[:: (-1) ** k] for k in range(STROKES)])
    angle = 2.0 * np.pi * place / POSITIONS
    angle = angle + random.normal(0.0, HEAD, POSITIONS)[place % POSITIONS]
    size = len(case.levels)
    reached = np.sign(np.diff(case.levels, prepend=case.levels[0]))
    branch = np.where(np.isin(case.levels, (min(case.levels), max(case.levels))), 0.0, reached)
    bias = random.normal(0.0, LAUNCH, size) + case.loop * branch
    scale = random.normal(0.0, LAUNCH_SF, size)
    runs = [
        output(case.truth, angle, np.full(angle.size, T), bias[i], scale[i])
        for i, T in enumerate(case.levels)
    ]
    columns = {
        "temperature": np.repeat(case.levels, place.size),
        "run": np.repeat(np.arange(size), place.size).astype(str),
        "position": np.tile(place + 1, size),
        "stroke": np.tile(np.repeat(np.arange(STROKES) + 1, POSITIONS + 1), size),
        "output": np.concatenate(runs) + random.normal(0.0, K1 * NOISE, size * place.size),
    }
    declared = DECLARED if case.declared else {}
    known = {"unit": "mA", "reference_temperature": T0, **declared}
    return accelcal.fit(accelcal.read_arrays(columns, overrides=known))


def between(levels: tuple[float, ...]) -> np.ndarray:
    """Temperatures at the levels, and at the quarters of each interval."""
    own = np.unique(levels)
    steps = (low + np.arange(5) / 4.0 * (high - low) for low, high in pairwise(own))
    return np.unique(np.concatenate(list(steps)))


def held(case: Case, seed: int) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """By levels and by laws: whether U holds coefficients, accelerations, and U of k0 [g]."""
    warnings.simplefilter("ignore", accelcal.AccelcalWarning)
    random = np.random.default_rng(seed)
    calibration = calibrated(case, random)
    temperatures = between(case.levels)
    truth = case.truth(temperatures - T0) + np.array([[3.324e-3], [1.0], [1.15e-3]])
    truth[1] *= K1
    branch = random.choice([-1.0, 1.0])
    truth[0] += case.loop * branch  # in use it is on one of the branches
    angle = np.radians([0.0, 60.0, 90.0, 180.0])
    at, there = np.tile(angle, temperatures.size), np.repeat(temperatures, angle.size)
    launches = [
        (random.normal(0.0, LAUNCH) + case.loop * branch, random.normal(0.0, LAUNCH_SF))
        for _ in range(NEW_LAUNCHES)
    ]
    shown = np.array([output(case.truth, at, there, *shift) for shift in launches])
    told = []
    for by in ("levels", "laws"):
        found = [accelcal.coefficients_at(calibration, float(T), by=by) for T in temperatures]
        values, U = (
            np.array([[getattr(one[name], what) for one in found] for name in NAMES])
            for what in ("value", "expanded_uncertainty")
        )
        measured = accelcal.apply(calibration, shown, there, a_p=np.sin(at), by=by)
        good = np.abs(measured.value - np.cos(at)) <= measured.expanded_uncertainty
        told.append((np.abs(values - truth) <= U, good.mean(axis=0), U[0]))
    return told


def main() -> None:
    """Simulate and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--units", type=int, default=200)
    parser.add_argument("--smoke", action="store_true", help="few units, to see that it works")
    options = parser.parse_args()
    print("| truth and test |", end="")
    for by in ("levels", "laws"):
        print(f" by {by}: coefficients | accelerations | largest U(k0), ug |", end="")
    print("\n" + "| --- " * 7 + "|")
    for case in CASES[:1] if options.smoke else CASES:
        found = [held(case, seed) for seed in range(2 if options.smoke else options.units)]
        told = []
        for own in zip(*found, strict=True):
            for shares in list(zip(*own, strict=True))[:2]:
                share = 100.0 * np.mean(shares, axis=0)
                told.append(f"{share.mean():.1f} ({share.min():.1f})")
            told.append(f"{1e6 * np.mean([each[2] for each in own], axis=0).max():.0f}")
        print(f"| {case.name} | {' | '.join(told)} |", flush=True)


if __name__ == "__main__":
    main()
