"""What ``accelcal apply`` gains where a discovery named a static effect of the accelerometer.

Each unit has one hidden effect. Its test is discovered and fitted with the model found, and the
calibration is applied to outputs at 200 positions of a turn, in three new launches at 20, 65 and
-30 degC with the noise of a reading. Run ``python benchmarks/static_effects.py`` (ten minutes) or
with ``--smoke`` (seconds)::

    python benchmarks/static_effects.py --units 40 --jobs 2
"""

from __future__ import annotations

import argparse
import dataclasses
import warnings
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import NamedTuple

import numpy as np

import accelcal
from accelcal.geometry import accelerations
from accelcal.simulation import NoiseComponents

NOISE = 5e-6  # of a reading [g]
IN_USE = accelcal.TumblePlan(
    angles=tuple(np.linspace(0.9, 358.2, 200)), strokes=1, temperatures=(20.0, 65.0, -30.0)
)
THREE, FIVE = (20.0, 80.0, -40.0), (20.0, 50.0, 80.0, -10.0, -40.0)


class Case(NamedTuple):
    """A hidden effect, and the test that is to find it."""

    effect: str
    size: float
    positions: int
    temperatures: tuple[float, ...] = THREE


CASES = (
    Case("scale-factor-asymmetry", 187e-6, 8),
    Case("scale-factor-asymmetry", 187e-6, 16),
    Case("fourth-order", 1e-4, 16),
    Case("dead-zone", 5e-5, 16),
    Case("k2-temperature", 1e-6, 8, FIVE),
)


class Outcome(NamedTuple):
    """Errors of one unit in use [g], and whether the effect was named alone."""

    named: bool
    without: np.ndarray
    error: np.ndarray
    held: np.ndarray


def outcome(case: Case, seed: int) -> Outcome:
    """Discover, fit and apply one unit."""
    warnings.simplefilter("ignore", accelcal.AccelcalWarning)
    hidden = accelcal.effect(case.effect).of(case.size)
    plan = accelcal.TumblePlan(positions=case.positions, temperatures=case.temperatures)
    record = accelcal.simulate(plan=plan, effects=[hidden], seed=seed)
    model = accelcal.discover(record)
    calibration = accelcal.fit(record, model=model)
    # no head turns the unit in use: it stands where it is
    noise = NoiseComponents(reading=NOISE, head=0.0)
    used = accelcal.simulate(plan=IN_USE, noise=noise, effects=[hidden], seed=10**6 + seed)
    acted = accelerations(used.angle)
    measure = partial(
        accelcal.apply,
        output=used.output,
        temperature=used.temperature,
        a_p=acted.pendulous,
        output_uncertainty=NOISE * calibration.tables[0].coefficients["K1"].value,
    )
    found = measure(calibration)
    plain = measure(dataclasses.replace(calibration, effects=()))
    error = found.value - acted.input
    held = np.abs(error) <= 1.96 * found.standard_uncertainty
    named = [effect.id for effect in model.effects] == [case.effect]
    return Outcome(named, plain.value - acted.input, error, held)


def told(case: Case, outcomes: list[Outcome]) -> str:
    """One line of the table, of the units whose effect was named."""
    good = [own for own in outcomes if own.named]
    what = f"| {case.effect} {case.size:g} | {case.positions} | {len(case.temperatures)} "
    if not good:
        return f"{what}| 0 of {len(outcomes)} |  |  |  |  |"
    without, error = (
        1e6 * np.array([getattr(own, n) for own in good]) for n in Outcome._fields[1:3]
    )
    held = np.array([own.held for own in good])
    sizes = [f"{np.sqrt((e**2).mean()):.0f} ({np.abs(e).max():.0f})" for e in (without, error)]
    worst = 100.0 * held.reshape(-1, len(IN_USE.angles or ())).mean(axis=0).min()
    return (
        f"{what}| {len(good)} of {len(outcomes)} | {sizes[0]} | {sizes[1]} |"
        f" {100.0 * held.mean():.1f} | {worst:.0f} |"
    )


def main() -> None:
    """Simulate and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--units", type=int, default=40)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--smoke", action="store_true", help="few units, to see that it works")
    options = parser.parse_args()
    units, cases = (2, CASES[:1]) if options.smoke else (options.units, CASES)
    print("| hidden effect | positions | levels | named | ug without it, rms (largest) |", end="")
    print(" ug with it | % held by 1.96 u | % at the worst position |")
    print("| --- " * 8 + "|")
    with ProcessPoolExecutor(options.jobs) as pool:
        for case in cases:
            print(
                told(case, list(pool.map(partial(outcome, case), range(1, units + 1)))), flush=True
            )


if __name__ == "__main__":
    main()
