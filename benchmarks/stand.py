"""The stand or the unit: how often an effect is given to the right one, and what it gains.

Run ``python benchmarks/stand.py`` (an hour or less) or with ``--smoke`` (a minute). The units of a
stand come from `hidden`, which shares no code with accelcal.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import NamedTuple
from zlib import crc32

import numpy as np
from hidden.cases import Case as Hidden
from hidden.design import DESIGNS
from hidden.table import Table
from hidden.units import units_of_one_stand
from rivals.trial import _record

import accelcal
from accelcal.discovery.base import base_model
from accelcal.results.stand_discovery import StandDiscovery

OF_STANDS = ("backlash", "position-error", "foundation-tilt")
OF_UNITS = (
    "warm-up",
    "bias-step",
    "hysteresis",
    "stroke-offset",
    "scale-factor-asymmetry",
    "cross-axis-cubic",
    "k2-temperature",
)
CLASSES = (
    {"scale-factor-asymmetry", "fourth-order"},
    {"cross-axis-cubic", "dead-zone"},
)
"""Effects that 8 positions show as one and the same."""


class Case(NamedTuple):
    """Some units on one stand."""

    section: str
    regime: str
    of_stand: str
    of_unit: str
    s: float
    units: int
    number: int
    design: str = "three"


class Outcome(NamedTuple):
    """What came of it.

    Attributes
    ----------
    case : Case
        The units.
    verdicts : dict of str to str
        Verdict on each effect that was found.
    to_the_stand, to_the_unit : bool
        Whether the hidden effect was given to the stand, or to the right unit and no other.
    claimed, errors : dict of str to tuple of float
        For each coefficient the median standard uncertainty and the mean square error over the
        units: with the stand from own readings, and jointly.
    seconds : float
        Taken.
    """

    case: Case
    verdicts: dict[str, str]
    to_the_stand: bool
    to_the_unit: bool
    claimed: dict[str, tuple[float, ...]]
    errors: dict[str, tuple[float, ...]]
    seconds: float


def clean(stands: int) -> Iterator[Case]:
    for regime in ("iid", "head", "launch", "all"):
        yield from (Case("clean", regime, "", "", 0.0, 8, i) for i in range(stands))


def of_the_stand(stands: int) -> Iterator[Case]:
    for s in (0.5, 1.0, 2.0, 4.0):
        for i in range(stands):
            name = OF_STANDS[i % len(OF_STANDS)]
            regime = "launch" if name == "position-error" else ("iid", "head", "all")[i % 3]
            yield Case("stand", regime, name, "", s, 8, i)


def of_one_unit(stands: int) -> Iterator[Case]:
    for s in (2.0, 4.0, 8.0):
        for i in range(stands):
            name = OF_UNITS[i % len(OF_UNITS)]
            yield Case("unit", ("iid", "head", "all")[i % 3], "", name, s, 8, i)


def of_both(stands: int) -> Iterator[Case]:
    for s in (2.0, 4.0):
        for i in range(stands):
            unit, stand = OF_UNITS[i % len(OF_UNITS)], OF_STANDS[i % 2]
            regime = "launch" if stand == "position-error" else ("iid", "head", "all")[i % 3]
            yield Case("both", regime, stand, unit, s, 8, i)


def gains(stands: int) -> Iterator[Case]:
    for name, regime, design in GAINS:
        yield from (Case("gain", regime, name, "", 8.0, 8, i, design) for i in range(stands))


GAINS = (
    ("backlash", "iid", "three"),
    ("backlash", "head", "three"),
    ("foundation-tilt", "iid", "three"),
    ("position-error", "iid", "twelve"),  # 8 positions cannot tell 45 from 135 deg
)

SECTIONS = {
    "clean": clean,
    "stand": of_the_stand,
    "unit": of_one_unit,
    "both": of_both,
    "gain": gains,
}


def tried(case: Case, seed: int) -> Outcome:
    """Draw the units of a stand and look at them."""
    rng = np.random.default_rng([seed, crc32(repr(case[:5]).encode()), case.number])
    where = int(rng.integers(case.units))
    drawn = units_of_one_stand(
        rng,
        DESIGNS[case.design],
        case.regime,
        hidden_stand={case.of_stand: case.s} if case.of_stand else {},
        hidden_unit={where: {case.of_unit: case.s}} if case.of_unit else {},
        n=case.units,
    )
    records = [_record(table) for _, table in drawn]
    start = time.perf_counter()
    found = accelcal.discover_stand(records)
    seconds = time.perf_counter() - start
    claimed, errors = _coefficients(found, drawn) if case.section == "gain" else ({}, {})
    return Outcome(
        case=case,
        verdicts={item.id: item.verdict for item in found.effects},
        to_the_stand=_given(found, case.of_stand, "stand"),
        to_the_unit=_given(found, case.of_unit, "unit", found.units[where]),
        claimed=claimed,
        errors=errors,
        seconds=seconds,
    )


def _given(found: StandDiscovery, name: str, verdict: str, *units: str) -> bool:
    """Whether an effect, or one that is the same to the test, is given to whom it belongs."""
    same = next((group for group in CLASSES if name in group), {name})
    return any(
        bool(same & {item.id, *item.indistinguishable})
        and item.verdict == verdict
        and item.found_in == units
        for item in found.effects
    )


TRUE = {
    "K1": lambda sensor, nominal: sensor.scale / nominal - 1.0,
    "K0": lambda sensor, _: sensor.bias.at,
    "K2": lambda sensor, _: sensor.k2,
    "K3": lambda sensor, _: sensor.k3,
    "M": lambda sensor, _: sensor.delta.at,
    "M above T0": lambda sensor, _: sensor.delta.above,
    "M below T0": lambda sensor, _: sensor.delta.below,
    "M_ip": lambda sensor, _: sensor.cross,
}
"""Coefficient -> its true value; K1 over that of a first fit."""


def _coefficients(
    found: StandDiscovery, drawn: Sequence[tuple[Hidden, Table]]
) -> tuple[dict[str, tuple[float, ...]], dict[str, tuple[float, ...]]]:
    claimed: dict[str, list[tuple[float, ...]]] = defaultdict(list)
    errors: dict[str, list[tuple[float, ...]]] = defaultdict(list)
    for (_, table), changes in zip(drawn, found.coefficients.values(), strict=False):
        nominal = base_model(_record(table), table.design.reference).nominal
        for change in changes:
            if change.coefficient not in TRUE:
                continue
            true = TRUE[change.coefficient](table.world.sensor, nominal)
            pair = (change.before, change.after)
            claimed[change.coefficient].append(tuple(q.standard_uncertainty for q in pair))
            errors[change.coefficient].append(tuple((q.value - true) ** 2 for q in pair))
    return (
        {name: tuple(np.median(rows, axis=0)) for name, rows in claimed.items()},
        {name: tuple(np.mean(rows, axis=0)) for name, rows in errors.items()},
    )


def rates(section: str, found: Sequence[Outcome]) -> Iterator[str]:
    """Lines of a section: rates in percent by size."""
    yield f"\n## {section}"
    groups: dict[object, list[Outcome]] = defaultdict(list)
    for item in found:
        groups[(item.case.s, item.case.regime if section == "clean" else "")].append(item)
    for (s, regime), own in groups.items():
        named = np.mean([bool(item.verdicts) for item in own])
        stand = np.mean([item.to_the_stand for item in own])
        unit = np.mean([item.to_the_unit for item in own])
        wrong = np.mean([_is_wrong(item) for item in own])
        yield (
            f"s = {s:g} {regime:7s} {len(own):4d} stands: any name {100 * named:5.1f},"
            f" stand's {100 * stand:5.1f}, unit's {100 * unit:5.1f}, wrong owner or name"
            f" {100 * wrong:5.1f} %, {np.median([item.seconds for item in own]):.1f} s each"
        )


def _is_wrong(item: Outcome) -> bool:
    """Whether any effect was given to somebody who has it not."""
    has = {"stand": item.case.of_stand, "unit": item.case.of_unit}
    for name, verdict in item.verdicts.items():
        own = has.get(verdict, "")
        same = next((group for group in CLASSES if own in group), {own})
        if verdict != "undecided" and name not in same:
            return True
    return False


def gained(section: str, found: Sequence[Outcome]) -> Iterator[str]:
    """Lines of the section of gains: claimed and true shrinkage."""
    yield f"\n## {section}"
    groups: dict[object, list[Outcome]] = defaultdict(list)
    for item in found:
        if item.claimed:
            groups[item.case[1:3]].append(item)
    for (regime, name), own in groups.items():
        yield f"{name}, {regime}, {len(own)} stands: uncertainty and rms error, jointly over alone"
        for coefficient in TRUE:
            claimed = np.median([item.claimed[coefficient] for item in own], axis=0)
            errors = np.sqrt(np.mean([item.errors[coefficient] for item in own], axis=0))
            yield (
                f"  {coefficient:12s} {claimed[1] / claimed[0]:6.3f} {errors[1] / errors[0]:6.3f}"
                f"   rms error over claimed, jointly {errors[1] / claimed[1]:6.3f}"
            )


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the sections that are asked for."""
    options = _options(arguments)
    print(f"accelcal {accelcal.__version__}, seed {options.seed}", flush=True)
    stands, start = 1 if options.smoke else options.stands, time.monotonic()
    with ProcessPoolExecutor(options.jobs) as pool:
        for section in options.only or SECTIONS:
            cases = list(SECTIONS[section](stands))
            if options.smoke:
                cases = [case._replace(units=4) for case in cases[1::2]]
            found = list(pool.map(partial(tried, seed=options.seed), cases))
            report = gained if section == "gain" else rates
            print("\n".join(report(section, found)), flush=True)
    print(f"{time.monotonic() - start:.0f} s with {options.jobs} processes")
    return 0


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stands", type=int, default=100, help="a line of each section")
    parser.add_argument("--seed", type=int, default=2026)
    parser.add_argument("--only", action="append", choices=SECTIONS, help="may be repeated")
    parser.add_argument(
        "--smoke", action="store_true", help="a stand of four units for every other line"
    )
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
