"""Whether an effect has one value in all units of a stand."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.instance import Instance, column_of
from accelcal.discovery.spans import scaled
from accelcal.discovery.stand.mean_unit import Unit, amplitudes
from accelcal.numerics.probability import f_survival

Verdict = Literal["stand", "unit", "undecided"]

FEWEST = 3
"""Units that it takes to call an effect the stand's, and to tell a unit from the others."""

_ALIKE = 0.02
"""Spread from unit to unit, over the size, that still counts as one value."""

_DIFFERENT = 1.0
"""Spread over the size that is to be ruled out: that of an effect which half of the units have."""

_LEVEL = 0.05


class OneValue(NamedTuple):
    """The sizes of an effect in U units, and whether they are one."""

    sizes: Array  # along the common mixture of its amplitudes, (U,)
    uncertainties: Array  # of the sizes, without what is common to all units, (U,)
    p_value: float  # chance that sizes that are one differ as much
    spread: float  # upper 95 % limit of the standard deviation from unit to unit, over the size
    verdict: Verdict  # whose the effect is


def one_value(
    units: Sequence[Unit], instance: Instance, beside: Sequence[Instance], alpha: float
) -> OneValue:
    """Fit an effect in each unit beside others, and test whether one size does for all.

    Whether the common size is more than noise is not judged here.

    Notes
    -----
    Head errors shift the sizes of all units alike, and do not enter the test.
    """
    fits = [_fit(unit, instance, beside) for unit in units]
    weights = [np.linalg.pinv(covariance, hermitian=True) for _, covariance in fits]
    total = np.linalg.pinv(sum(weights, np.zeros_like(weights[0])), hermitian=True)
    common = total @ sum(w @ size for w, (size, _) in zip(weights, fits, strict=True))
    squares = sum(
        float((size - common) @ w @ (size - common))
        for w, (size, _) in zip(weights, fits, strict=True)
    )
    degrees = (len(units) - 1) * common.size
    noise = sum(unit.comparison.space.dof for unit in units)
    p_value = f_survival(squares / degrees, degrees, noise)
    way = np.ones(1) if common.size == 1 else common / max(float(np.linalg.norm(common)), 1e-300)
    sizes = np.array([way @ size for size, _ in fits])
    uncertainties = np.array([np.sqrt(way @ covariance @ way) for _, covariance in fits])
    spread, limit = _spread(sizes, uncertainties)
    verdict: Verdict = "undecided"
    if p_value < alpha and spread > _ALIKE:
        verdict = "unit"
    elif len(units) >= FEWEST and limit < _DIFFERENT:
        verdict = "stand"
    return OneValue(sizes, uncertainties, p_value, limit, verdict)


def _fit(unit: Unit, instance: Instance, beside: Sequence[Instance]) -> tuple[Array, Array]:
    """Amplitudes of an effect in a unit, beside others, with their covariance."""
    c, space = unit.comparison.model.conditions, unit.comparison.space
    others = [item for item in (*beside, *unit.own) if item.effect.id != instance.effect.id]
    own = amplitudes([instance])
    columns = [space.see(column_of(item, c)) for item in (*own, *amplitudes(others))]
    units, norms = scaled(np.stack(columns, axis=1))
    inverse = np.linalg.pinv(units) / norms[:, None]
    kept = inverse[: len(own)]
    return kept @ unit.comparison.seen, kept @ kept.T


def _spread(sizes: Array, uncertainties: Array) -> tuple[float, float]:
    """Spread from unit to unit beyond the noise and its upper limit, both over the size."""
    from scipy.special import chdtri  # type: ignore[import-untyped]

    weights = uncertainties**-2.0
    common = float(weights @ sizes / weights.sum())
    squares = float(weights @ (sizes - common) ** 2)
    variance = 1.0 / float(weights.mean())
    degrees = sizes.size - 1
    largest = variance * max(squares / float(chdtri(degrees, 1.0 - _LEVEL)) - 1.0, 0.0)
    likely = variance * max(squares / degrees - 1.0, 0.0)
    size = max(abs(common), 1e-300)
    return float(np.sqrt(likely)) / size, float(np.sqrt(largest)) / size
