"""Standard deviations with their intervals, the bound (3), and whether launches are independent."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import permutations
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arrays import Array
from accelcal.model import bias_bound
from accelcal.numerics.probability import LEVEL, student_quantile
from accelcal.results.stability import BiasBound, Estimate

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
