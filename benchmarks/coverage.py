"""Coverage of the 95 % intervals: how often they hold the truth, over many simulated tables.

Run ``python benchmarks/coverage.py`` (minutes) or with ``--smoke`` (seconds). The tables come from
`tumble`, which shares no code with accelcal. Each regime is fitted as a user would fit it. A figure
passes where it lies in 93.5 .. 96.5 %; regimes marked with a star stand outside that promise and
say why. ``--choices`` prints the same of estimates that were tried in place of those of accelcal.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
import time
import warnings
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np
from tumble import Stand, Unit, readings, samples

import accelcal
from accelcal.estimate.uncertainty import combined, counted

COEFFICIENTS = ("K0", "K1", "K2", "K3", "M", "M_ip")
LOWEST, HIGHEST = 93.5, 96.5
THREE = (20.0, 80.0, -40.0)
REPEATED = (20.0,) * 6


@dataclass(frozen=True)
class Regime:
    """Errors that are present, what the user declares, and the design of the test."""

    name: str
    stand: Stand
    declared: dict[str, float] = field(default_factory=dict)
    temperatures: tuple[float, ...] = (20.0,)
    positions: int = 8
    strokes: int = 6
    laws: str = ""
    aside: str = ""
    returns: bool = True
    robust: bool = False
    samples: str = ""  # kind of `tumble.samples`
    mean: bool = False  # whether the mean of the runs is looked at


HEAD = 2e-5
NOISE = 1.35 * 5e-6  # in the unit of the output
NO_HEAD = {"head_uncertainty": 0.0}
LAUNCH_FREE = {"launch_uncertainty": 0.0, "launch_sf_uncertainty": 0.0}
LAUNCH = {"launch_uncertainty": 1e-5, "launch_sf_uncertainty": 1e-5}
TWO_STROKES = Regime(
    "two strokes at 3 temperatures, laws from all readings",
    Stand(),
    NO_HEAD,
    THREE,
    strokes=2,
    laws="readings",
)
CORRELATED = tuple(
    Regime(
        f"* neighbours correlated by {rho:g}, {text}",
        Stand(neighbours=rho),
        NO_HEAD | LAUNCH_FREE,
        temperatures,
        aside="not every test shows it, and few readings show by how much",
    )
    for rho in (0.3, 0.5, 0.8, 0.9)
    for text, temperatures in (("one run", (20.0,)), ("3 temperatures", THREE))
)
ENCODER = tuple(
    Regime(
        f"angles as an encoder reads them, head 2e-5 {known}",
        Stand(head=HEAD, stops=1e-3),
        declared,
    )
    for known, declared in (("declared", {"head_uncertainty": HEAD}), ("estimated", {}))
)
SAMPLED = tuple(
    Regime(
        f"* std of samples {text} that the strokes do not bear out, {strokes} strokes",
        Stand(),
        NO_HEAD,
        strokes=strokes,
        samples=kind,
        aside="few replicates tell how alike the scatter is",
    )
    for kind, text in (("angle", "larger near 0 and 180"), ("random", "differing by chance,"))
    for strokes in (6, 2)
)
FEW_SAMPLES = tuple(
    Regime(
        f"* few samples, std of {kind}, {strokes} stroke{'s' * (strokes > 1)}",
        Stand(),
        NO_HEAD,
        strokes=strokes,
        samples=kind,
        aside=aside,
    )
    for kind, aside in (
        ("2 samples", "two samples tell little of their noise"),
        ("5 samples without n", "taken at its word"),
    )
    for strokes in (1, 6)
)
ACROSS = tuple(
    Regime(
        f"{'* ' * (strokes < 4)}noise 3 ug to 12 ug by the angle, {text}",
        Stand(reading=3e-6, across=4.0),
        NO_HEAD | LAUNCH_FREE,
        (20.0,) * runs,
        strokes=strokes,
        aside="few replicates tell it" * (strokes < 4),
    )
    for runs, strokes, text in (
        (1, 6, "six strokes"),
        (1, 4, "four strokes"),
        (1, 3, "three strokes"),
        (1, 2, "two strokes"),
        (3, 2, "three runs of two strokes"),
    )
)
UNDERSTATED = tuple(
    Regime(
        f"* head {size:g} declared as 1e-05, {positions} positions",
        Stand(head=size),
        {"head_uncertainty": 1e-5},
        positions=positions,
        aside="row +: U times the factor that the gate names, where lack of fit warns",
    )
    for size in (2e-5, 4e-5)
    for positions in (8, 12, 24)
)
REGIMES = (
    Regime("noise only, head declared 0", Stand(), NO_HEAD),
    Regime("head 2e-5 declared", Stand(head=HEAD), {"head_uncertainty": HEAD}),
    Regime("head 2e-5 estimated", Stand(head=HEAD)),
    Regime("head 2e-5 estimated, 12 positions", Stand(head=HEAD), positions=12),
    Regime("head 6.7e-6 estimated", Stand(head=6.7e-6)),
    Regime("head 5e-6 estimated, as large as the noise", Stand(head=5e-6)),
    *ENCODER,
    Regime("one stroke, 8 positions, head 2e-5", Stand(head=HEAD), strokes=1),
    *(
        Regime(f"one stroke, {positions} positions, {text}", stand, positions=positions, strokes=1)
        for positions in (12, 24, 36)
        for text, stand in (("no head error", Stand()), ("head 2e-5", Stand(head=HEAD)))
    ),
    Regime(
        "one stroke, 8 positions, head 2e-5 declared",
        Stand(head=HEAD),
        {"head_uncertainty": HEAD},
        strokes=1,
    ),
    *(
        Regime(
            f"noise of {share:g} steps, resolution declared",
            Stand(step=NOISE / share),
            NO_HEAD | {"resolution": NOISE / share},
        )
        for share in (0.2, 0.5, 1.0)
    ),
    *(
        Regime(
            f"{star}noise of {share:g} steps, head 2e-5 and resolution declared",
            Stand(head=HEAD, step=NOISE / share),
            {"head_uncertainty": HEAD, "resolution": NOISE / share},
            aside=aside,
        )
        for star, share, aside in (
            ("", 0.1, ""),
            ("* ", 0.05, "M_ip rests on few rounding errors"),
            ("* ", 0.02, "M_ip rests on few rounding errors"),
            ("* ", 0.005, "M_ip rests on few rounding errors"),
        )
    ),
    *(
        Regime(
            f"robust, {strokes} strokes, {share:g} % of the readings wrong",
            Stand(wrong=share / 100.0),
            NO_HEAD,
            strokes=strokes,
            robust=True,
        )
        for strokes in (3, 4, 6)
        for share in (2, 10)
    ),
    Regime("launch declared", Stand(launch=1e-5, launch_sf=1e-5), NO_HEAD | LAUNCH),
    Regime("launch estimated from 6 runs", Stand(launch=1e-5, launch_sf=1e-5), NO_HEAD, REPEATED),
    Regime(
        "3 temperatures, all declared",
        Stand(head=HEAD, launch=1e-5, launch_sf=1e-5),
        {"head_uncertainty": HEAD} | LAUNCH,
        THREE,
    ),
    Regime(
        "3 temperatures, head estimated",
        Stand(head=HEAD, launch=1e-5, launch_sf=1e-5),
        LAUNCH,
        THREE,
    ),
    Regime(
        "3 temperatures, missed by 0.1 degC, all declared",
        Stand(head=HEAD, launch=1e-5, launch_sf=1e-5, temperature=0.1),
        {"head_uncertainty": HEAD, "temperature_uncertainty": 0.1} | LAUNCH,
        THREE,
    ),
    Regime(
        "7 runs at 3 temperatures, two strokes, laws from all readings",
        Stand(head=HEAD, launch=1e-5, launch_sf=1e-5, temperature=0.1),
        {"head_uncertainty": HEAD, "temperature_uncertainty": 0.1} | LAUNCH,
        (20.0, 80.0, 20.0, -40.0, 20.0, 80.0, -40.0),
        strokes=2,
        laws="readings",
    ),
    Regime(
        "temperature laws from the tables",
        Stand(head=HEAD, launch=1e-5, launch_sf=1e-5),
        LAUNCH,
        THREE,
        laws="tables",
    ),
    Regime(
        "temperature laws from all readings",
        Stand(head=HEAD, launch=1e-5, launch_sf=1e-5),
        {"head_uncertainty": HEAD} | LAUNCH,
        THREE,
        laws="readings",
    ),
    TWO_STROKES,
    Regime("* noise only, nothing declared", Stand(), aside="wider than needed"),
    Regime(
        "* one stroke, 8 positions, no head error", Stand(), strokes=1, aside="wider than needed"
    ),
    Regime(
        "* one stroke, 8 positions, head 5e-6",
        Stand(head=5e-6),
        strokes=1,
        aside="wider than needed",
    ),
    *(
        Regime(f"* two strokes, {text}", stand, strokes=2, aside="wider than needed")
        for text, stand in (("no head error", Stand()), ("head 5e-6", Stand(head=5e-6)))
    ),
    *(
        Regime(
            f"* one stroke, 7 positions, {text}",
            stand,
            positions=7,
            strokes=1,
            aside="no honest interval: the report says so",
        )
        for text, stand in (("no head error", Stand()), ("head 2e-5", Stand(head=HEAD)))
    ),
    *(
        Regime(
            f"* six strokes, 7 positions, {text}",
            stand,
            positions=7,
            aside="no honest interval: the report says so",
        )
        for text, stand in (
            ("no head error", Stand()),
            ("head 5e-6", Stand(head=5e-6)),
            ("head 2e-5", Stand(head=HEAD)),
        )
    ),
    *(
        Regime(
            f"* one stroke without the return, {positions} positions, {text}",
            stand,
            positions=positions,
            strokes=1,
            aside="no honest interval: the report says so",
            returns=False,
        )
        for positions in (8, 9, 12, 16, 20)
        for text, stand in (("no head error", Stand()), ("head 2e-5", Stand(head=HEAD)))
    ),
    *(
        Regime(
            f"* laws of {text}, launches not declared",
            Stand(head=HEAD, launch=1e-5, launch_sf=1e-5),
            {"head_uncertainty": HEAD},
            temperatures,
            strokes=4,
            laws="tables",
            aside="no honest interval: the report says so",
        )
        for text, temperatures in (
            ("3 temperatures", THREE),
            ("3 temperatures, 20 degC twice", (*THREE, 20.0)),
            ("3 temperatures there and back", (20.0, 80.0, 20.0, -40.0, 20.0)),
        )
    ),
    Regime(
        "* few repeats, launches not declared",
        Stand(head=HEAD, launch=1e-5, launch_sf=1e-5),
        {"head_uncertainty": HEAD},
        (20.0, 80.0, 20.0, -40.0, 20.0),
        strokes=2,
        aside="no honest interval: the report says so",
    ),
    *(
        Regime(
            f"* mean of {runs} runs, launches of {launch:g} not declared",
            Stand(launch=launch, launch_sf=launch),
            NO_HEAD,
            (20.0,) * runs,
            mean=True,
            aside="no honest interval: the report says so",
        )
        for runs in (2, 3)
        for launch in (3e-6, 1e-5, 3e-5)
    ),
    *CORRELATED,
    *SAMPLED,
    *FEW_SAMPLES,
    *ACROSS,
    *UNDERSTATED,
    Regime(
        "* launch neither declared nor repeated",
        Stand(launch=1e-5),
        NO_HEAD,
        aside="no honest interval of K0: the report says so",
    ),
)


def record_of(columns: dict[str, list[float]], declared: dict[str, float]) -> accelcal.TumbleRecord:
    """Columns of the generator as a record."""
    run = np.array(columns["run"], dtype=np.int64)
    n = run.size
    return accelcal.TumbleRecord(
        output=np.array(columns["output"]),
        angle=np.array(columns["angle"]),
        temperature=np.array(columns["temperature"]),
        stroke=np.array(columns["stroke"], dtype=np.int64),
        run=run,
        run_labels=tuple(str(label) for label in range(int(run.max()) + 1)),
        mounting=np.full(n, "o+"),
        position=np.zeros(n, dtype=np.int64),
        std=np.array(columns["std"]) if "std" in columns else None,
        count=np.array(columns["count"]) if "count" in columns else None,
        apparatus=accelcal.Apparatus(**declared),
    )


def _never(*_: object) -> bool:
    return False


class Choice(NamedTuple):
    """Another value of what the estimates use, and the regimes that told against it."""

    name: str
    what: str
    value: Any
    regimes: tuple[Regime, ...]


CHOICES = (
    Choice(
        "head estimated with all of the noise taken off",
        "accelcal.estimate.uncertainty._CAUTION",
        0.0,
        tuple(
            Regime(f"head {size:g} estimated", Stand(head=size)) for size in (3e-6, 5e-6, 6.7e-6)
        ),
    ),
    Choice(
        "one stroke, all of the head taken off the residuals",
        "accelcal.estimate.unrepeated._HEAD_SHARE",
        1.0,
        (Regime("12 positions, no head error", Stand(), positions=12, strokes=1),),
    ),
    Choice(
        "laws from all readings, each run weighted by its own scatter",
        "accelcal.temperature.product.errors._SIGNIFICANT",
        1.1,
        (TWO_STROKES,),
    ),
    Choice(
        "each angle as read a position of its own",
        "accelcal.head_angles.SAME_POSITION",
        0.0,
        ENCODER,
    ),
    Choice(
        "std taken at its word",
        "accelcal.estimate.declared_scatter._SIGNIFICANT",
        0.0,
        SAMPLED,
    ),
    Choice(
        "one noise for all positions",
        "accelcal.estimate.uneven_noise.is_noise",
        _never,
        ACROSS,
    ),
    Choice(
        "readings taken as independent",
        "accelcal.estimate.correlated_noise._SIGNIFICANT",
        np.inf,
        CORRELATED,
    ),
)


def any_unit(rng: np.random.Generator) -> Unit:
    """Draw a unit like the AL-15, so that no step of the voltmeter falls on the same digits."""
    near = {"K1": 1.35, "k0": 3.324e-3, "k2": 105e-6, "k3": 87e-6, "delta": 1.15e-3}
    return Unit(**{name: value * rng.uniform(0.9, 1.1) for name, value in near.items()})


def one_table(
    regime: Regime, choice: Choice | None, seed: int, number: int
) -> tuple[dict[tuple[str, str], bool], dict[tuple[str, str], float]]:
    """Which intervals hold the truth, and how wide they are."""
    rng = np.random.default_rng([seed, number])
    unit = any_unit(rng)
    columns = readings(
        unit,
        regime.stand,
        rng,
        positions=regime.positions,
        strokes=regime.strokes,
        temperatures=regime.temperatures,
    )
    if not regime.returns:
        columns = {name: values[:-1] for name, values in columns.items()}
    if regime.samples:
        columns |= samples(columns, unit, regime.samples, rng)
    instead = patch(choice.what, choice.value) if choice else nullcontext()
    with instead:
        calibration = accelcal.fit(
            record_of(columns, regime.declared),
            temperature_laws=regime.laws or "tables",
            robust=regime.robust,
        )
    if regime.laws:
        compared = laws_against_truth(calibration, unit)
    elif regime.mean:
        compared = mean_against_truth(calibration, unit)
    else:
        compared = tables_against_truth(calibration, unit)
    if regime in UNDERSTATED:
        compared += widened(calibration, compared)
    hits = {key: abs(q.value - truth) <= q.expanded_uncertainty for key, q, truth, _ in compared}
    return hits, {key: q.expanded_uncertainty / size for key, q, _, size in compared}


def widened(calibration: accelcal.Calibration, compared: Compared) -> Compared:
    """The same with U times the factor of the gate lack of fit; none where it does not warn."""
    gate = next(own for own in calibration.gates if own.name == "lack of fit")
    factor = re.match(r"position residuals ([0-9.]+) times", gate.finding)
    if gate.verdict != "warn" or factor is None:
        return []
    wide = float(factor[1])
    return [
        ((f"+{where}", what), replace(q, expanded_uncertainty=wide * q.expanded_uncertainty), *rest)
        for (where, what), q, *rest in compared
    ]


Compared = list[tuple[tuple[str, str], accelcal.Quantity, float, float]]


def tables_against_truth(calibration: accelcal.Calibration, unit: Unit) -> Compared:
    """Where and what, the estimate, the truth, and what the half width is divided by."""
    return [
        (
            (table.run, name),
            table.coefficients[name],
            unit.at(table.temperature_degC)[name],
            unit.K1,
        )
        for table in calibration.tables[:3]
        for name in COEFFICIENTS
    ]


def mean_against_truth(calibration: accelcal.Calibration, unit: Unit) -> Compared:
    """The same for the bias and the scale factor of the mean of all runs, as `apply` takes it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", accelcal.AccelcalWarning)  # of the few repeats
        found = accelcal.coefficients_at(calibration, 20.0)
    return [(("mean", name), found[name], getattr(unit, name), 1.0) for name in ("k0", "K1")]


