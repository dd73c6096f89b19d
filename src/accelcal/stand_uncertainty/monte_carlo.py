"""Propagation of distributions, JCGM 101, and the validation of the linear budget by it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from accelcal.arrays import Array
from accelcal.errors import InputError
from accelcal.results.stand_budget import MonteCarlo, StandBudget
from accelcal.stand_uncertainty.estimator import Estimator
from accelcal.stand_uncertainty.readings import StandReadings
from accelcal.stand_uncertainty.stand import Acting

FEWEST = 1000
MOST = 1_000_000
"""Trials: the fewest that tell a 95 % interval, and the most that are made."""

_BATCH = 10_000
"""Trials in a batch, JCGM 101, 7.9.4 for 95 %."""
_AT_ONCE = 200_000
"""Readings simulated together, so that they fit into the memory next to the processor."""
_STORED = 50_000_000
"""Estimates that are kept, of all trials together."""
_FINER = 5.0
"""The Monte Carlo result is had this many times finer than it is compared, JCGM 101, 8.2."""
_ENDS = (0.025, 0.975)


def monte_carlo(
    parts: Sequence[Acting],
    readings: StandReadings,
    estimator: Estimator,
    linear: StandBudget,
    *,
    trials: int | None,
    seed: int | None,
) -> MonteCarlo:
    """Propagate the distributions of all components, reading by reading.

    Without a number of trials there are as many as make the result stable, `MOST` at most; without
    a seed one is made up. The result comes with its numerical tolerance and the verdict on the
    linear budget.

    Raises
    ------
    InputError
        If there are too few or too many trials.

    Notes
    -----
    JCGM 101, 7.9: batches of 1e4 trials are added until twice the standard deviation of the mean
    over the batches, of estimate, standard uncertainty and both ends, is below the numerical
    tolerance. That is a fifth of the one with which clause 8 compares.
    """
    most = min(MOST, _STORED // len(estimator.named))
    if trials is not None and not FEWEST <= trials <= most:
        raise InputError(f"{trials} trials; there are from {FEWEST} to {most} in this test")
    seed = int(np.random.default_rng().integers(2**32) if seed is None else seed)
    random = np.random.default_rng(seed)
    batches: list[Array] = []
    summaries: list[Array] = []
    stable = False
    for size in _batch_sizes(trials, most):
        batches.append(_batch(parts, readings, estimator, random, size))
        summaries.append(_summary(batches[-1]))
        stable = _are_stable(summaries)
        if stable and trials is None:
            break
    values = np.concatenate(batches)
    mean, standard, low, high = _summary(values)
    tolerance = numerical_tolerance(standard)
    ends = linear.nominal + np.outer([-1.0, 1.0], linear.expanded_uncertainty)
    off = np.abs(ends - [low, high]).max(axis=0)
    return MonteCarlo(
        trials=len(values),
        seed=seed,
        stable=stable,
        value=mean,
        standard_uncertainty=standard,
        lower=low,
        upper=high,
        numerical=_scatter(summaries)[2:].max(axis=0),
        tolerance=tolerance,
        agrees=off <= tolerance + estimator.dust(readings.scale_factor),
    )


def numerical_tolerance(standard: Array) -> Array:
    """Numerical tolerance of standard uncertainties to one significant digit, JCGM 101, 7.9.2.

    It is half a unit of the first significant digit; 0 for 0.

    Examples
    --------
    >>> import numpy as np
    >>> numerical_tolerance(np.array([0.07, 2.4])).tolist()
    [0.005, 0.5]
    """
    found = np.zeros_like(standard)
    known = standard > 0.0
    found[known] = 0.5 * 10.0 ** np.floor(np.log10(standard[known]))
    return found


def _batch_sizes(trials: int | None, most: int) -> list[int]:
    if trials is None:
        return [_BATCH] * max(most // _BATCH, 2)
    size = min(_BATCH, trials // 10)  # ten batches or more tell the numerical uncertainty
    whole, rest = divmod(trials, size)
    return [size] * (whole - 1) + [size + rest]


def _batch(
    parts: Sequence[Acting],
    readings: StandReadings,
    estimator: Estimator,
    random: np.random.Generator,
    size: int,
) -> Array:
    """Estimates of one batch of trials, shape (size, q)."""
    step = max(1, _AT_ONCE // len(readings.record))
    found = []
    for start in range(0, size, step):
        trials = min(step, size - start)
        errors = _errors(parts, random, trials)
        gravity = 1.0 + errors.get("gravity", np.zeros((trials, 1)))[:, :1]
        coefficients = readings.output(errors) @ estimator.map.T
        shape = (trials, estimator.map.shape[0])
        known = np.hstack([np.broadcast_to(coefficients, shape), gravity])
        found.append(estimator.estimates(known))
    return np.concatenate(found)


def _errors(parts: Sequence[Acting], random: np.random.Generator, trials: int) -> dict[str, Array]:
    """Errors of each channel in each trial, shape (trials, n)."""
    found: dict[str, Array] = {}
    for part in parts:
        shape = (trials, part.errors, part.pattern.shape[1])
        draws = part.component.distribution.draws(random, shape)
        errors = np.einsum("tnk,nk->tn", draws[:, part.error], part.pattern)
        found[part.channel] = found.get(part.channel, 0.0) + errors
    return found


def _summary(batch: Array) -> Array:
    """Mean, standard deviation and both ends of the 95 % interval, shape (4, q)."""
    low, high = np.quantile(batch, _ENDS, axis=0)
    return np.stack([batch.mean(axis=0), batch.std(axis=0, ddof=1), low, high])


def _scatter(summaries: Sequence[Array]) -> Array:
    """Twice the standard deviation of the mean of the batches, shape (4, q)."""
    if len(summaries) == 1:
        return np.full_like(summaries[0], np.inf)
    return np.asarray(2.0 * np.std(summaries, axis=0, ddof=1) / np.sqrt(len(summaries)))


def _are_stable(summaries: Sequence[Array]) -> bool:
    tolerance = numerical_tolerance(np.mean(summaries, axis=0)[1])
    return bool((_scatter(summaries) <= tolerance / _FINER).all())
