"""Coverage of the drift intervals of `accelcal.history`, false alarms and finds of its jumps.

    python benchmarks/history.py            # 400 units a line, some minutes
    python benchmarks/history.py --choices  # other intervals that were tried
    python benchmarks/history.py --alarms --units 2000  # false alarms of few calibrations alone
    python benchmarks/history.py --wandering  # units that wander, which the drift does not know
    python benchmarks/history.py --settling  # units that settle, whose drift slows
    python benchmarks/history.py --campaigns  # three tests within four days each time
    python benchmarks/history.py --returns  # jumps that return after two calibrations
    python benchmarks/history.py --smoke    # 30 units of a few lines

The units are drawn here, without accelcal: dates at random over ten years, stated uncertainties
that differ, a part of each error that all calibrations of a unit share, and a scatter from one
calibration to the next that nobody has stated, normal or with heavy tails (Student, 4 degrees of
freedom). Every other calibration may state five times as much, truly or not.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import minimize_scalar
from scipy.stats import binomtest

import accelcal
from accelcal.numerics.probability import LEVEL, NORMAL_FACTOR, student_quantile
from accelcal.recalibrations.jumps import FEWEST
from accelcal.recalibrations.regression import fit_line, scatter_where

UG = 1e-6


class Kind(NamedTuple):
    """How units are drawn; sizes in ug."""

    count: int
    scatter: float
    shared: float = 0.0
    heavy: bool = False
    jump: float = 0.0
    unlike: float = 1.0  # every other calibration states so many times as much
    truly: bool = False  # and errs so many times as much
    walk: float = 0.0  # of a unit that wanders, in a root year
    tests: int = 1  # two days after each other, which share the scatter; `count` is of all
    settles: float = 0.0  # from the first day on, in all, with a time constant of two years
    returns: int = 0  # calibrations until the jump returns; 0 where it stays

    @property
    def steps(self) -> tuple[int, ...]:
        """Calibrations before the jump, and before its return."""
        if not self.returns:
            return (self.count // 2,)
        start = (self.count - self.returns) // 2
        return start, start + self.returns

    def __str__(self) -> str:
        """Columns of the tables."""
        unlike = "no" if self.unlike == 1.0 else f"{self.unlike:g}x{' true' * self.truly}"
        return f"{self.count:12d}  {self.scatter:10g}  {self.shared:6g}  {unlike:>7}"


KINDS = (
    *(
        Kind(count, scatter, shared)
        for count in (3, 5, 8, 16)
        for scatter, shared in ((0.0, 0.0), (0.0, 0.7), (10.0, 0.0), (40.0, 0.0))
    ),
    Kind(12, 40.0, heavy=True),
    *(
        Kind(count, scatter, unlike=5.0, truly=truly)
        for count in (5, 8)
        for scatter in (0.0, 10.0, 40.0)
        for truly in (False, True)
    ),
)

JUMPS = tuple(Kind(count, 10.0, jump=size) for count in (6, 12) for size in (50.0, 100.0, 200.0))

WALKS = tuple(Kind(count, 0.0, walk=walk) for walk in (0.0, 20.0) for count in (5, 8, 15, 30))

SETTLING = tuple(
    Kind(count, 10.0, settles=size) for size in (0.0, 100.0, 300.0) for count in (4, 5, 8, 15)
)

RETURNS = tuple(
    Kind(count, 10.0, jump=size, returns=2) for count in (6, 8, 10) for size in (0.0, 300.0, 1000.0)
)

CAMPAIGNS = tuple(
    Kind(3 * count, scatter, tests=3) for count in (5, 8, 15) for scatter in (0.0, 10.0, 40.0)
)

HEADING = "calibrations  scatter/ug  shared   unlike"
DRIFT = 5.0  # ug a year
STATED = 10.0  # ug, the median standard uncertainty
SETTLED = 2.0  # years, the time constant
_APART = 16  # days from one date to the next, or more, as tests of a week count as one


def unit(kind: Kind, rng: np.random.Generator) -> pd.DataFrame:
    """Draw the recalibrations of one unit, as the frame of a batch has them."""
    dates = kind.count // kind.tests
    apart = np.sort(rng.choice(3653 // _APART, dates, replace=False)) * _APART
    days = np.repeat(apart, kind.tests)
    days = np.sort(days + 2 * (np.arange(kind.count) % kind.tests))
    stated = STATED * np.exp(rng.normal(0.0, 0.4, kind.count))
    factor = np.where(np.arange(kind.count) % 2, kind.unlike, 1.0)
    own = math.sqrt(1.0 - kind.shared**2)
    error = stated * (own * rng.standard_normal(kind.count) + kind.shared * rng.standard_normal())
    error = error * factor if kind.truly else error
    tails = rng.standard_t(4, dates) / math.sqrt(2.0) if kind.heavy else None
    scatter = kind.scatter * (rng.standard_normal(dates) if tails is None else tails)
    error = error + np.repeat(scatter, kind.tests)
    if kind.walk:
        steps = np.diff(days, prepend=days[0]) / 365.25
        error = error + kind.walk * np.cumsum(np.sqrt(steps) * rng.standard_normal(kind.count))
    passed = [(np.arange(kind.count) >= place).astype(float) for place in kind.steps]
    step = kind.jump * (passed[0] - sum(passed[1:]))
    settled = kind.settles * np.exp(-(days - days[0]) / 365.25 / SETTLED)
    bias = 3000.0 + DRIFT * days / 365.25 + step + settled + error
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
            "k0_standard_uncertainty": UG * factor * stated,
            "K1": gain,
            "K1_standard_uncertainty": 1.35e-5,
        }
    )


def holds(told: accelcal.Quantity, truth: float) -> bool:
    """Whether an interval holds the truth [ug]."""
    return abs(told.value - UG * truth) <= told.expanded_uncertainty


def without_scatter(frame: pd.DataFrame) -> bool:
    """The same of an ordinary weighted regression, which believes the stated uncertainties."""
    time = pd.to_datetime(frame["date"]).to_numpy("datetime64[D]").astype(float) / 365.25
    columns = np.stack([np.ones(time.size), time - time.mean()], axis=1)
    weights = frame["k0_standard_uncertainty"].to_numpy() ** -2.0
    inverse = np.linalg.inv(columns.T @ (weights[:, None] * columns))
    slope = (inverse @ (columns.T @ (weights * frame["k0"].to_numpy())))[1]
    return bool(abs(slope - UG * DRIFT) <= NORMAL_FACTOR * inverse[1, 1] ** 0.5)


def line_without_search(frame: pd.DataFrame) -> bool:
    """The same of the line alone, without a search for jumps."""
    time = pd.to_datetime(frame["date"]).to_numpy("datetime64[D]").astype(float) / 365.25
    columns = np.stack([np.ones(time.size), time - time.mean()], axis=1)
    fit = fit_line(columns, frame["k0"].to_numpy(), frame["k0_standard_uncertainty"].to_numpy())
    half = student_quantile(LEVEL, fit.dof) * fit.uncertainties[1]
    return bool(abs(fit.coefficients[1] - UG * DRIFT) <= half)


def trial(kind: Kind, rng: np.random.Generator) -> tuple[bool, ...]:
    """One unit: coverages, and whether a jump is named, in the right place."""
    frame = unit(kind, rng)
    found = accelcal.history(frame, alpha=0.01)
    jumps = [jump for trend in found.trends for jump in trend.jumps]
    right = [jump for jump in found.trends[0].jumps if jump.before == frame["date"][kind.steps[0]]]
    return (
        holds(found.trends[0].drift, DRIFT),
        line_without_search(frame),
        without_scatter(frame),
        bool(jumps),
        bool(right),
        any(holds(jump.size, kind.jump) for jump in right),
    )


def restricted(columns: np.ndarray, values: np.ndarray, uncertainty: np.ndarray) -> float:
    """Scatter beyond the stated uncertainties by restricted maximum likelihood."""

    def loss(tau: float) -> float:
        weights = 1.0 / (uncertainty**2 + tau**2)
        normal = columns.T @ (weights[:, None] * columns)
        residual = values - columns @ np.linalg.solve(normal, columns.T @ (weights * values))
        return float(weights @ residual**2 - np.log(weights).sum() + np.linalg.slogdet(normal)[1])

    best = minimize_scalar(loss, bounds=(0.0, float(np.ptp(values))), method="bounded").x
    return float(best) if loss(best) < loss(0.0) else 0.0


def paule_mandel(columns: np.ndarray, values: np.ndarray, uncertainty: np.ndarray) -> float:
    """Scatter beyond the stated uncertainties as accelcal has it."""
    return scatter_where(columns, values, uncertainty, values.size - columns.shape[1])


def choices(kind: Kind, rng: np.random.Generator) -> list[bool]:
    """Whether each of the intervals of the drift that were tried holds the truth."""
    frame = unit(kind, rng)
    time = pd.to_datetime(frame["date"]).to_numpy("datetime64[D]").astype(float) / 365.25
    columns = np.stack([np.ones(time.size), time - time.mean()], axis=1)
    values = frame["k0"].to_numpy()
    uncertainty = frame["k0_standard_uncertainty"].to_numpy()
    dof, found = kind.count - 2, [line_without_search(frame)]
    for estimate in (restricted, paule_mandel):
        weights = 1.0 / (uncertainty**2 + estimate(columns, values, uncertainty) ** 2)
        inverse = np.linalg.inv(columns.T @ (weights[:, None] * columns))
        coefficients = inverse @ (columns.T @ (weights * values))
        factor = float(weights @ (values - columns @ coefficients) ** 2) / dof
        off, size = abs(coefficients[1] - UG * DRIFT), inverse[1, 1] ** 0.5
        student = student_quantile(LEVEL, dof)
        found += [off <= student * size * q**0.5 for q in (factor, max(factor, 1.0))]
    return [*found, off <= NORMAL_FACTOR * size]


def print_choices(units: int) -> None:
    """Print the coverage of the intervals that were tried."""
    print(f"{units} units a line; percent whose 95 % interval of the drift holds the truth")
    print(f"{'REML':>57}{'Paule-Mandel':>18}")
    print(f"{HEADING}   mean     KH   >= 1     KH   >= 1  normal")
    for number, kind in enumerate(KINDS):
        rng = np.random.default_rng([30, number])
        share = 100.0 * np.array([choices(kind, rng) for _ in range(units)]).mean(axis=0)
        cells = "".join(f"{one:7.1f}" for one in share)
        print(f"{kind}{cells}", flush=True)


def print_alarms(units: int) -> None:
    """Print how often a jump is named where none is, with limits of Clopper and Pearson."""
    print(f"{units} units a line without a jump; percent in which one is named, with 95 % limits")
    print(f"{HEADING}  false alarms")
    counts = []
    for number, kind in enumerate(kind for kind in KINDS if kind.count == FEWEST):
        rng = np.random.default_rng([40, number])
        counts.append(sum(has_jump(unit(kind, rng)) for _ in range(units)))
        print(f"{kind}  {share(counts[-1], units)}", flush=True)
    print(f"{'together':>41}  {share(sum(counts), units * len(counts))}")


def print_wandering(kinds: tuple[Kind, ...], units: int) -> None:
    """Print what becomes of the drift and of jumps where a bias wanders, and how often it shows."""
    print(
        f"{units} units a line, whose bias wanders; percent whose interval of the drift holds the"
    )
    print("truth, and that of a walk, in which a jump is named, and in which a note tells of it")
    print("calibrations  walk/ug in a root year  drift  walk   jump   note")
    print_lines(kinds, units, 50, "22g", [kind.walk for kind in kinds], ("the bias wanders",))


def print_settling(kinds: tuple[Kind, ...], units: int) -> None:
    """Print what becomes of the drift where a bias settles, and how often a note tells of it."""
    print(f"{units} units a line, whose bias settles beside a scatter of 10 ug; percent whose")
    print(
        "interval of the drift holds what is left in the end, and that of a walk, in which a jump"
    )
    print("of the bias is named, and in which a note tells that the drift is not that of all years")
    print("calibrations  settles/ug  drift  walk   jump   note")
    said = ("the drift of the bias ", "a line that bends, as of a unit that settles, fits the bias")
    print_lines(kinds, units, 60, "10g", [kind.settles for kind in kinds], said)


def print_lines(
    kinds: tuple[Kind, ...],
    units: int,
    seed: int,
    form: str,
    sizes: list[float],
    said: tuple[str, ...],
) -> None:
    """Print a line a kind: its size, and what becomes of its units in percent."""
    for number, (kind, size) in enumerate(zip(kinds, sizes, strict=True)):
        rng = np.random.default_rng([seed, number])
        done = np.array([told(kind, rng, said) for _ in range(units)])
        cells = "".join(f"{one:7.1f}" for one in (100.0 * done.mean(axis=0)).tolist())
        print(f"{kind.count:12d}  {size:{form}}{cells}", flush=True)


def told(kind: Kind, rng: np.random.Generator, said: tuple[str, ...]) -> tuple[bool, ...]:
    """One unit: whether both drifts are held, a jump is named, and a note begins so."""
    found = accelcal.history(unit(kind, rng), alpha=0.01)
    trend = found.trends[0]
    held = [holds(drift, DRIFT) for drift in (trend.drift, trend.drift_of_a_walk)]
    return *held, bool(trend.jumps), any(note.startswith(said) for note in found.notes)


def print_campaigns(kinds: tuple[Kind, ...], units: int) -> None:
    """Print what tests of a few days, which share their scatter, make of drift and jumps."""
    print(f"{units} units a line, with {kinds[0].tests} tests within four days each time; percent")
    print("whose interval of the drift holds the truth, and in which a jump is named falsely")
    print("campaigns  scatter/ug  drift   jump")
    for number, kind in enumerate(kinds):
        rng = np.random.default_rng([70, number])
        drift, *_, jump, _, _ = 100.0 * np.mean([trial(kind, rng) for _ in range(units)], axis=0)
        print(
            f"{kind.count // kind.tests:9d}  {kind.scatter:10g}{drift:7.1f}{jump:7.1f}", flush=True
        )


def print_returns(kinds: tuple[Kind, ...], units: int) -> None:
    """Print how often a jump and its return are named, and other jumps of the bias."""
    print(f"{units} units a line, whose bias jumps and returns after two calibrations, beside a")
    print("scatter of 10 ug; percent in which both jumps are named, and in which another one is")
    print("calibrations  jump/ug   both  other")
    for number, kind in enumerate(kinds):
        rng = np.random.default_rng([80, number])
        both, other = 100.0 * np.mean([returned(kind, rng) for _ in range(units)], axis=0)
        print(f"{kind.count:12d}  {kind.jump:7g}{both:7.1f}{other:7.1f}", flush=True)


def returned(kind: Kind, rng: np.random.Generator) -> tuple[bool, bool]:
    """One unit: whether a jump and its return are named, and whether any other jump is."""
    frame = unit(kind, rng)
    named = {jump.before for jump in accelcal.history(frame, alpha=0.01).trends[0].jumps}
    right = {frame["date"][place] for place in kind.steps if kind.jump}
    return bool(right) and right <= named, bool(named - right)


def has_jump(frame: pd.DataFrame) -> bool:
    """Whether a jump of the bias or of the scale factor is named."""
    return any(trend.jumps for trend in accelcal.history(frame, alpha=0.01).trends)


def share(count: int, of: int) -> str:
    """A count in percent, with its 95 % limits."""
    low, high = binomtest(count, of).proportion_ci(LEVEL)
    return f"{100.0 * count / of:.2f} ({100.0 * low:.2f} to {100.0 * high:.2f})"


def lines(kinds: tuple[Kind, ...], units: int) -> Iterator[tuple[Kind, list[float]]]:
    """Percent of the units, kind by kind."""
    for number, kind in enumerate(kinds):
        rng = np.random.default_rng([20, number])
        done = np.array([trial(kind, rng) for _ in range(units)])
        yield kind, (100.0 * done.mean(axis=0)).tolist()


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--smoke", action="store_true", help="30 units of a few lines")
    parser.add_argument("--units", type=int, default=400, help="units a line")
    parser.add_argument("--choices", action="store_true", help="intervals that were tried")
    parser.add_argument("--alarms", action="store_true", help="false alarms of few calibrations")
    parser.add_argument("--wandering", action="store_true", help="units that wander")
    parser.add_argument("--settling", action="store_true", help="units that settle")
    parser.add_argument("--campaigns", action="store_true", help="three tests each time")
    parser.add_argument("--returns", action="store_true", help="jumps that return")
    asked = parser.parse_args()
    units = 30 if asked.smoke else asked.units
    for chosen, told, kinds, few in (
        (asked.wandering, print_wandering, WALKS, WALKS[1::6]),
        (asked.campaigns, print_campaigns, CAMPAIGNS, CAMPAIGNS[5:6]),
        (asked.returns, print_returns, RETURNS, RETURNS[5:6]),
        (asked.settling, print_settling, SETTLING, SETTLING[10:11]),
    ):
        if chosen:
            told(few if asked.smoke else kinds, units)
            return
    if asked.alarms:
        print_alarms(units)
        return
    if asked.choices:
        print_choices(units)
        return
    print(f"{units} units a line; stated standard uncertainty about {STATED:g} ug")
    print(f"Percent of units whose 95 % interval of the drift ({DRIFT:g} ug/year) holds the truth,")
    print("and of units without a jump in which one is named")
    print(f"{HEADING}  tails   history  line alone  stated only  false alarms")
    for kind, share in lines(KINDS[:26:10] if asked.smoke else KINDS, units):
        tails = "heavy" if kind.heavy else "normal"
        print(
            f"{kind}  {tails:6}  {share[0]:7.1f}  {share[1]:10.1f}  {share[2]:11.1f}"
            f"  {share[3]:12.1f}",
            flush=True,
        )
    print("Percent of units whose jump in the middle is named; scatter 10 ug")
    print("calibrations  jump/ug  named  at its place  its size held  drift holds the truth")
    for kind, share in lines(JUMPS[1:2] if asked.smoke else JUMPS, units):
        print(
            f"{kind.count:12d}  {kind.jump:7g}  {share[3]:5.1f}  {share[4]:12.1f}"
            f"  {100.0 * share[5] / max(share[4], 1e-9):13.1f}  {share[0]:21.1f}"
        )


if __name__ == "__main__":
    main()
