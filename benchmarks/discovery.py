"""Discovery: how often the missing effect gets its name, beside methods that people would use.

Run ``python benchmarks/discovery.py`` (hours) or with ``--smoke`` (a minute). The tables come from
`hidden`, which shares no code with accelcal; all methods see the same ones. scikit-learn,
sysidentpy and pysindy come with ``pip install accelcal[benchmarks]``; a method whose package is
missing says so.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import groupby

from rivals.cases import LOOKED_AT, SECTIONS, Case
from rivals.methods import METHODS, is_installed
from rivals.report import REPORTS
from rivals.trial import Outcome, seconds_alone, tried

import accelcal

AT_ONCE = 25
"""Tables of one design and regime that share a null simulation, at most."""

SMOKE = {"memory": 2}
"""Tables of a section in a smoke, if not one."""


def chosen(section: str, tables: int, *, smoke: bool) -> list[Case]:
    """Cases of a section; of a smoke, one or two from all over it."""
    cases, few = list(SECTIONS[section](2 if smoke else tables)), SMOKE.get(section, 1)
    return cases[:: len(cases) // few][:few] if smoke else cases


def parts(cases: list[Case]) -> Iterator[list[Case]]:
    """Cases of one design and regime together."""

    def sort(case: Case) -> tuple[str, str]:
        return case.design, case.regime

    for _, group in groupby(sorted(cases, key=sort), key=sort):
        own = list(group)
        yield from (own[i : i + AT_ONCE] for i in range(0, len(own), AT_ONCE))


def outcomes(
    section: str, cases: list[Case], methods: Sequence[str], seed: int, pool: ProcessPoolExecutor
) -> list[Outcome]:
    """Try all tables of a section, with progress on standard error."""
    todo = list(parts(cases))
    total, done, found = sum(map(len, todo)), 0, []
    for part, results in zip(
        todo, pool.map(partial(tried, methods=methods, seed=seed), todo), strict=True
    ):
        done += len(part)
        found += results
        print(f"\r{section}: {done} of {total} tables", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the sections that are asked for."""
    options = _options(arguments)
    print(f"accelcal {accelcal.__version__}, seed {options.seed}", flush=True)
    methods = [m for m in METHODS if is_installed(m) and m in (options.method or METHODS)]
    start = time.monotonic()
    with ProcessPoolExecutor(options.jobs) as pool:
        for section in options.only or SECTIONS:
            cases = chosen(section, options.tables, smoke=options.smoke)
            found = outcomes(section, cases, methods, options.seed, pool)
            print("\n" + "\n".join(REPORTS[section](found)), flush=True)
        if not options.smoke:
            _print_alone(options.seed, pool)
    print(f"{time.monotonic() - start:.0f} s with {options.jobs} processes")
    return 0


def _print_alone(seed: int, pool: ProcessPoolExecutor) -> None:
    cases = [Case("alone", "backlash", design, "iid", 4.0, 0) for design in LOOKED_AT]
    seconds = pool.map(partial(seconds_alone, seed=seed), cases)
    told = ", ".join(f"{c.design} {s:.2f}" for c, s in zip(cases, seconds, strict=True))
    print(f"one table with a null simulation of its own [s]: {told}")


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tables", type=int, default=1000, help="a line of each section")
    parser.add_argument("--seed", type=int, default=2026)
    parser.add_argument("--only", action="append", choices=SECTIONS, help="may be repeated")
    parser.add_argument("--method", action="append", choices=METHODS, help="may be repeated")
    parser.add_argument("--smoke", action="store_true", help="a table or two of each section")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