def laws_against_truth(calibration: accelcal.Calibration, unit: Unit) -> Compared:
    """The same for the value at T0 and the two slopes of each law."""
    model = calibration.temperature_model
    truths = (
        ("k0", unit.k0, unit.lam),
        ("K1", unit.K1, unit.beta),
        ("delta", unit.delta, unit.gam),
    )
    return [
        ((name, part), getattr(getattr(model, name), part), value, 1.0)
        for name, at_reference, slopes in truths
        for part, value in zip(("at_T0", "above", "below"), (at_reference, *slopes), strict=True)
    ]


def measure(
    regime: Regime, choice: Choice | None, tables: int, seed: int, pool: Any
) -> dict[tuple[str, str], tuple[float, float]]:
    """Coverage [%] and median half width [g] of each coefficient of each table."""
    one = partial(one_table, regime, choice, seed)
    results = list(pool.map(one, range(tables), chunksize=25))
    figures = {}
    for key in dict.fromkeys(key for hits, _ in results for key in hits):
        told = [(hits[key], widths[key]) for hits, widths in results if key in hits]
        held, width = zip(*told, strict=True)
        figures[key] = 100.0 * float(np.mean(held)), float(np.median(width))
    warned = sum(any(where.startswith("+") for where, _ in hits) for hits, _ in results)
    return figures | ({("+", "warned"): (100.0 * warned / tables, 0.0)} if warned else {})


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; exit 1 where a promised figure lies outside its range."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tables", type=int, default=10000, help="tables a regime")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--seed", type=int, default=2026)
    parser.add_argument("--only", default="", help="regimes whose names contain this")
    parser.add_argument("--choices", action="store_true", help="other estimates that were tried")
    parser.add_argument("--smoke", action="store_true", help="few tables a regime, no verdict")
    options = parser.parse_args(arguments)
    tables = (6 if options.choices else 60) if options.smoke else options.tables
    print(f"{tables} tables a regime, accelcal {accelcal.__version__}; coverage [%] and, below it,")
    print("the median half width of the interval [1e-6 of K1; of laws 1e-6 of their unit];")
    print(f"standard error of a coverage of 95 %: {100 * (0.95 * 0.05 / tables) ** 0.5:.2f} %")
    missed = []
    start = time.monotonic()
    with ProcessPoolExecutor(options.jobs) as pool:
        if options.choices:
            _choices(tables, options.seed, pool)
        for regime in (r for r in REGIMES if options.only in r.name and not options.choices):
            missed += _show(regime, measure(regime, None, tables, options.seed, pool))
    print(f"{time.monotonic() - start:.0f} s with {options.jobs} processes")
    print("outside 93.5 .. 96.5 %: " + (", ".join(missed) or "none"))
    return 1 if missed and not options.smoke else 0


