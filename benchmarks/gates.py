"""Gates: how often each warns of a clean test, and how often it finds a fault.

Run ``python benchmarks/gates.py`` (minutes) or with ``--smoke`` (seconds). The tests come from
`tumble`, which shares no code with accelcal; the faults are put into the readings here. A record
warns where any of its tables does. A gate that is a statistical test passes where it warns of at
most 1 % of the clean records but for the scatter of counting, any other where it never does.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from coverage import record_of
from tumble import Stand, Unit, readings

import accelcal
from accelcal.estimate.noise import noise_of_stack
from accelcal.estimate.tables import linear_estimator, prepare
from accelcal.gates.record import gates_of_stack
from accelcal.gates.stack import TableStack
from accelcal.gates.verdict import SIGNIFICANT

Columns = dict[str, np.ndarray]

TESTS_OF_A_TABLE = ("closure", "drift", "forward against back", "outlier")
TESTS = (*TESTS_OF_A_TABLE, "lack of fit")
HEAD, THREE = 2e-5, (20.0, 80.0, -40.0)
SECONDS_PER_READING = 60.0


@dataclass(frozen=True)
class Regime:
    """Errors that are present, what the user declares, and the temperatures."""

    name: str
    stand: Stand
    declared: dict[str, float] = field(default_factory=dict)
    temperatures: tuple[float, ...] = (20.0,)
    strokes: int = 6


LAUNCH = {"launch_uncertainty": 1e-5, "launch_sf_uncertainty": 1e-5}
ONE = Regime("head 2e-5 declared", Stand(head=HEAD), {"head_uncertainty": HEAD})
ALL = Regime(
    "head and launch shifts, 3 temperatures",
    Stand(head=HEAD, launch=1e-5, launch_sf=1e-5),
    {"head_uncertainty": HEAD} | LAUNCH,
    THREE,
)
REGIMES = (
    Regime("noise only, head declared 0", Stand(), {"head_uncertainty": 0.0}),
    Regime("noise only, 2 strokes", Stand(), {"head_uncertainty": 0.0}, strokes=2),
    ONE,
    ALL,
)


@dataclass(frozen=True)
class Unlike:
    """Clean tables whose readings declare a `std`, drawn anew for each, and their noise.

    Those with a star declare another noise than they have: no gate promises anything of them.
    """

    name: str
    lowest: float  # std [ug]
    highest: float
    noise: Callable[[np.ndarray], np.ndarray] = lambda std: std
    samples: int = 0  # of each reading, of which its std is found; 0 where it is known


UNLIKE = (
    Unlike("std of 4 to 8 ug", 4.0, 8.0),
    Unlike("std of 3 to 12 ug", 3.0, 12.0),
    Unlike("std of 2 to 20 ug", 2.0, 20.0),
    Unlike("* std of 2 to 8 ug, noise of 6 ug", 2.0, 8.0, lambda std: 6.0 + 0.0 * std),
    Unlike("* std of 1 to 6 ug, 6 ug of noise beside", 1.0, 6.0, lambda std: np.hypot(std, 6.0)),
    Unlike("6 ug in all, std of 2 samples", 6.0, 6.0, samples=2),
    Unlike("6 ug in all, std of 5 samples", 6.0, 6.0, samples=5),
    Unlike("std of 4 to 8 ug, of 2 samples", 4.0, 8.0, samples=2),
    Unlike("std of 4 to 8 ug, of 5 samples", 4.0, 8.0, samples=5),
    Unlike("std of 2 to 20 ug, of 10 samples", 2.0, 20.0, samples=10),
    Unlike("std of 2 to 20 ug, of 100 samples", 2.0, 20.0, samples=100),
)


def added(error: Callable[[Columns], np.ndarray]) -> Callable[[Columns], None]:
    """A fault of the first run: an error [g] is added to its readings."""

    def fault(columns: Columns) -> None:
        columns["output"] += Unit().K1 * np.where(columns["run"] == 0, error(columns), 0.0)

    return fault


def swapped(columns: Columns) -> None:
    """The fourth and the fifth reading are in each other's place."""
    columns["output"][[3, 4]] = columns["output"][[4, 3]]


