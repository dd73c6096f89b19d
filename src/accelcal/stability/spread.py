"""Standard deviations with their intervals, and whether launches are independent."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import permutations
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arrays import Array
from accelcal.numerics.probability import LEVEL
from accelcal.results.stability import Estimate

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
