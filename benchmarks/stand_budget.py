"""Budget of a stand against simulated tests: the spread of the results over what is foreseen.

Run ``python benchmarks/stand_budget.py`` (a minute) or with ``--smoke`` (seconds). The tests come
from `tumble`, which shares no code with accelcal: head positions, launches, temperatures and noise
are drawn anew for each, and each is calibrated as a user would, by least squares and by the closed
form. A ratio of 1 says that the budget foresees the spread. Least squares of accelcal take out of
the readings what the residuals show of the head's errors, which a budget made before the test
cannot.

``--paper`` prints what becomes of the expanded uncertainties of the stand of the paper where one of
its components is better, or another.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from tumble import Stand, Unit, readings

import accelcal
from accelcal.stand_uncertainty.stand import Distribution, distribution

PAPER = Path(__file__).parents[1] / "examples" / "paper-stand.toml"

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


def variants() -> Iterator[tuple[str, accelcal.StandBudget]]:
    """Budgets of the stand of the paper, and of others like it."""
    stand, test = accelcal.read_stand(PAPER), timed()

    def better(*names: str) -> accelcal.StandBudget:
        factors = [0.1 if part.name in names else 1.0 for part in stand.components]
        return accelcal.stand_budget(stand.scaled(factors), test)

    def other(name: str, **fields: object) -> accelcal.StandBudget:
        parts = [replace(p, **fields) if p.name == name else p for p in stand.components]
        return accelcal.stand_budget(replace(stand, components=tuple(parts)), test)

    yield "as it is", accelcal.stand_budget(stand, test)
    for name in ("voltmeter", "head", "chamber", "load", "face"):
        yield f"{name} ten times better", better(name)
    yield "voltmeter, head, chamber, load", better("voltmeter", "head", "chamber", "load")
    yield (
        "voltmeter a gain of each range",
        other("voltmeter", kind="voltmeter-gain", varies=("range",)),
    )
    high = replace(stand.conditions, load=1000.0)
    yield "load of 1000 ohm", accelcal.stand_budget(replace(stand, conditions=high), test)
    wave = distribution("arcsine", half_width=20e-6)
    for order in (1, 2):
        fields = {"kind": "head-harmonic", "order": order, "varies": (), "distribution": wave}
        yield f"head a harmonic, order {order}", other("head", **fields)
    yield "24 strokes", accelcal.stand_budget(stand, timed(strokes=24))
    for positions in (12, 24):
        yield f"{positions} positions", accelcal.stand_budget(stand, timed(positions=positions))


def timed(**plan: int) -> accelcal.TumbleRecord:
    """A test with the times of its readings, a minute apart."""
    return accelcal.simulate(plan=accelcal.TumblePlan(**plan, timed=True), seed=0)


def print_paper() -> None:
    """Print the expanded uncertainties of the variants."""
    print("U (95 %) of the stand of the paper: K1 in ppm, beta in ppm/degC, the others in 1e-6")
    print(f"{'':32}" + "".join(f"{symbol:>9}" for symbol in SYMBOLS))
    for name, budget in variants():
        places = [budget.index(symbol) for symbol in SYMBOLS]
        scale = budget.nominal[places[0]]
        units = [1e-6 * scale if symbol == "K1" else 1e-6 for symbol in SYMBOLS]
        sizes = budget.expanded_uncertainty[places] / units
        print(f"{name:32}" + "".join(f"{size:9.3g}" for size in sizes))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--smoke", action="store_true", help="few tests, in seconds")
    parser.add_argument("--tests", type=int, help="how many")
    parser.add_argument("--paper", action="store_true", help="variants of the stand of the paper")
    given = parser.parse_args()
    if given.paper:
        print_paper()
        return
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
