"""False alarms and power of `accelcal compare OLD.json NEW.json`.

Run ``python benchmarks/two_calibrations.py`` (minutes) or with ``--smoke`` (seconds). Both tests
come from `tumble`, as those of `compare.py`, whose regimes are used: one unit, measured twice on
one head or on two. The last column is the share of units of which a bias that is larger by 30 ug at
the second test is seen by the joint test. Below are sizes of effects that both calibrations carry,
of tests that `accelcal.simulate` makes.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace

import numpy as np
from compare import REGIMES, UNITS, Regime, heads, record_of

import accelcal

NAMES = ("k0", "K1", "k2", "k3", "delta", "delta_ip")
MORE = 30e-6
HIGHEST = 8.0
SIZES = {"backlash": 2e-4, "hysteresis": 3e-4, "scale-factor-asymmetry": 4e-4}


def trial(regime: Regime, seed: int) -> tuple[list[float], list[float], bool]:
    """Whether |E_n| is above 1, NaN if not compared; the chances; whether a larger bias is seen."""
    rng = np.random.default_rng(seed)
    first, second = (record_of(regime, i, head, rng) for i, head in enumerate(heads(regime, rng)))
    old = accelcal.fit(first, method=regime.method)

    def compared(record: accelcal.TumbleRecord) -> accelcal.CalibrationComparison:
        new = accelcal.fit(record, method=regime.method)
        return accelcal.compare_calibrations(old, new, same_head=regime.told)

    found = compared(second)
    told = {change.coefficient: float(not change.agrees) for change in found.coefficients}
    point = found.indicated[-1].difference
    beyond = abs(point.value) > point.expanded_uncertainty
    anywhere = not all(own.agrees for own in found.indicated)
    moved = replace(second, output=second.output + UNITS["o"].K1 * MORE)
    apart = [*(told.get(name, np.nan) for name in NAMES), float(beyond), float(anywhere)]
    return (
        apart,
        [found.joint.p_value < level for level in (0.05, 0.01)],
        compared(moved).verdict == "disagree",
    )


def sizes(name: str, size: float, trials: int) -> tuple[float, float]:
    """Percent of |E_n| > 1 of the size of an effect, and of disagreement, where none changes."""
    plan = accelcal.TumblePlan(temperatures=(20.0,), positions=16)
    effects = [accelcal.effect(name).of(size)]
    model = accelcal.discover(accelcal.simulate(plan=plan, effects=effects, seed=1))
    apart, disagreed = 0, 0
    for trial in range(trials):
        old, new = (
            accelcal.fit(accelcal.simulate(plan=plan, effects=effects, seed=seed), model=model)
            for seed in (2 * trial + 2, 2 * trial + 3)
        )
        found = accelcal.compare_calibrations(old, new, same_head=False)
        apart += not found.sizes[0].agrees
        disagreed += found.verdict == "disagree"
    return 100.0 * apart / trials, 100.0 * disagreed / trials


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--trials", type=int, default=500)
    parser.add_argument("--smoke", action="store_true", help="a few trials only")
    parser.add_argument("--only", default="", help="regimes with this in their name")
    asked = parser.parse_args()
    trials = 5 if asked.smoke else asked.trials
    told = "percent with |E_n| > 1, at +1 g and anywhere too, with p below, and seen"
    print(f"{trials} trials a line; {told}")
    heading = (*NAMES, "at 1 g", "anywhere", "p < 0.05", "p < 0.01", "30 ug")
    print(" " * 40 + "".join(f"{name:>9}" for name in heading))
    bad = 0
    for regime in REGIMES:
        if asked.only not in regime.name:
            continue
        found = zip(*(trial(regime, seed) for seed in range(trials)), strict=True)
        shares = np.concatenate([100.0 * np.mean(part, axis=0).reshape(-1) for part in found])
        cells = ["-" if np.isnan(share) else f"{share:.1f}" for share in shares]
        print(f"{regime.name:40}" + "".join(f"{cell:>9}" for cell in cells), flush=True)
        bad += int(np.nanmax(shares[:-1]) > HIGHEST)
    for name, size in SIZES.items():
        row = f"size of {name}"
        if asked.only in row:
            share, disagreed = sizes(name, size, trials)
            print(f"{row:40}{share:9.1f} with |E_n| > 1, {disagreed:.1f} disagree", flush=True)
            bad += int(share > HIGHEST)
    return 1 if bad and not asked.smoke else 0


if __name__ == "__main__":
    sys.exit(main())
