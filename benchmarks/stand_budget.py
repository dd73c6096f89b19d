"""Budget of a stand against simulated tests: the spread of the results over what is foreseen.

Run ``python benchmarks/stand_budget.py`` (a minute) or with ``--smoke`` (seconds). The tests come
from `tumble`, which shares no code with accelcal: head positions, launches, temperatures and noise
are drawn anew for each, and each is calibrated as a user would, by least squares and by the closed
form. A ratio of 1 says that the budget foresees the spread. Least squares of accelcal take out of
the readings what the residuals show of the head's errors, which a budget made before the test
cannot.
"""

from __future__ import annotations

import argparse

import numpy as np
from tumble import Stand, Unit, readings

import accelcal
from accelcal.stand_uncertainty.distribution import Distribution

SIZES = {
    "head-position": 1.15e-5,
    "reading-noise": 5e-6,
    "launch-bias": 6.7e-6,
    "launch-scale-factor": 5e-6,
    "chamber-temperature": 0.058,
}
VARIES = {
    "head-position": ("position",),
    "reading-noise": ("reading",),
    "launch-bias": ("run",),
    "launch-scale-factor": ("run",),
    "chamber-temperature": ("run",),
}
LEVELS = (20.0, 80.0, -40.0)
STAND = Stand(
    reading=SIZES["reading-noise"],
    head=SIZES["head-position"],
    launch=SIZES["launch-bias"],
    launch_sf=SIZES["launch-scale-factor"],
    temperature=SIZES["chamber-temperature"],
)
SYMBOLS = ("K1", "k0", "k2", "k3", "delta", "delta_ip", "lam1", "lam2", "beta1", "gam1")


def foreseen(record: accelcal.TumbleRecord, method: str) -> np.ndarray:
    """Standard uncertainties by the budget."""
    parts = tuple(
        accelcal.StandComponent(kind, kind, Distribution("normal", size), VARIES[kind])
        for kind, size in SIZES.items()
    )
    budget = accelcal.stand_budget(accelcal.Stand("simulated", parts), record, method=method)
    places = [budget.index(symbol) for symbol in SYMBOLS]
    return budget.standard_uncertainty[places]


def found(calibration: accelcal.Calibration) -> list[float]:
    """Results of one test."""
    table, laws = calibration.tables[0], calibration.temperature_model
    error = table.error_model
    values = [error[symbol].value for symbol in SYMBOLS[1:6]]
    slopes = [laws.k0.above, laws.k0.below, laws.K1.above, laws.delta.above]
    return [table.coefficients["K1"].value, *values, *(slope.value for slope in slopes)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--smoke", action="store_true", help="few tests, in seconds")
    parser.add_argument("--tests", type=int, help="how many")
    given = parser.parse_args()
    tests = given.tests or (40 if given.smoke else 1000)
    rng = np.random.default_rng(1)
    declared = {"reference_temperature": 20.0, "head_uncertainty": STAND.head}
    records = [
        accelcal.read_arrays(readings(Unit(), STAND, rng, temperatures=LEVELS), overrides=declared)
        for _ in range(tests)
    ]
    print(
        f"{tests} tests, spread over what the budget foresees, +- {100 / np.sqrt(2 * tests):.0f} %"
    )
    print(f"{'':14}" + "".join(f"{symbol:>10}" for symbol in SYMBOLS))
    for method in ("closed-form", "least-squares"):
        results = np.array([found(accelcal.fit(record, method=method)) for record in records])
        ratio = results.std(axis=0, ddof=1) / foreseen(records[0], method)
        print(f"{method:14}" + "".join(f"{value:10.3f}" for value in ratio))


if __name__ == "__main__":
    main()
