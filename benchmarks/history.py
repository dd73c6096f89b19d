"""Coverage of the drift intervals of `accelcal.history`, false alarms and finds of its jumps.

    python benchmarks/history.py            # 400 units a line, some minutes
    python benchmarks/history.py --smoke    # 60 units a line

The units are drawn here, without accelcal: dates at random over ten years, stated uncertainties
that differ, a part of each error that all calibrations of a unit share, and a scatter from one
calibration to the next that nobody has stated, normal or with heavy tails (Student, 4 degrees of
freedom).
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pandas as pd

import accelcal
from accelcal.probability import student_quantile
from accelcal.recalibrations.regression import fit_line

UG = 1e-6


class Kind(NamedTuple):
    """How units are drawn; sizes in ug."""

    count: int
    scatter: float
    shared: float = 0.0
    heavy: bool = False
    jump: float = 0.0


KINDS = (
    *(
        Kind(count, scatter, shared)
        for count in (3, 5, 8, 16)
        for scatter, shared in ((0.0, 0.0), (0.0, 0.7), (10.0, 0.0), (40.0, 0.0))
    ),
    Kind(12, 40.0, heavy=True),
)

JUMPS = tuple(Kind(count, 10.0, jump=size) for count in (6, 12) for size in (50.0, 100.0, 200.0))

DRIFT = 5.0  # ug a year
STATED = 10.0  # ug, the median standard uncertainty


def unit(kind: Kind, rng: np.random.Generator) -> pd.DataFrame:
    """Draw the recalibrations of one unit, as the frame of a batch has them."""
    days = np.sort(rng.choice(3653, kind.count, replace=False))
    stated = STATED * np.exp(rng.normal(0.0, 0.4, kind.count))
    own = math.sqrt(1.0 - kind.shared**2)
    error = stated * (own * rng.standard_normal(kind.count) + kind.shared * rng.standard_normal())
    tails = rng.standard_t(4, kind.count) / math.sqrt(2.0) if kind.heavy else None
    error = error + kind.scatter * (rng.standard_normal(kind.count) if tails is None else tails)
    step = kind.jump * (np.arange(kind.count) >= kind.count // 2)
    bias = 3000.0 + DRIFT * days / 365.25 + step + error
    gain = 1.35 * (1.0 + 1e-6 * rng.normal(0.0, 10.0, kind.count))
    start = np.datetime64("2010-01-01")
    return pd.DataFrame(
        {
            "serial": "A",
            "source": [f"{n}.csv" for n in range(kind.count)],
            "mounting": "o+",
            "date": np.datetime_as_string(start + days.astype("timedelta64[D]"), unit="D"),
            "temperature_degC": 20.0,
            "k0": UG * bias,
            "k0_standard_uncertainty": UG * stated,
            "K1": gain,
            "K1_standard_uncertainty": 1.35e-5,
        }
    )


def covers(found: accelcal.History) -> bool:
    """Whether the interval of the drift of the bias holds the truth."""
    drift = found.trends[0].drift
    return abs(drift.value - UG * DRIFT) <= drift.expanded_uncertainty


def without_scatter(frame: pd.DataFrame) -> bool:
    """The same of an ordinary weighted regression, which believes the stated uncertainties."""
    time = pd.to_datetime(frame["date"]).to_numpy("datetime64[D]").astype(float) / 365.25
    columns = np.stack([np.ones(time.size), time - time.mean()], axis=1)
    weights = frame["k0_standard_uncertainty"].to_numpy() ** -2.0
    inverse = np.linalg.inv(columns.T @ (weights[:, None] * columns))
    slope = (inverse @ (columns.T @ (weights * frame["k0"].to_numpy())))[1]
    return bool(abs(slope - UG * DRIFT) <= student_quantile(0.975, math.inf) * inverse[1, 1] ** 0.5)


def line_without_search(frame: pd.DataFrame) -> bool:
    """The same of the line alone, without a search for jumps."""
    time = pd.to_datetime(frame["date"]).to_numpy("datetime64[D]").astype(float) / 365.25
    columns = np.stack([np.ones(time.size), time - time.mean()], axis=1)
    fit = fit_line(columns, frame["k0"].to_numpy(), frame["k0_standard_uncertainty"].to_numpy())
    half = student_quantile(0.975, fit.dof) * fit.covariance[1, 1] ** 0.5
    return bool(abs(fit.coefficients[1] - UG * DRIFT) <= half)


def trial(kind: Kind, rng: np.random.Generator) -> tuple[bool, ...]:
    """One unit: coverages, and whether a jump is named, in the right place."""
    frame = unit(kind, rng)
    found = accelcal.history(frame, alpha=0.01)
    jumps = [jump for trend in found.trends for jump in trend.jumps]
    right = [
        jump for jump in found.trends[0].jumps if jump.before == frame["date"][kind.count // 2]
    ]
    return (
        covers(found),
        line_without_search(frame),
        without_scatter(frame),
        bool(jumps),
        bool(right),
    )


def lines(kinds: tuple[Kind, ...], units: int) -> Iterator[tuple[Kind, list[float]]]:
    """Percent of the units, kind by kind."""
    for number, kind in enumerate(kinds):
        rng = np.random.default_rng([20, number])
        done = np.array([trial(kind, rng) for _ in range(units)])
        yield kind, (100.0 * done.mean(axis=0)).tolist()


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--smoke", action="store_true", help="60 units a line, four lines")
    parser.add_argument("--units", type=int, default=400, help="units a line")
    asked = parser.parse_args()
    units = 60 if asked.smoke else asked.units
    print(f"{units} units a line; stated standard uncertainty about {STATED:g} ug")
    print(f"Percent of units whose 95 % interval of the drift ({DRIFT:g} ug/year) holds the truth,")
    print("and of units without a jump in which one is named")
    print(
        "calibrations  scatter/ug  shared  tails   history  line alone  stated only  false alarms"
    )
    for kind, share in lines(KINDS[:16:5] if asked.smoke else KINDS, units):
        tails = "heavy" if kind.heavy else "normal"
        print(
            f"{kind.count:12d}  {kind.scatter:10g}  {kind.shared:6g}  {tails:6}  {share[0]:7.1f}"
            f"  {share[1]:10.1f}  {share[2]:11.1f}  {share[3]:12.1f}"
        )
    print("Percent of units whose jump in the middle is named; scatter 10 ug")
    print("calibrations  jump/ug  named  at its place  drift holds the truth")
    for kind, share in lines(JUMPS[4:5] if asked.smoke else JUMPS, units):
        print(
            f"{kind.count:12d}  {kind.jump:7g}  {share[3]:5.1f}  {share[4]:12.1f}  {share[0]:21.1f}"
        )


if __name__ == "__main__":
    main()
