"""How often the uncertainties of ``accelcal apply`` hold the acceleration, in a new launch or not.

The tests are drawn here, by numpy alone: reading noise, errors of the head that stay at their
position, and shifts of bias and scale factor from run to run. Each is calibrated as a user would,
and the calibration is applied to outputs of a launch that it has not seen, and of its last run by
``same_launch``. Run ``python benchmarks/apply_coverage.py`` (two minutes) or with ``--smoke``
(seconds)::

    python benchmarks/apply_coverage.py --units 300
"""

from __future__ import annotations

import argparse
import warnings
from typing import NamedTuple

import numpy as np

import accelcal

NOISE, HEAD, LAUNCH, LAUNCH_SF = 5e-6, 6.7e-6, 6.7e-6, 5e-6  # [g], [rad], [g], relative
SIZES = {
    "head_uncertainty": HEAD,
    "launch_uncertainty": LAUNCH,
    "launch_sf_uncertainty": LAUNCH_SF,
}
POSITIONS, T0 = 8, 20.0

IN_USE = np.tile(np.radians([0.0, 60.0, 90.0, 120.0, 180.0]), 3)
TEMPERATURES = np.repeat([20.0, 65.0, -30.0], 5)


class Case(NamedTuple):
    """What a test declares, and the temperatures of its runs."""

    name: str
    levels: tuple[float, ...]
    declared: tuple[str, ...] = ()
    laws: str = "tables"
    strokes: int = 6


CASES = (
    Case("all declared, 20, 80, -40 degC", (20.0, 80.0, -40.0), tuple(SIZES)),
    Case("the same, laws from all readings", (20.0, 80.0, -40.0), tuple(SIZES), "readings"),
    Case("nothing declared, 20, 80, -40 degC twice", 2 * (20.0, 80.0, -40.0)),
    Case("nothing declared, 20 degC three times, 80, -40 degC", (20.0, 20.0, 20.0, 80.0, -40.0)),
    Case("the same, the head declared", (20.0, 20.0, 20.0, 80.0, -40.0), ("head_uncertainty",)),
    Case("the same, 20 degC twice", (20.0, 20.0, 80.0, -40.0), ("head_uncertainty",)),
    Case("the same, two runs at 20 degC alone", (20.0, 20.0), ("head_uncertainty",)),
    Case("all declared, 20 degC, one stroke", (20.0,), tuple(SIZES), strokes=1),
    Case("all declared, 20 degC, two strokes", (20.0,), tuple(SIZES), strokes=2),
    Case("launches declared, 20 degC", (20.0,), ("launch_uncertainty", "launch_sf_uncertainty")),
)


def output(angle, temperature, bias=0.0, scale_factor=0.0):
    """Output by equation (1) in its product form, of the AL-15 of the paper [mA]."""
    rise = temperature - T0
    warm = rise > 0.0
    K1 = 1.35 * (1.0 + np.where(warm, 520e-6, 480e-6) * rise) * (1.0 + scale_factor)
    k0 = 3.324e-3 + np.where(warm, -3.9e-5, -4.5e-5) * rise + bias
    a_i, a_p = np.cos(angle), np.sin(angle)
    terms = a_i + 105e-6 * a_i**2 + 87e-6 * a_i**3 + 1.15e-3 * a_p + 2e-5 * a_i * a_p
    return K1 * (k0 + terms)


def calibrated(
    case: Case, random: np.random.Generator
) -> tuple[accelcal.Calibration, tuple[float, float]]:
    """Draw the readings of a test, and calibrate; shifts of the last run."""
    order = np.arange(POSITIONS + 1)
    place = np.concatenate([order[:: (-1) ** k] for k in range(case.strokes)])
    angle = 2.0 * np.pi * place / POSITIONS
    angle = angle + random.normal(0.0, HEAD, POSITIONS)[place % POSITIONS]
    shifts = [(random.normal(0.0, LAUNCH), random.normal(0.0, LAUNCH_SF)) for _ in case.levels]
    runs = [output(angle, T, *shift) for T, shift in zip(case.levels, shifts, strict=True)]
    size = len(case.levels)
    columns = {
        "temperature": np.repeat(case.levels, place.size),
        "run": np.repeat(np.arange(size), place.size).astype(str),
        "position": np.tile(place + 1, size),
        "stroke": np.tile(np.repeat(np.arange(case.strokes) + 1, POSITIONS + 1), size),
        "output": np.concatenate(runs) + random.normal(0.0, 1.35 * NOISE, size * place.size),
    }
    declared = {name: SIZES[name] for name in case.declared}
    known = {"unit": "mA", "reference_temperature": T0, **declared}
    record = accelcal.read_arrays(columns, overrides=known)
    return accelcal.fit(record, temperature_laws=case.laws), shifts[-1]


def held(case: Case, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Whether 1.96 u and U hold the acceleration at each point: new launch, and last run."""
    warnings.simplefilter("ignore", accelcal.AccelcalWarning)
    random = np.random.default_rng(seed)
    calibration, last = calibrated(case, random)
    shift = random.normal(0.0, LAUNCH), random.normal(0.0, LAUNCH_SF)

    def holds(at: np.ndarray, temperature: np.ndarray, shift: tuple, *, same: bool) -> np.ndarray:
        shown = output(at, temperature, *shift)
        found = accelcal.apply(calibration, shown, temperature, a_p=np.sin(at), same_launch=same)
        error = np.abs(found.value - np.cos(at))
        widths = 1.96 * found.standard_uncertainty, found.expanded_uncertainty
        return np.array([error <= width for width in widths])

    there = np.full(5, case.levels[-1])
    one_level = len(set(case.levels)) == 1
    return (
        holds(IN_USE, np.tile(there, 3) if one_level else TEMPERATURES, shift, same=False),
        holds(IN_USE[:5], there, last, same=True),
    )


def main() -> None:
    """Simulate and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--units", type=int, default=300)
    parser.add_argument("--smoke", action="store_true", help="few units, to see that it works")
    options = parser.parse_args()
    print("| what is known | % by 1.96 u (worst point) | % by U (worst point) |", end="")
    print(" last run, by 1.96 u | by U |")
    print("| --- " * 5 + "|")
    for case in CASES[:1] if options.smoke else CASES:
        found = [held(case, seed) for seed in range(2 if options.smoke else options.units)]
        shares = [100.0 * np.mean(own, axis=0) for own in zip(*found, strict=True)]
        told = [f"{own.mean():.1f} ({own.min():.1f})" for both in shares for own in both]
        print(f"| {case.name} | {' | '.join(told)} |", flush=True)


if __name__ == "__main__":
    main()
