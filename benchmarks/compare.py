"""Coverage of `accelcal compare`: how often its intervals hold the change of a unit.

Run ``python benchmarks/compare.py`` (minutes) or with ``--smoke`` (seconds). Both tests come from
`tumble`, which shares no code with accelcal: one unit, measured twice on one head or on two, on the
same side or on the other one. Nothing of it has changed, or what the last regimes name. Regimes
marked with a star are wider than needed, and say why. Exit code 1 means a share that is off
95 % by more than 2 %, and by more than four standard errors of the number of trials.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
from tumble import Stand, Unit, readings

import accelcal

HEAD = 2e-5
DECLARED = {"head_uncertainty": HEAD}
LAUNCH = {"launch_uncertainty": 5e-6, "launch_sf_uncertainty": 5e-6}
STAND = Stand(head=HEAD, launch=5e-6, launch_sf=5e-6)
THREE = (20.0, 80.0, -40.0)
SIX = 2 * THREE
NAMES = ("k0", "K1", "delta", "k2", "k3", "delta_ip")
OFF = 2.0


@dataclass(frozen=True)
class Regime:
    """How the unit was calibrated, how it is measured again, and what the user says of the head."""

    name: str
    one_head: bool
    told: bool | None
    first: tuple[str, ...] = ("o+",)
    second: tuple[str, ...] = ("o+",)
    declared: dict[str, float] = field(default_factory=lambda: DECLARED | LAUNCH)
    temperatures: tuple[float, ...] = (20.0,)
    positions: tuple[int, int] = (8, 8)
    strokes: tuple[int, int] = (6, 6)
    method: str = "least-squares"
    changed: dict[str, float] = field(default_factory=dict)  # of the unit since the first test


REGIMES = (
    Regime("one head", True, True),
    Regime("two heads", False, False),
    Regime("* one head, not told: as of two", True, None),
    Regime("one head, three levels", True, True, temperatures=THREE),
    Regime("two heads, three levels", False, False, temperatures=THREE),
    Regime("one head, estimated", True, True, declared=LAUNCH),
    Regime("two heads, estimated", False, False, declared=LAUNCH),
    Regime("one head, launches estimated", True, True, declared=DECLARED, temperatures=SIX),
    Regime("one head, closed form", True, True, method="closed-form"),
    Regime("one head, 12 positions and then 8", True, True, positions=(12, 8)),
    Regime("one head, one stroke again", True, True, strokes=(6, 1)),
    Regime("* one head, one stroke both times", True, True, strokes=(1, 1)),
    Regime("one head, the other side", True, True, second=("o-",)),
    Regime("two heads, the other side", False, False, second=("o-",)),
    Regime("* one head, the other side, not told", True, None, second=("o-",)),
    Regime("* two heads, the other side, not told", False, None, second=("o-",)),
    Regime("one head, the other axis", True, True, ("o+", "p+"), ("p+",)),
    Regime("two heads, the other axis", False, False, ("o+", "p+"), ("p+",)),
    Regime(
        "one head, the other axis, three levels",
        True,
        True,
        ("o+", "p+"),
        ("p+",),
        temperatures=THREE,
    ),
    Regime("one head, both sides and then one", True, True, ("o+", "o-"), ("o-",)),
    Regime("two heads, both sides and then one", False, False, ("o+", "o-"), ("o-",)),
)
CHANGED = tuple(
    replace(regime, name=f"{regime.name}, {what}", changed=changed)
    for regime in REGIMES[:2]
    for what, changed in (
        ("k0 and k2 changed", {"k0": 1e-4, "k2": 8e-5}),
        ("k3 and delta_ip changed", {"k3": 1e-4, "delta_ip": 5e-5}),
    )
)
UNITS = {"o": Unit(), "p": Unit(delta=-0.4e-3, delta_ip=-12e-6)}


def unit_of(regime: Regime, which: int, axis: str) -> Unit:
    """The unit as it is in a test."""
    unit = UNITS[axis]
    now = {name: asdict(unit)[name] + which * by for name, by in regime.changed.items()}
    return replace(unit, **now)


def record_of(
    regime: Regime, which: int, head: Sequence[float], rng: np.random.Generator
) -> accelcal.TumbleRecord:
    """One test of the unit, with all of its mountings on one head."""
    parts = []
    for mounting in (regime.first, regime.second)[which]:
        columns = readings(
            unit_of(regime, which, mounting[0]),
            STAND,
            rng,
            positions=regime.positions[which],
            strokes=regime.strokes[which],
            temperatures=regime.temperatures,
            head=head,
            side=1.0 if mounting[1] == "+" else -1.0,
        )
        parts.append((mounting, {name: np.array(values) for name, values in columns.items()}))
    whole = {name: np.concatenate([own[name] for _, own in parts]) for name in parts[0][1]}
    runs = [own["run"] + i * len(regime.temperatures) for i, (_, own) in enumerate(parts)]
    run = np.concatenate(runs).astype(np.int64)
    return accelcal.TumbleRecord(
        output=whole["output"],
        angle=whole["angle"],
        temperature=whole["temperature"],
        stroke=whole["stroke"].astype(np.int64),
        run=run,
        run_labels=tuple(map(str, range(run.max() + 1))),
        mounting=np.concatenate([np.full(own["run"].size, m) for m, own in parts]),
        position=np.zeros(run.size, dtype=np.int64),
        reference_temperature=20.0,
        apparatus=accelcal.Apparatus(temperature_uncertainty=0.0, **regime.declared),
    )


def heads(regime: Regime, rng: np.random.Generator) -> tuple[list[float], list[float]]:
    """Errors of the positions of both tests: of one head those that both have are the same."""
    graduations = [{360.0 * j / n: 0.0 for j in range(n)} for n in regime.positions]
    errors = {angle: HEAD * rng.standard_normal() for own in graduations for angle in own}
    first, second = ([errors[angle] for angle in own] for own in graduations)
    return first, second if regime.one_head else (HEAD * rng.standard_normal(len(second))).tolist()


def trial(regime: Regime, seed: int) -> tuple[list[list[bool]], list[list[float]], float]:
    """Whether each interval holds the change, their half widths, and the chance of noise."""
    rng = np.random.default_rng(seed)
    records = [record_of(regime, i, head, rng) for i, head in enumerate(heads(regime, rng))]
    calibration = accelcal.fit(records[0], method=regime.method)
    found = accelcal.compare(calibration, records[1], same_head=regime.told)
    truth = [regime.changed.get(name, 0.0) for name in NAMES]
    changes: list[Any] = [run.changes for run in found.runs]
    held = [
        [abs(q.value - by) <= q.expanded_uncertainty for q, by in zip(row, truth, strict=True)]
        for row in changes
    ]
    return held, [[q.expanded_uncertainty for q in row] for row in changes], found.p_value


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--trials", type=int, default=600)
    parser.add_argument("--smoke", action="store_true", help="a few trials only")
    parser.add_argument("--only", default="", help="regimes with this in their name")
    asked = parser.parse_args()
    trials = 5 if asked.smoke else asked.trials
    print(f"{trials} trials a line; percent of intervals of 95 % that hold, and their half widths")
    headings = ("bias", "K1", "delta", *NAMES[3:], "p < 0.05", "p < 0.01")
    print(" " * 40 + "".join(f"{name:>13}" for name in headings))
    off = max(OFF, 400.0 * (0.95 * 0.05 / trials) ** 0.5)  # four standard errors
    bad = 0
    for regime in (*REGIMES, *CHANGED):
        if asked.only not in regime.name:
            continue
        held, wide, p = zip(*(trial(regime, seed) for seed in range(trials)), strict=True)
        share = 100.0 * np.mean(np.concatenate(held), axis=0)
        width = 1e6 * np.median(np.concatenate(wide), axis=0)
        alarms = [100.0 * np.mean(np.array(p) < level) for level in (0.05, 0.01)]
        cells = [f"{s:.1f} ({w:.1f})" for s, w in zip(share, width, strict=True)]
        cells += [f"{share:.1f}" for share in alarms]
        print(f"{regime.name:40}" + "".join(f"{cell:>13}" for cell in cells), flush=True)
        starred = regime.name.startswith("*")
        bad += int(((share < 95.0 - off) | ((share > 95.0 + off) & (not starred))).any())
    return 1 if bad and not asked.smoke else 0


if __name__ == "__main__":
    sys.exit(main())
