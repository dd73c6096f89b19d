"""Predictions of `accelcal design` against Monte Carlo: simulate, fit, and look at the scatter.

Run ``python benchmarks/design.py`` (a quarter of an hour of one core) or with ``--smoke``
(seconds). Each design is simulated `DRAWS` times and fitted by the solver of `accelcal.fit` for
many tables of one plan, which is checked against `accelcal.fit` itself. The standard deviation of
each coefficient, error term and temperature slope is held against the standard uncertainty that was
foreseen. ``--gain`` asks instead what the best angles gain, and ``--harmonics`` what harmonics of
the head do to tests of different numbers of positions.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from itertools import product
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

import accelcal
from accelcal.estimate.joint import estimate_stack
from accelcal.estimate.tables import prepare
from accelcal.model import COEFFICIENTS, ERROR_TERMS
from accelcal.planning.prediction import figures, forecasts
from accelcal.simulation import AL15, NOISE_FREE, NoiseComponents, TumblePlan, simulate

Array = NDArray[np.float64]

DRAWS = 4000  # a standard deviation of them is uncertain by 1.1 %
SMOKE_DRAWS = 60
STACK = 500

POSITIONS = (6, 8, 12, 24)
STROKES = (2, 6)
LEVELS = ((20.0,), (-40.0, 20.0, 80.0))
REGIMES = {
    "noise": NoiseComponents(reading=2e-5, head=2e-6, launch=2e-6, launch_sf=2e-6),
    "head": NoiseComponents(reading=5e-6, head=2e-5, launch=2e-6, launch_sf=2e-6),
    "launch": NoiseComponents(reading=5e-6, head=2e-6, launch=2e-5, launch_sf=2e-5),
    "all": NoiseComponents(temperature=0.03),
}
UNDECLARED = "all, undeclared"
AT_T0 = {"lam": "k0 at T0", "beta": "K1 at T0", "gam": "delta at T0"}

HARMONICS = (1, 2, 3)
ANGLES_OF_PHASE = 6  # enough: errors are waves of the phase, whose mean square it tells

Design = tuple[str, TumblePlan]


def designs() -> Iterator[Design]:
    """All designs of the grid."""
    for levels, strokes, positions, regime in product(
        LEVELS, STROKES, POSITIONS, (*REGIMES, UNDECLARED)
    ):
        yield regime, TumblePlan(positions=positions, strokes=strokes, temperatures=levels)


def noise_of(regime: str) -> NoiseComponents:
    return REGIMES[regime.removesuffix(", undeclared")]


def simulated(regime: str, plan: TumblePlan, seeds: range) -> list[accelcal.TumbleRecord]:
    return [
        simulate(AL15, plan, noise_of(regime), seed=seed, declare=regime != UNDECLARED)
        for seed in seeds
    ]


def told_by(records: list[accelcal.TumbleRecord]) -> dict[str, Array]:
    """Everything that the fits of some records of one plan tell, solved together.

    Three levels determine the bilinear laws without a choice of weights.
    """
    masks = list(records[0].table_masks())
    tables = [prepare(records[0].select(mask)) for mask in masks]
    outputs = [np.stack([record.output[mask] for record in records]) for mask in masks]
    levels = np.array([[table.record.mean_temperature for table in tables]] * len(records))
    k = np.stack(estimate_stack(tables, outputs, levels, records[0].apparatus).coefficients)
    at_reference = k[int(np.abs(levels[0] - AL15.reference_temperature).argmin())]
    told = dict(zip(COEFFICIENTS, at_reference.T, strict=True))
    quotients = {error: told[name] / told["K1"] for name, error in ERROR_TERMS.items()}
    told = {name: value / (told["K1"] if name != "K1" else 1.0) for name, value in told.items()}
    return told | quotients | (slopes(k, levels[0]) if len(tables) > 1 else {})


def slopes(k: Array, levels: Array) -> dict[str, Array]:
    rise = levels - AL15.reference_temperature
    law = np.column_stack([np.ones(3), np.maximum(rise, 0.0), np.minimum(rise, 0.0)])
    told = {}
    for name, values in (
        ("lam", k[..., 0] / k[..., 1]),
        ("beta", k[..., 1]),
        ("gam", k[..., 4] / k[..., 1]),
    ):
        found = np.linalg.solve(law, values)
        whole = found[0] if name == "beta" else 1.0
        told |= {f"{name}1": found[1] / whole, f"{name}2": found[2] / whole}
        told[AT_T0[name]] = found[0]
    return told


def check(regime: str, plan: TumblePlan) -> None:
    """Solved together or by `accelcal.fit`: the same figures."""
    records = simulated(regime, plan, range(1, 3))
    told = told_by(records)
    for place, record in enumerate(records):
        for (name, _), figure in figures(accelcal.fit(record)).items():
            np.testing.assert_allclose(told[name][place], figure.value, rtol=1e-8, err_msg=name)


def ratios(design: Design, draws: int) -> tuple[Design, dict[str, float], float]:
    """Scatter over foreseen uncertainty of each figure, and the time that it took [s]."""
    began = time.perf_counter()
    regime, plan = design
    foreseen = forecasts(plan, noise_of(regime), AL15, declared=regime != UNDECLARED)
    check(regime, plan)
    own = crc32(repr(design).encode())  # designs draw errors of their own
    parts = [
        told_by(simulated(regime, plan, range(own + start, own + min(start + STACK, draws))))
        for start in range(0, draws, STACK)
    ]
    found = {}
    # where each level is met once, a value at T0 is that of the table there, which is counted
    for f in (f for f in foreseen if f.name not in AT_T0.values()):
        values = np.concatenate([part[f.name] for part in parts])
        unit = AL15.scale_factor.at_T0 if f.name == "K1" else 1.0
        found[f.name] = float(values.std(ddof=1)) / unit / f.standard_uncertainty
    return design, found, time.perf_counter() - began


def compare(draws: int, chosen: list[Design], jobs: int) -> None:
    """Print a line for each design, then how well they agree on the whole."""
    print(f"{draws} draws: a ratio is uncertain by {100 / (2 * draws) ** 0.5:.1f} %")
    print("positions x strokes, levels, regime: scatter over prediction, least and most")
    together: dict[bool, list[float]] = {True: [], False: []}
    with ProcessPoolExecutor(jobs) as pool:
        for (regime, plan), found, seconds in pool.map(partial(ratios, draws=draws), chosen):
            low, high = (f(found, key=found.__getitem__) for f in (min, max))
            print(
                f"{plan.positions:2d} x {plan.strokes}, {len(plan.temperatures)} levels,"
                f" {regime:<16} {low} {found[low]:.3f}  {high} {found[high]:.3f}"
                f"  ({seconds:.0f} s)",
                flush=True,
            )
            together[regime != UNDECLARED] += found.values()
    for declared, values in together.items():
        if values:
            off = np.abs(np.array(values) - 1.0)
            print(
                f"{'declared' if declared else 'undeclared'}: {off.size} figures, worst"
                f" {100 * off.max():.1f} % off, rms {100 * (off**2).mean() ** 0.5:.1f} %,"
                f" {(off > 0.05).sum()} beyond 5 %"
            )


# -- gains -----------------------------------------------------------------------------------------


def gains(smoke: bool) -> None:
    """What the best angles gain over equally spaced tests of the same hours."""
    stands = {
        "paper": NoiseComponents(),
        "noise": NoiseComponents(reading=5e-5, head=1e-6, launch=1e-6, launch_sf=1e-6),
        "head": NoiseComponents(reading=1e-6, head=2e-5, launch=1e-6, launch_sf=1e-6),
    }
    print("uncertainty over that of the best angles: 8 positions, equal angles, equal and repeated")
    for (stand, noise), hours in product(stands.items(), (12.0,) if smoke else (9.0, 12.0, 18.0)):
        for criterion in ("D", "K1") if smoke else ("D", "A", "K0", "K1", "K2", "K3", "M", "M_ip"):
            found = accelcal.optimal_design(criterion, hours=hours, noise=noise)
            told = "  ".join(f"{found.gain(name):.3f}" for name in list(found.losses)[1:])
            print(f"{stand:<6} {hours:4.0f} h  {criterion:<5} {told}", flush=True)


# -- harmonics of the head -------------------------------------------------------------------------


def harmonics(amplitude: float = 2e-5) -> None:
    """Errors of the coefficients by one harmonic of the head, the root mean square over its phase.

    Noise-free readings are taken at angles that are off by the harmonic, and fitted.
    """
    names = ("K0", "K1", "K2", "K3", "M", "M_ip")
    print(f"rms errors by a harmonic of {amplitude:g} rad, over its phase [1e-6]")
    print(f"{'positions':<10} {'harmonic':>8} " + " ".join(f"{name:>6}" for name in names))
    for order, positions in product(HARMONICS, (6, 8, 12, 24, 36)):
        stops = np.arange(positions + 1) * 360.0 / positions
        errors = []
        for phase in np.arange(ANGLES_OF_PHASE) * 2.0 * np.pi / ANGLES_OF_PHASE:
            off = amplitude * np.sin(order * np.radians(stops) + phase)
            y = accelcal.output({"K1": 1.0}, accelcal.accelerations(stops + np.degrees(off)))
            plan = TumblePlan(positions=positions, strokes=1, temperatures=(20.0,))
            record = replace(simulate(plan=plan, noise=NOISE_FREE, declare=False), output=y)
            record = record.with_apparatus(head_uncertainty=0.0)
            fitted = accelcal.fit(record).tables[0].coefficients
            errors.append([(fitted[n].value or 0.0) - (n == "K1") for n in names])
        rms = 1e6 * np.sqrt((np.array(errors) ** 2).mean(axis=0))
        print(f"{positions:<10} {order:>8} " + " ".join(f"{value:6.2f}" for value in rms))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--smoke", action="store_true", help="a few designs and draws")
    parser.add_argument("--draws", type=int, help=f"tests simulated of each design [{DRAWS}]")
    parser.add_argument("--jobs", type=int, default=1, help="processes [1]")
    parser.add_argument("--only", help="only designs of this regime")
    parser.add_argument("--gain", action="store_true", help="what the best angles gain")
    parser.add_argument("--harmonics", action="store_true", help="what harmonics of the head do")
    options = parser.parse_args()
    if options.harmonics:
        harmonics()
    elif options.gain:
        gains(options.smoke)
    else:
        chosen = [d for d in designs() if options.only in (None, d[0])]
        if options.smoke:
            chosen = [d for d in chosen if d[0] in ("all", UNDECLARED) and d[1].strokes == 2][:4]
        compare(options.draws or (SMOKE_DRAWS if options.smoke else DRAWS), chosen, options.jobs)


if __name__ == "__main__":
    main()