def mirrored(*strokes: int) -> Callable[[Columns], None]:
    """Some strokes of the first run are written backwards."""

    def fault(columns: Columns) -> None:
        for stroke in strokes:
            own = (columns["run"] == 0) & (columns["stroke"] == stroke)
            columns["output"][own] = columns["output"][own][::-1]

    return fault


def coarse(columns: Columns) -> None:
    """A voltmeter of three digits."""
    columns["output"][:] = np.round(columns["output"], 2)


def minutes(columns: Columns) -> np.ndarray:
    """Time since the first reading, one a minute."""
    return np.arange(columns["output"].size) * SECONDS_PER_READING / 60.0


def cosine(columns: Columns) -> np.ndarray:
    """Cosine of the head angle."""
    return np.cos(np.radians(columns["angle"]))


def sine(columns: Columns) -> np.ndarray:
    """Sine of the head angle."""
    return np.sin(np.radians(columns["angle"]))


def back(columns: Columns) -> np.ndarray:
    """One in the strokes back."""
    return 1.0 - columns["stroke"] % 2


FAULTS: dict[str, tuple[str, Callable[[Columns], None]]] = {
    "return 15 ug above the start": ("closure", added(lambda c: 15e-6 * (c["angle"] == 360.0))),
    "bias moves by 10 ug in the run": ("drift", added(lambda c: 10e-6 * minutes(c) / 53.0)),
    "bias moves by 20 ug in the run": ("drift", added(lambda c: 20e-6 * minutes(c) / 53.0)),
    "warm-up 1e-5 g, 900 s": ("drift", added(lambda c: 1e-5 * np.exp(-minutes(c) / 15.0))),
    "warm-up 1e-4 g, 900 s": ("drift", added(lambda c: 1e-4 * np.exp(-minutes(c) / 15.0))),
    "scale factor moves by 10 ppm in the run": (
        "drift",
        added(lambda c: 10e-6 * cosine(c) * minutes(c) / 53.0),
    ),
    "scale factor moves by 20 ppm in the run": (
        "drift",
        added(lambda c: 20e-6 * cosine(c) * minutes(c) / 53.0),
    ),
    "unit turns by 10 urad in the run": (
        "drift",
        added(lambda c: -10e-6 * sine(c) * minutes(c) / 53.0),
    ),
    "unit turns by 20 urad in the run": (
        "drift",
        added(lambda c: -20e-6 * sine(c) * minutes(c) / 53.0),
    ),
    "backlash 10 urad": ("forward against back", added(lambda c: -10e-6 * sine(c) * back(c))),
    "backlash 20 urad": ("forward against back", added(lambda c: -20e-6 * sine(c) * back(c))),
    "one reading 25 ug off": ("outlier", added(lambda c: 25e-6 * (minutes(c) == 21.0))),
    "one reading 40 ug off": ("outlier", added(lambda c: 40e-6 * (minutes(c) == 21.0))),
    "one position 200 urad off": (
        "lack of fit",
        added(lambda c: -2e-4 * sine(c) * (c["angle"] == 135.0)),
    ),
    "two readings swapped": ("order of positions", swapped),
    "one stroke mirrored": ("order of positions", mirrored(3)),
    "two strokes mirrored": ("order of positions", mirrored(3, 4)),
    "steps of 0.01 mA": ("resolution", coarse),
}


def warned(regime: Regime, fault: str, seed: int, number: int) -> tuple[set[str], set[str]]:
    """Gates that warn of a record, and gates that looked at it."""
    columns = readings(
        Unit(),
        regime.stand,
        np.random.default_rng([seed, number]),
        strokes=regime.strokes,
        temperatures=regime.temperatures,
    )
    if fault:
        as_arrays = {name: np.array(values) for name, values in columns.items()}
        FAULTS[fault][1](as_arrays)
        columns = {name: values.tolist() for name, values in as_arrays.items()}
    return told(record_of(columns, regime.declared))


