"""Predictions of `accelcal design` against Monte Carlo: simulate, fit, and look at the scatter.

Run ``python benchmarks/design.py`` (hours of one core; ``--jobs`` spreads them) or with ``--smoke``
(seconds). Each design is simulated and fitted as a laboratory would do it, `DRAWS` times, and the
standard deviation of each coefficient, error term and temperature slope is held against the
standard uncertainty that was foreseen. ``--gain`` asks instead what the best angles gain, and
``--harmonics`` what harmonics of the head do to tests of different numbers of positions.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np

import accelcal
from accelcal.planning.prediction import figures, forecasts
from accelcal.simulation import AL15, NOISE_FREE, NoiseComponents, TumblePlan, simulate

DRAWS = 4000  # a standard deviation of them is uncertain by 1.1 %
SMOKE_DRAWS = 60

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

HARMONICS = (1, 2, 3)
ANGLES_OF_PHASE = 36

Design = tuple[str, TumblePlan]


def designs() -> Iterator[Design]:
    """All designs of the grid."""
    for levels, strokes, positions, regime in product(
        LEVELS, STROKES, POSITIONS, (*REGIMES, UNDECLARED)
    ):
        yield regime, TumblePlan(positions=positions, strokes=strokes, temperatures=levels)


def noise_of(regime: str) -> NoiseComponents:
    return REGIMES[regime.removesuffix(", undeclared")]


def draw(regime: str, plan: TumblePlan, seed: int) -> list[float]:
    """Everything that one simulated test tells."""
    record = simulate(AL15, plan, noise_of(regime), seed=seed, declare=regime != UNDECLARED)
    found = figures(accelcal.fit(record))
    return [
        figure.value / (AL15.scale_factor.at_reference if n == "K1" else 1.0)
        for (n, _), figure in found.items()
    ]


def ratios(design: Design, draws: int) -> tuple[Design, dict[str, float], float]:
    """Scatter over foreseen uncertainty of each figure, and the time that it took [s]."""
    start = time.perf_counter()
    regime, plan = design
    foreseen = forecasts(plan, noise_of(regime), AL15, declared=regime != UNDECLARED)
    values = np.array([draw(regime, plan, seed) for seed in range(1, draws + 1)])
    scatter = values.std(axis=0, ddof=1)
    found = {
        f.name: float(s / f.standard_uncertainty) for f, s in zip(foreseen, scatter, strict=True)
    }
    return design, found, time.perf_counter() - start


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