def _choices(tables: int, seed: int, pool: Any) -> None:
    """Print the coverage of estimates that were tried."""
    for choice in CHOICES:
        print(f"\n## {choice.name}")
        for regime in choice.regimes:
            _show(regime, measure(regime, choice, tables, seed, pool))
    for dof in (1, 2):
        print(f"\n## One source of {dof} dof beside known ones, by its share of the variance")
        print(f"{'share':>8s}{'by squares (GUM G.4)':>24s}{'by shares':>12s}{'as counted':>12s}")
        for share in (*np.linspace(0.0, 0.9, 10), 0.95, 1.0):
            cells = _of_two_sources(share, dof, max(200 * tables, 12_000), seed)
            print(f"{share:8.2f}{cells[0]:24.1f}{cells[1]:12.1f}{cells[2]:12.1f}")


def _of_two_sources(share: float, freedom: int, draws: int, seed: int) -> tuple[float, ...]:
    """Coverage [%] by Welch and Satterthwaite, by the mean of the dof, and by that as counted."""
    rng = np.random.default_rng(seed)
    error = np.abs(rng.standard_normal((draws, 1)))
    found = share * rng.chisquare(freedom, (draws, 1)) / freedom
    rest = np.full_like(found, 1.0 - share)
    dof = np.full_like(found, float(freedom))
    # the harmonic mean of dof / share is what Welch and Satterthwaite have
    with np.errstate(divide="ignore"):
        squared = combined(
            [found, rest], [dof * (found + rest) / found, np.full_like(found, np.inf)]
        )
    plain = combined([found, rest], [dof, np.full_like(found, np.inf)])
    cut = combined([found, rest], [counted(dof), np.full_like(found, np.inf)])
    return tuple(100.0 * float(np.mean(error <= one.expanded)) for one in (squared, plain, cut))


def _show(regime: Regime, figures: dict[tuple[str, str], tuple[float, float]]) -> list[str]:
    """Print a regime; return the figures that it promised and missed."""
    print(f"\n{regime.name}" + (f" ({regime.aside})" if regime.aside else ""))
    for where in dict.fromkeys(where for where, _ in figures):
        row = {what: figures[key] for key in figures for what in key[1:] if key[0] == where}
        print(f"  {where:>6s}  " + "".join(f"{what:>8s}" for what in row))
        print("          " + "".join(f"{cover:8.1f}" for cover, _ in row.values()))
        print("          " + "".join(f"{1e6 * width:8.2f}" for _, width in row.values()))
    sys.stdout.flush()
    if regime.name.startswith("*"):
        return []
    return [
        f"{regime.name}, {' '.join(key)}: {cover:.1f}"
        for key, (cover, _) in figures.items()
        if not LOWEST <= cover <= HIGHEST
    ]


if __name__ == "__main__":
    sys.exit(main())
