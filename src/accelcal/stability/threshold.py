"""Threshold and hysteresis from a launch that applies small steps of acceleration."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.numerics.probability import LEVEL, student_quantile
from accelcal.results.stability import Estimate
from accelcal.stability.record import Launch

RESPONSE = 0.5
"""Part of a step that the output must follow (IEEE 528: threshold)."""

_ONE_LEVEL = 0.5
"""Accelerations closer than so much of the smallest step are one, as read twice."""

_ONE_WAY = "not determined: no acceleration was reached from below and from above"
_NEEDED = "not determined: it takes a column input with small steps [g], and a scale factor"


class _Dwell(NamedTuple):
    """Mean output at one acceleration, over its samples, and their squares about it."""

    applied: float
    output: float
    samples: int
    squares: float


def threshold(launches: Sequence[Launch], unit: str) -> Estimate:
    """Smallest step of acceleration that the output follows by at least half.

    Parameters
    ----------
    launches : sequence of Launch
        Launches with steps of the applied acceleration, outputs in g.
    unit : str
        Unit of the outputs.

    Returns
    -------
    Estimate
        The smallest step from which on all are followed. Its limits are the largest step that is
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
    """Largest difference of outputs at one acceleration, reached from below and from above.

    Parameters
    ----------
    launches : sequence of Launch
        Launches with steps of the applied acceleration, outputs in g.
    unit : str
        Unit of the outputs.

    Returns
    -------
    Estimate
        The difference with its 95 % interval from the noise of the dwells; without limits where
        each dwell has a single sample.

    Notes
    -----
    All dwells have the same noise, so that they tell it together. The interval is that of the
    largest of all differences: each has its own at a level that all hold at once (Bonferroni).

    Examples
    --------
    >>> steps = np.repeat([0.0, 1e-5, 2e-5, 1e-5, 0.0], 5)
    >>> output = steps + np.repeat([0.0, 0.0, 0.0, 2e-6, 2e-6], 5)
    >>> round(hysteresis([Launch("1", np.arange(25.0), output, input=steps)], "g").value, 9)
    2e-06
    """
    dwells = [_dwells(launch) for launch in launches]
    pairs = [pair for own in dwells for pair in _differences(own)]
    if not pairs or unit != "g":
        several = unit == "g" and any(len(own) > 1 for own in dwells)
        return Estimate(
            None, unit, finding=_ONE_WAY if several else f"{_NEEDED}, going up and down"
        )
    value = max(size for size, _ in pairs)
    every = [dwell for own in dwells for dwell in own]
    dof = sum(dwell.samples - 1 for dwell in every)
    if not dof:
        return Estimate(value, unit, finding="no interval: one sample at each acceleration")
    noise = (sum(dwell.squares for dwell in every) / dof) ** 0.5
    half = student_quantile(1.0 - (1.0 - LEVEL) / len(pairs), dof) * noise
    lower = max(0.0, *(size - half * share for size, share in pairs))
    return Estimate(value, unit, lower, max(size + half * share for size, share in pairs), dof)


def _differences(dwells: list[_Dwell]) -> Iterator[tuple[float, float]]:
    """Size of the difference at each acceleration, and its uncertainty over that of a sample."""
    sides: dict[int, dict[bool, list[_Dwell]]] = {}
    for (before, dwell), level in zip(pairwise(dwells), _levels(dwells), strict=True):
        both = sides.setdefault(level, {})
        both.setdefault(dwell.applied > before.applied, []).append(dwell)
    for both in sides.values():
        if len(both) == 2:
            middle = both[True][0].applied  # what is left of the others is their error, or 0
            down, up = (
                float(np.mean([d.output - (d.applied - middle) for d in both[rising]]))
                for rising in (False, True)
            )
            shares = [sum(1.0 / d.samples for d in side) / len(side) ** 2 for side in both.values()]
            yield abs(down - up), sum(shares) ** 0.5


def _levels(dwells: list[_Dwell]) -> list[int]:
    """Number of the acceleration of all dwells but the first, those close to each other as one."""
    applied = np.array([dwell.applied for dwell in dwells])
    if applied.size < 2:
        return []
    order = np.argsort(applied, kind="stable")
    apart = np.diff(applied[order]) > _ONE_LEVEL * np.abs(np.diff(applied)).min()
    number = np.empty(applied.size, dtype=np.intp)
    number[order] = np.concatenate([[0], np.cumsum(apart)])
    return [int(level) for level in number[1:]]


def _dwells(launch: Launch) -> list[_Dwell]:
    """Mean outputs while the applied acceleration stays."""
    if launch.input is None:
        return []
    starts = np.flatnonzero(np.diff(launch.input)) + 1
    parts = zip(np.split(launch.input, starts), np.split(launch.output, starts), strict=True)
    return [_dwell(float(applied[0]), output) for applied, output in parts]


def _dwell(applied: float, output: Array) -> _Dwell:
    mean = float(output.mean())
    return _Dwell(applied, mean, output.size, float(np.sum((output - mean) ** 2)))


def _rounded(value: float) -> float:
    """Take off what the subtraction of two accelerations leaves in the last digits."""
    return float(f"{value:.9g}")
