"""How likely noise as heavy-tailed as that of the other readings makes one so far off."""

from __future__ import annotations

import math

import numpy as np

from accelcal.arrays import Array
from accelcal.numerics.probability import student_survival

_TAILS = (4.0, 5.0, 6.0, 8.0, 11.0, 16.0, 30.0, math.inf)
"""Degrees of freedom of Student's distributions that the noise may have."""

_NORMAL = 5.0
"""Weight of normal noise beforehand, over that of each heavier tail."""

_STEPS = 25


def chance_of(size: float, rest: Array, dof: float, least: float) -> float:
    """Two-sided chance of one deviation, from the size and the tails of the others.

    It is the mean of the chances under Student's distributions of several tails, each with the
    weight that the likelihood of the others gives it. These have the variance of the one, shape
    (n,), and amount to `dof` degrees of freedom; the noise has no smaller scale than `least` [g].
    """
    scales, logs = zip(*(_fit(rest, nu, least) for nu in _TAILS), strict=True)
    weights = np.exp((np.array(logs) - max(logs)) * min(dof / rest.size, 1.0))
    weights[-1] *= _NORMAL
    chances = [
        2.0 * student_survival(abs(size) / scale, min(nu, max(dof, 1.0)))
        for nu, scale in zip(_TAILS, scales, strict=True)
    ]
    return float(weights @ np.array(chances) / weights.sum())


def _fit(rest: Array, nu: float, least: float) -> tuple[float, float]:
    """Scale of a Student distribution, and its log likelihood."""
    square = max(float(rest @ rest) / rest.size, least**2)
    if math.isinf(nu):
        loss = rest.size * math.log(square) + float(rest @ rest) / square
        return math.sqrt(square), -0.5 * (loss + rest.size * math.log(2.0 * math.pi))
    for _ in range(_STEPS):
        weight = (nu + 1.0) / (nu + rest**2 / square)
        square = max(float(weight @ rest**2) / rest.size, least**2)
    front = math.lgamma((nu + 1.0) / 2.0) - math.lgamma(nu / 2.0) - 0.5 * math.log(nu * math.pi)
    tail = 0.5 * (nu + 1.0) * float(np.log1p(rest**2 / (nu * square)).sum())
    return math.sqrt(square), rest.size * (front - 0.5 * math.log(square)) - tail