def told(record: accelcal.TumbleRecord) -> tuple[set[str], set[str]]:
    """Gates that warn of a record, and gates that looked at it."""
    calibration = accelcal.fit(record)
    gates = [*calibration.gates, *(gate for table in calibration.tables for gate in table.gates)]
    return (
        {gate.name for gate in gates if gate.verdict == "warn"},
        {gate.name for gate in gates if gate.verdict != "not assessed"},
    )


def warned_of_unlike(kind: int, seed: int, number: int) -> tuple[set[str], set[str]]:
    """Gates that warn of a table with a `std` a reading, and of the same without it."""
    rng, case = np.random.default_rng([seed, kind, number]), UNLIKE[kind]
    columns = readings(Unit(), Stand(reading=0.0), rng)
    record = record_of(columns, {"head_uncertainty": 0.0})
    std = rng.uniform(case.lowest, case.highest, len(record))
    noise = case.noise(std) * rng.standard_normal(std.size)
    alike = replace(record, output=record.output + 1e-6 * Unit().K1 * noise)
    if not case.samples:
        return told(replace(alike, std=1e-6 * Unit().K1 * std))[0], told(alike)[0]
    dof = case.samples - 1
    found = std * np.sqrt(case.samples * rng.chisquare(dof, std.size) / dof)
    count = np.full(std.size, float(case.samples))
    return told(replace(alike, std=1e-6 * Unit().K1 * found, count=count))[0], told(alike)[0]


SHARED = (1, 3, 12)
"""One table, three tables, and four gates of each of three: so many share the false alarms."""


def found_at_levels(fault: str, tables: int, seed: int) -> list[float]:
    """Share of the tables with a fault of which its gate warns, with each of `SHARED` [%]."""
    prepared = []
    for number in range(tables):
        rng = np.random.default_rng([seed, number])
        columns = readings(Unit(), ONE.stand, rng, strokes=ONE.strokes, temperatures=(20.0,))
        as_arrays = {name: np.array(values) for name, values in columns.items()}
        FAULTS[fault][1](as_arrays)
        prepared.append(prepare(record_of(as_arrays, ONE.declared)))
    stacks = [noise_of_stack([table], [table.record.output[None]])[0] for table in prepared]
    noises = [noise.of_records(0) for noise in stacks]
    fits = [linear_estimator(table).coefficients(table.record.output) for table in prepared]
    stack, own = TableStack.of(prepared, fits, noises), FAULTS[fault][0]
    found = [{gate.name: gate for gate in gates_of_stack(stack, count)}[own] for count in SHARED]
    return [100.0 * len(gate.warned()) / tables for gate in found]


def rates(regime: Regime, fault: str, records: int, seed: int, pool: Any) -> dict[str, float]:
    """Share of the records of which each gate warns, of all where it looks, and any gate [%]."""
    one = partial(warned, regime, fault, seed)
    warnings, looked = Counter(), set()
    for found, assessed in pool.map(one, range(records), chunksize=25):
        warnings.update(found)
        warnings["any gate"] += bool(found)
        looked |= assessed
    return {name: 100.0 * warnings[name] / records for name in (*sorted(looked), "any gate")}


