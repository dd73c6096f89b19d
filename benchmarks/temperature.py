"""Coverage of the temperature laws where temperatures move within a run, and of hysteresis.

    python benchmarks/temperature.py            # 400 records a line
    python benchmarks/temperature.py --smoke    # 40 records of four lines

The tests come from `tumble`, which shares no code with accelcal. The temperatures are moved here:
those of the accelerometer, those that the sensor records, or both; and a bias that depends on how a
level was reached is added. Printed is the share of the 95 % intervals that hold the truth: the
mean, the lowest and the highest of the nine parameters of the laws, of the coefficients of the
tables, and that of h_T.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from coverage import Compared, laws_against_truth, record_of, tables_against_truth
from tumble import Stand, Unit, readings

import accelcal

UNIT = Unit()
THREE = (20.0, 80.0, -40.0)
SCATTER = 0.3  # degC
SETTLING_TIME = 8.0  # readings
HALF_WIDTH = 1e-4  # h_T [g]


class Regime(NamedTuple):
    """A test: what moves, the errors of the stand, all declared, and where a bias is added."""

    name: str
    felt: float = 0.0  # scatter of the temperature of the accelerometer, which is recorded [degC]
    of_sensor: float = 0.0  # scatter that the record has beside [degC]
    settles: float = 0.0  # distance from the level at the start of a run [degC]
    stand: Stand = Stand(head=2e-5, launch=1e-5, launch_sf=1e-5)
    temperatures: tuple[float, ...] = THREE
    branch: tuple[float, ...] = ()  # bias of each run over h_T; NaN either way, at random
    half_width: float = HALF_WIDTH  # h_T [g]
    strokes: int = 6
    laws: tuple[str, ...] = ("readings", "tables")
    four: tuple[float, ...] = ()  # levels at which only every second position is measured [degC]


LITTLE = Stand(head=1e-5, launch=5e-6, launch_sf=5e-6)
LOOP = (-40.0, -10.0, 20.0, 50.0, 80.0, 50.0, 20.0, -10.0, -40.0)
TURN = (20.0, 50.0, 80.0, 50.0, 20.0, -10.0, -40.0, -10.0, 20.0)
CLOSED = {
    "from -40 to 80 degC and back": (LOOP, (0, 1, 1, 1, 0, -1, -1, -1, 0)),
    "from 20 over 80 and -40 to 20 degC": (TURN, (np.nan, 1, 0, -1, -1, -1, 0, 1, 1)),
}
FEWEST = (20.0, 80.0, 20.0, -40.0, 20.0)  # the simplest test that tells h_T
BRANCHES = {"closed at its ends": (np.nan, 0, -1, 0, 1), "open there": (np.nan, 1, -1, -1, 1)}
OPEN = {
    "from -40 to 80 degC and back": (LOOP, (-1, 1, 1, 1, 1, -1, -1, -1, -1)),
    "from 20 over 80 and -40 to 20 degC": (TURN, (np.nan, 1, 1, -1, -1, -1, -1, 1, 1)),
}
REGIMES = (
    Regime("scatter by 0.3 degC, and so does the accelerometer", felt=SCATTER),
    Regime("scatter by 0.3 degC by noise of the sensor alone", of_sensor=SCATTER),
    Regime("do not scatter"),
    Regime("both scatter by 0.3 degC", felt=SCATTER, of_sensor=SCATTER),
    Regime("do not scatter, 8 positions at T0 and 4 beyond", four=(80.0, -40.0)),
    Regime("do not scatter, 4 positions at T0 and 8 beyond", four=(20.0,)),
    Regime("settle", settles=1.5, stand=LITTLE, laws=("tables",)),
    *(
        Regime(
            f"loop {how}, {ends}",
            stand=LITTLE,
            temperatures=levels,
            branch=branch,
            strokes=2,
            laws=("tables",),
        )
        for ends, loops in (("closed at its ends", CLOSED), ("open there", OPEN))
        for how, (levels, branch) in loops.items()
    ),
    *(
        Regime(
            f"loop of five runs, {1e6 * half_width:.0f} ug, {ends}",
            stand=LITTLE,
            temperatures=FEWEST,
            branch=branch,
            half_width=half_width,
            strokes=2,
        )
        for ends, branch in BRANCHES.items()
        for half_width in (5e-6, 1e-5, 2e-5, 5e-5)
    ),
)


def output(temperature: float, angle: float) -> float:
    """Output (1) of the unit, without errors."""
    a_i, a_p, k = np.cos(angle), np.sin(angle), UNIT.at(temperature)
    even = k["K0"] + k["K2"] * a_i**2 + k["M_ip"] * a_i * a_p
    return float(even + k["K1"] * a_i + k["K3"] * a_i**3 + k["M"] * a_p)


def record(regime: Regime, rng: np.random.Generator) -> accelcal.TumbleRecord:
    """Readings of a test, with the temperatures as recorded."""
    stand, runs = regime.stand, regime.temperatures
    columns = readings(UNIT, stand, rng, strokes=regime.strokes, temperatures=runs)
    declared = {
        "head_uncertainty": stand.head,
        "launch_uncertainty": stand.launch,
        "launch_sf_uncertainty": stand.launch_sf,
    }
    level, angle = np.array(columns["temperature"]), np.radians(columns["angle"])
    length = level.size // len(runs)
    settling = np.exp(-np.arange(length) / SETTLING_TIME)
    moved = regime.settles * np.tile(settling, len(runs))
    moved += regime.felt * rng.standard_normal(level.size)
    recorded = moved + regime.of_sensor * rng.standard_normal(level.size)
    shift = [
        output(T + by, at) - output(T, at) for T, by, at in zip(level, moved, angle, strict=True)
    ]
    branch = np.array(regime.branch or (0.0,) * len(runs))
    branch = np.where(np.isnan(branch), rng.choice((-1.0, 1.0)), branch)
    gain = np.array([UNIT.at(T)["K1"] for T in runs])
    bias = np.repeat(gain * regime.half_width * branch, length)
    whole = record_of(columns, declared)
    found = replace(
        whole,
        output=whole.output + shift + bias,
        temperature=whole.temperature + recorded,
    )
    return found.select(~np.isin(level, regime.four) | (found.angle % 90.0 == 0.0))


def held(regime: Regime, laws: str, number: int) -> dict[str, dict[tuple[str, str], bool]]:
    """Which intervals of one test hold the truth, by what they are of."""
    found = accelcal.fit(
        record(regime, np.random.default_rng([40, number])),
        temperature_laws=laws,
        reference_temperature=20.0,
    )
    if regime.branch:
        width = found.temperature_model.hysteresis
        own = [(("h_T", ""), width, regime.half_width, 1.0)]
        return {"h_T": hits(own), "laws": hits(laws_against_truth(found, UNIT)[:3])}
    told = {"laws": hits(laws_against_truth(found, UNIT))}
    if regime.four:  # K1 of these tables stands for K1 + K3
        return told
    return {**told, "tables": hits(tables_against_truth(found, UNIT))}


def hits(compared: Compared) -> dict[tuple[str, str], bool]:
    """Which intervals hold the truth."""
    return {key: abs(q.value - truth) <= q.expanded_uncertainty for key, q, truth, _ in compared}


def line(regime: Regime, laws: str, records: int, pool: Any) -> str:
    """One line of the output."""
    found = list(pool.map(partial(held, regime, laws), range(records), chunksize=10))
    cells = []
    for what in found[0]:
        shares = [100.0 * np.mean([one[what][key] for one in found]) for key in found[0][what]]
        lowest, middle, highest = min(shares), np.mean(shares), max(shares)
        cells.append(f"{what} {middle:.1f} ({lowest:.1f} to {highest:.1f})")
    return f"{regime.name}, laws from {laws}: {'; '.join(cells)}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the coverage, a line a regime and kind of laws."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", type=int, default=400, help="records a line")
    parser.add_argument("--only", default="", help="regimes whose names contain this")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--smoke", action="store_true", help="40 records of four lines")
    asked = parser.parse_args(arguments)
    records = 40 if asked.smoke else asked.records
    regimes = REGIMES[5:8] if asked.smoke else REGIMES
    print(f"{records} records a line; percent of the 95 % intervals that hold the truth")
    with ProcessPoolExecutor(asked.jobs) as pool:
        for regime in (r for r in regimes if asked.only in r.name):
            for laws in regime.laws:
                print(line(regime, laws, records, pool), flush=True)


if __name__ == "__main__":
    main()
