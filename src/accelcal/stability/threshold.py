"""Threshold and hysteresis from a launch that applies small steps of acceleration."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Ints
from accelcal.numerics.probability import LEVEL, student_quantile
from accelcal.results.stability import Estimate
from accelcal.stability.record import Launch

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
