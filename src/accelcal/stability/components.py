"""Components of (3) with their intervals, the bound itself, threshold and hysteresis."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise, permutations
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arrays import Array, Ints
from accelcal.model import bias_bound
from accelcal.numerics.probability import LEVEL, student_quantile
from accelcal.results.stability import BiasBound, Estimate
from accelcal.stability.record import Launch

FEWEST_LAUNCHES = 5
"""Launches from which on a correlation between neighbours can be significant."""

_SHUFFLES = 5000


def deviation(sum_of_squares: float, dof: float, unit: str, effective_dof: float) -> Estimate:
    """Standard deviation from a sum of squares [unit^2], with its chi-squared interval.

    `dof` is the number of the residuals less that of the fitted parameters; the degrees of freedom
    of the interval are fewer where these are correlated.

    Examples
    --------
    >>> estimate = deviation(9.0, 9, "g", 9)
    >>> estimate.value, round(estimate.lower, 3), round(estimate.upper, 3)
    (1.0, 0.688, 1.826)
    """
    from scipy.special import chdtri  # type: ignore[import-untyped]

    value = (sum_of_squares / dof) ** 0.5
    tail = 0.5 * (1.0 - LEVEL)
    lower, upper = (
        value * float(effective_dof / chdtri(effective_dof, p)) ** 0.5 for p in (tail, 1.0 - tail)
    )
    return Estimate(value, unit, lower, upper, effective_dof)


class LagCorrelation(NamedTuple):
    """Correlation of neighbours in a sequence."""

    value: float  # lag-1 correlation
    p_value: float  # probability of one as far from that of a shuffled sequence


def lag1_correlation(means: ArrayLike) -> LagCorrelation | None:
    """Correlation of each launch mean, in the order of the launches, with the next one.

    None for fewer than 5 launches, or means that are all equal.

    Notes
    -----
    The p-value is that of a permutation test: all orders of up to 7 launches, 5000 random ones of
    more. It holds for any distribution of the means.

    Examples
    --------
    >>> lag1_correlation([1, 2, 3, 4, 5, 6, 7, 8]).p_value < 0.01
    True
    """
    values = np.asarray(means, dtype=np.float64)
    if values.size < FEWEST_LAUNCHES or np.ptp(values) == 0.0:
        return None
    centred = values - values.mean()
    orders = np.array(list(_orders(centred)))
    found = _lag1(centred[None, :])[0]
    shuffled = _lag1(orders)
    middle = -1.0 / centred.size
    beyond = np.abs(shuffled - middle) >= abs(found - middle) - 1e-12
    return LagCorrelation(float(found), float(beyond.mean()))


def _orders(values: Array) -> Iterator[Sequence[float] | Array]:
    if values.size <= 7:
        yield from permutations(values.tolist())
        return
    random = np.random.default_rng(20091210)
    yield values
    for _ in range(_SHUFFLES - 1):
        yield random.permutation(values)


def _lag1(sequences: Array) -> Array:
    products: Array = np.sum(sequences[:, 1:] * sequences[:, :-1], axis=1)
    correlation: Array = products / np.sum(sequences**2, axis=1)
    return correlation


FACTOR = 3.0
"""t_P of the paper, where no probability is asked for."""


def coverage_factor(probability: float | None, dof: float | None) -> float:
    """Factor t_P of (3), for a two-sided probability; None takes the fixed factor 3.

    The degrees of freedom are those of the standard deviation; None for very many.

    Examples
    --------
    >>> coverage_factor(None, 5), round(coverage_factor(0.9973, 5), 2)
    (3.0, 5.51)
    """
    if probability is None:
        return FACTOR
    return student_quantile(probability, float("inf") if dof is None else dof)


def random_bias(time: float, launch: Estimate, drift: Estimate, fluctuation: Estimate) -> BiasBound:
    """Bound (3) at one time after the start of a launch: k0D(t) and k0(t).

    Notes
    -----
    A component without value counts as zero in the value of (3), and by what the data allow it to
    be in the upper limit. The limits of the sum of squares are combined by the method of variance
    estimates recovery: the distances of the limits from the values, squared, add.

    Examples
    --------
    >>> known = Estimate(2e-5, "g", 1e-5, 4e-5)
    >>> bound = random_bias(0.0, known, Estimate(0.0, "g/s", 0.0, 0.0), known).bound
    >>> round(bound.value, 7), round(bound.lower, 7), round(bound.upper, 7)
    (1.41e-05, 9.7e-06, 2.5e-05)
    """
    unit = launch.unit
    drifted = _size(drift).times(time, unit) if time else Estimate(0.0, unit, 0.0, 0.0)
    parts = (launch, drifted, fluctuation)
    sizes = [estimate.value or 0.0 for estimate in (launch, drift, fluctuation)]
    value = float(bias_bound(time, sizes[0], abs(sizes[1]), sizes[2]))
    squares = [((e.value or 0.0) ** 2, _square(e.lower), _square(e.upper)) for e in parts]
    total = 4.0 * value**2
    low = sum((s - (s if lo is None else min(lo, s))) ** 2 for s, lo, _ in squares) ** 0.5
    high = sum(((s if up is None else up) - s) ** 2 for s, _, up in squares) ** 0.5
    missing = [n for n, e in zip(("k0L", "k0D", "k0F"), parts, strict=True) if e.value is None]
    open_ended = any(e.upper is None for e in parts)
    return BiasBound(
        time,
        drifted,
        Estimate(
            value if len(missing) < 3 else None,
            unit,
            0.5 * max(total - low, 0.0) ** 0.5,
            None if open_ended else 0.5 * (total + high) ** 0.5,
            finding=f"without {', '.join(missing)}" if missing else "",
        ),
    )


def _size(drift: Estimate) -> Estimate:
    """Absolute value of a slope with its limits."""
    if drift.lower is None or drift.upper is None:
        return drift
    ends = sorted((abs(drift.lower), abs(drift.upper)))
    low = 0.0 if drift.lower <= 0.0 <= drift.upper else ends[0]
    value = None if drift.value is None else abs(drift.value)
    return Estimate(value, drift.unit, low, ends[1], drift.dof, drift.finding)


def _square(limit: float | None) -> float | None:
    return None if limit is None else limit**2


RESPONSE = 0.5
"""Part of a step that the output must follow (IEEE 528: threshold)."""

_ONE_LEVEL = 0.5
"""Accelerations closer than so much of the smallest step are one, as read twice."""

_ONE_WAY = "not determined: no acceleration was reached from below and from above"
_NEEDED = "not determined: it takes a column input with small steps [g], and a scale factor"


_ONCE = (
    "a drift of the bias counts as hysteresis: no acceleration was reached twice from one side;"
    " go up and down twice"
)


class _Dwell(NamedTuple):
    """Mean output and time at one acceleration, over its samples, and their squares about it."""

    applied: float
    output: float
    time: float
    samples: int
    squares: float


def threshold(launches: Sequence[Launch], unit: str) -> Estimate:
    """Smallest step of acceleration that the output, in g, follows by at least half.

    It is the smallest step from which on all are followed. Its limits are the largest step that is
    not followed, 0 where there is none, and this step.

    Examples
    --------
    >>> steps = np.repeat([0.0, 1e-6, 4e-6, 4e-6 + 1e-5], 5)
    >>> launch = Launch("1", np.arange(20.0), np.where(steps > 1e-5, steps, 0.0), input=steps)
    >>> threshold([launch], "g").value
    1e-05
    """
    steps = [
        (abs(b.applied - a.applied), (b.output - a.output) / (b.applied - a.applied))
        for launch in launches
        for a, b in pairwise(_dwells(launch))
    ]
    if not steps or unit != "g":
        return Estimate(None, unit, finding=_NEEDED)
    lost = max((size for size, response in steps if response < RESPONSE), default=0.0)
    followed = [size for size, _ in steps if size > lost * (1.0 + 1e-9)]
    if not followed:
        finding = "the largest steps are not followed each time: the threshold is above them"
        return Estimate(None, unit, lower=_rounded(lost), finding=finding)
    value = _rounded(min(followed))
    finding = "" if lost else "every step was followed: an upper limit"
    return Estimate(value, unit, _rounded(lost), value, finding=finding)


def hysteresis(launches: Sequence[Launch], unit: str) -> Estimate:
    """Largest difference of outputs [g] at one acceleration, reached from below and from above.

    Its 95 % interval is from the noise; it has no limits where nothing tells that, as each dwell
    has a single sample.

    Notes
    -----
    A linear drift of each launch is taken out, which what was reached twice from one side tells.
    The noise is that of the samples at one acceleration, or the scatter of what was reached twice
    about the drift, which slow noise makes larger. The interval is that of the largest of all
    differences: each has its own at a level that all hold at once (Bonferroni).

    Examples
    --------
    >>> steps = np.repeat([0.0, 1e-5, 2e-5, 1e-5, 0.0], 5)
    >>> output = steps + np.repeat([0.0, 0.0, 0.0, 2e-6, 2e-6], 5)
    >>> round(hysteresis([Launch("1", np.arange(25.0), output, input=steps)], "g").value, 9)
    2e-06
    """
    dwells = [_dwells(launch) for launch in launches]
    sweeps = [sweep for own in dwells if (sweep := _Sweep.of(own)).sizes.size]
    if not sweeps or unit != "g":
        several = unit == "g" and any(len(own) > 1 for own in dwells)
        return Estimate(
            None, unit, finding=_ONE_WAY if several else f"{_NEEDED}, going up and down"
        )
    sizes, shares = (np.concatenate(each) for each in zip(*(s[:2] for s in sweeps), strict=True))
    said = "" if all(sweep.tells_drift for sweep in sweeps) else _ONCE
    noise, dof = _noise(dwells, sweeps)
    if not dof:
        finding = "; ".join(filter(None, ["no interval: one sample at each acceleration", said]))
        return Estimate(float(sizes.max()), unit, finding=finding)
    half = student_quantile(1.0 - (1.0 - LEVEL) / sizes.size, dof) * noise * shares
    lower, upper = max(0.0, float((sizes - half).max())), float((sizes + half).max())
    return Estimate(float(sizes.max()), unit, lower, upper, dof, said)


def _noise(dwells: list[list[_Dwell]], sweeps: list[_Sweep]) -> tuple[float, int]:
    """Noise of a sample and its degrees of freedom: the larger of what samples and dwells tell."""
    every = [dwell for own in dwells for dwell in own]
    told = (
        (sum(dwell.squares for dwell in every), sum(dwell.samples - 1 for dwell in every)),
        (sum(sweep.squares for sweep in sweeps), sum(sweep.dof for sweep in sweeps)),
    )
    return max((((squares / dof) ** 0.5, dof) for squares, dof in told if dof), default=(0.0, 0))


class _Sweep(NamedTuple):
    """Differences at the accelerations of a launch that were reached from both sides.

    A drift was taken out where an acceleration that was reached twice from one side `tells_drift`.
    """

    sizes: Array  # of each [g]
    shares: Array  # their standard uncertainty over the noise of a sample
    tells_drift: bool
    squares: float  # of what is left of the means of the dwells, in units of a sample [g^2]
    dof: int  # their degrees of freedom

    @classmethod
    def of(cls, dwells: list[_Dwell]) -> _Sweep:
        """Analysis of covariance: a mean for each acceleration and side, and one drift."""
        applied, output, time, samples = (
            np.array([dwell[i] for dwell in dwells], dtype=np.float64) for i in range(4)
        )
        side = 2 * _levels(applied) + (np.diff(applied) > 0.0)
        sides, of, visits = np.unique(side, return_inverse=True, return_counts=True)
        output, time, samples = (output - applied)[1:], time[1:], samples[1:]
        total = np.bincount(of, samples)
        mean, at = (np.bincount(of, samples * each) / total for each in (output, time))
        tells_drift = bool((visits > 1).any())
        since, away = time - at[of], output - mean[of]
        spread = float(samples @ since**2) if tells_drift else np.inf
        drift = float(samples * since @ away) / spread
        up = np.flatnonzero(np.diff(sides // 2) == 0) + 1  # behind the same one reached from above
        later = at[up] - at[up - 1]
        sizes = np.abs(mean[up] - mean[up - 1] - drift * later)
        shares = np.sqrt(1.0 / total[up] + 1.0 / total[up - 1] + later**2 / spread)
        squares = float(samples @ (away - drift * since) ** 2)
        return cls(sizes, shares, tells_drift, squares, of.size - sides.size - tells_drift)


def _levels(applied: Array) -> Ints:
    """Number of the acceleration of all dwells but the first, those close to each other as one."""
    if applied.size < 2:
        return np.zeros(0, dtype=np.intp)
    order = np.argsort(applied, kind="stable")
    apart = np.diff(applied[order]) > _ONE_LEVEL * np.abs(np.diff(applied)).min()
    number = np.empty(applied.size, dtype=np.intp)
    number[order] = np.concatenate([[0], np.cumsum(apart)])
    return number[1:]


def _dwells(launch: Launch) -> list[_Dwell]:
    """Mean outputs while the applied acceleration stays."""
    if launch.input is None:
        return []
    starts = np.flatnonzero(np.diff(launch.input)) + 1
    columns = (np.split(each, starts) for each in (launch.input, launch.output, launch.time))
    return [_dwell(float(x[0]), y, float(t.mean())) for x, y, t in zip(*columns, strict=True)]


def _dwell(applied: float, output: Array, time: float) -> _Dwell:
    mean = float(output.mean())
    return _Dwell(applied, mean, time, output.size, float(np.sum((output - mean) ** 2)))


def _rounded(value: float) -> float:
    """Take off what the subtraction of two accelerations leaves in the last digits."""
    return float(f"{value:.9g}")