def unlike_rates(kind: int, tables: int, seed: int, pool: Any) -> dict[str, list[float]]:
    """Share of the tables of which each gate warns, with their std and without [%]."""
    one = partial(warned_of_unlike, kind, seed)
    pairs = list(pool.map(one, range(tables), chunksize=25))
    return {
        name: [100.0 * sum(name in pair[side] for pair in pairs) / tables for side in (0, 1)]
        for name in TESTS_OF_A_TABLE
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Print both tables; exit 1 where a gate warns too often of clean records."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--tables",
        type=int,
        default=10000,
        help="tables a regime; a fifth with a std a reading, a twentieth a fault",
    )
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--seed", type=int, default=2026)
    parser.add_argument("--smoke", action="store_true", help="60 tables a regime, no verdict")
    options = parser.parse_args(arguments)
    tables = 60 if options.smoke else options.tables
    faulty = 6 if options.smoke else max(tables // 20, 15)
    print(f"{tables} tables a regime, accelcal {accelcal.__version__}")
    start = time.monotonic()
    with ProcessPoolExecutor(options.jobs) as pool:
        too_many = _clean(tables, options.seed, pool)
        too_many += _unlike(10 if options.smoke else tables // 5, options.seed, pool)
        _faulty(faulty, options.seed, pool)
    _shared(faulty, options.seed)
    print(f"{time.monotonic() - start:.0f} s with {options.jobs} processes")
    print("too many false alarms: " + (", ".join(too_many) or "none"))
    return 1 if too_many and not options.smoke else 0


def _shared(tables: int, seed: int) -> None:
    """Print what sharing the false alarms costs."""
    heads = "".join(f"{SIGNIFICANT / count:10.5f}" for count in SHARED)
    print(f"\nfaults found at a level [%], {tables} tables each\n{'':44}{heads}")
    for fault, (gate, _) in FAULTS.items():
        if gate in TESTS_OF_A_TABLE:
            shares = found_at_levels(fault, tables, seed)
            print(f"  {fault:42}" + "".join(f"{share:10.1f}" for share in shares))


def _clean(tables: int, seed: int, pool: Any) -> list[str]:
    """Print the false alarms; return the gates that give too many."""
    too_many = []
    print("\nclean records with a warning [%]")
    for regime in REGIMES:
        records = tables // len(regime.temperatures)
        allowed = 1.0 + 300.0 * math.sqrt(0.01 * 0.99 / records)
        print(f"  {regime.name}: {records} records, 1 % by chance stays below {allowed:.2f}")
        for name, rate in rates(regime, "", records, seed, pool).items():
            print(f"    {name:24s}{rate:8.2f}")
            if name != "any gate" and rate > (allowed if name in TESTS else 0.0):
                too_many.append(f"{regime.name}, {name}: {rate:.2f}")
        sys.stdout.flush()
    return too_many


def _unlike(tables: int, seed: int, pool: Any) -> list[str]:
    """Print the false alarms where readings declare unlike noise; return gates with too many."""
    too_many = []
    allowed = 1.0 + 300.0 * math.sqrt(0.01 * 0.99 / tables)
    print(f"\nclean tables with a warning [%], {tables} each, with a std for each reading;")
    print(f"in brackets without it; 1 % by chance stays below {allowed:.2f}")
    print(f"  {'':42s}" + "".join(f"{name:>22s}" for name in TESTS_OF_A_TABLE))
    for kind, case in enumerate(UNLIKE):
        shares = unlike_rates(kind, tables, seed, pool)
        cells = (f"{own:13.1f} ({alike:6.1f})" for own, alike in shares.values())
        print(f"  {case.name:42s}" + "".join(cells))
        sys.stdout.flush()
        if not case.name.startswith("*"):
            over = {name: own for name, (own, _) in shares.items() if own > allowed}
            too_many += [f"{case.name}, {name}: {own:.2f}" for name, own in over.items()]
    return too_many


def _faulty(tables: int, seed: int, pool: Any) -> None:
    """Print how often the gate of each fault finds it, and which others warn."""
    print(f"\nfaults of the first run found by their gate [%], {tables} tables each")
    print(f"  {'':42s}{'one run':>8s}{'3 runs':>8s}  gate (others that warn of 5 % or more)")
    for fault, (gate, _) in FAULTS.items():
        alone, among = (
            rates(regime, fault, tables // len(regime.temperatures), seed, pool)
            for regime in (ONE, ALL)
        )
        others = [
            f"{name} {rate:.0f}"
            for name, rate in alone.items()
            if name not in (gate, "any gate") and rate >= 5.0
        ]
        also = f" ({', '.join(others)})" if others else ""
        print(f"  {fault:42s}{alone[gate]:8.1f}{among[gate]:8.1f}  {gate}{also}")
        sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
