"""The trend line in a launch, with an interval that correlated residuals do not spoil.

What is left about a trend line is not white: flicker noise and random walk look like a trend
themselves, and the textbook interval of a slope then misses it most of the time. Here the noise is
white noise with any share of flicker noise or random walk. Each such mixture gives a slope by
generalised least squares, with Student's distribution, and a restricted likelihood. The interval
is that of all mixtures together, each weighted by its likelihood.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.errors import InputError
from accelcal.numerics.probability import LEVEL
from accelcal.stability.record import Launch

__all__ = ["Trend", "fit_trend"]

BLOCKS = 60
"""Means of equal spans that the noise is told from; more of them hardly add anything."""

SHARES = (0.02, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 0.9, 0.95, 0.98, 1.0)
"""Shares of flicker noise or random walk in the scatter about the line that are weighed."""

_SHORTEST = 0.4
"""Shortest time constant of flicker noise, over the length of a block: shorter are white."""

_WHITE_PRIOR = 2.0 * len(SHARES)
_FLICKER_PRIOR = 1.0
_RANDOM_WALK_PRIOR = 3.0  # chosen by coverage, see the page on stability


class Trend(NamedTuple):
    """The trend line of a launch.

    Attributes
    ----------
    slope : float
        Slope [unit/s].
    lower, upper : float
        Limits of the interval of the slope at `LEVEL` [unit/s].
    start : float
        The line at the first sample [unit].
    sum_of_squares : float
        Of the residuals about the least-squares line [unit^2].
    dof : int
        Number of samples less 2.
    effective_dof : float
        Degrees of freedom of the variance, which correlated residuals make smaller.
    """

    slope: float
    lower: float
    upper: float
    start: float
    sum_of_squares: float
    dof: int
    effective_dof: float


class _Blocks(NamedTuple):
    """Means over equal spans of time, and within each the mean distance of two samples [s]."""

    time: Array
    mean: Array
    samples: Array
    apart: Array
    duration: float


class _Mixture(NamedTuple):
    """What one mixture of noises makes of the block means."""

    slope: float
    standard_error: float
    log_likelihood: float
    effective_dof: float
    prior: float


def fit_trend(launch: Launch) -> Trend:
    """Fit the trend line of a launch.

    Parameters
    ----------
    launch : Launch
        The launch; its times need not be regular.

    Returns
    -------
    Trend
        The line.

    Raises
    ------
    InputError
        If the launch has fewer than 5 samples.

    Notes
    -----
    The restricted likelihood of a mixture with covariance V over n block means y, X = [1 t] is::

        |V|^-1/2 |X' V^-1 X|^-1/2 q^-(n-2)/2

    where q is the weighted residual sum of squares. V is (1 - s) W + s C, W white noise and C
    flicker noise or random walk, each scaled to leave the same variance about a line.

    Examples
    --------
    >>> time = np.arange(600.0)
    >>> noise = np.random.default_rng(1).normal(size=600)
    >>> trend = fit_trend(Launch("1", time, 0.01 * time + noise))
    >>> trend.lower < 0.01 < trend.upper
    True
    """
    if launch.output.size < 5:
        raise InputError(
            f"launch {launch.label}: {launch.output.size} samples; a trend needs at least 5"
        )
    blocks, within = _in_blocks(launch)
    mixtures = list(_mixtures(blocks))
    weights = _weights(mixtures)
    slopes = np.array([mixture.slope for mixture in mixtures])
    errors = np.array([mixture.standard_error for mixture in mixtures])
    slope = float(weights @ slopes)
    lower, upper = _limits(weights, slopes, errors, blocks.time.size - 2)
    between, inverse = _between(blocks), float(weights @ [1.0 / m.effective_dof for m in mixtures])
    dof = launch.output.size - 2
    total = between + within
    spare = max(launch.output.size - blocks.time.size, 1)
    effective = total**2 / (between**2 * inverse + within**2 / spare) if total > 0.0 else 1.0
    start = float(launch.output.mean() - slope * (launch.time.mean() - launch.time[0]))
    return Trend(slope, lower, upper, start, total, dof, min(effective, dof))


def _in_blocks(launch: Launch) -> tuple[_Blocks, float]:
    """Means over equal spans, and the sum of squares within the spans about the line."""
    share = (launch.time - launch.time[0]) / launch.duration
    span = np.minimum((share * min(BLOCKS, share.size)).astype(np.int64), BLOCKS - 1)
    number = np.unique(span, return_inverse=True)[1]
    count = np.bincount(number).astype(np.float64)
    time = np.bincount(number, weights=launch.time) / count
    mean = np.bincount(number, weights=launch.output) / count
    line = np.polynomial.Polynomial.fit(launch.time, launch.output, 1)
    left = launch.output - line(launch.time)
    inside = left - (np.bincount(number, weights=left) / count)[number]
    rank = np.arange(share.size) - (np.cumsum(count) - count)[number]
    ordered = 2.0 * (2.0 * rank - count[number] + 1.0) / count[number] ** 2
    offsets = launch.time - time[number]
    apart = np.bincount(number, weights=ordered * offsets).astype(np.float64)
    return _Blocks(time, mean, count, apart, launch.duration), float(inside @ inside)


def _between(blocks: _Blocks) -> float:
    """Weighted sum of squares of the block means about their line."""
    weight = np.sqrt(blocks.samples)
    line = np.polynomial.Polynomial.fit(blocks.time, blocks.mean, 1, w=weight)
    return float(np.sum(blocks.samples * (blocks.mean - line(blocks.time)) ** 2))


def _mixtures(blocks: _Blocks) -> Iterator[_Mixture]:
    time = (blocks.time - blocks.time.mean()) / np.ptp(blocks.time)
    scale = float(np.ptp(blocks.mean)) or 1.0
    design = np.stack([np.ones_like(time), time], axis=1)
    basis = np.linalg.qr(design)[0]
    apart = np.eye(time.size) - basis @ basis.T
    white, flicker, walk = (
        noise * ((time.size - 2) / np.trace(apart @ noise)) for noise in _noises(blocks)
    )
    covariances = [(white, _WHITE_PRIOR)]
    for noise, prior in ((flicker, _FLICKER_PRIOR), (walk, _RANDOM_WALK_PRIOR)):
        covariances += [((1.0 - share) * white + share * noise, prior) for share in SHARES]
    for covariance, prior in covariances:
        mixture = _weighted_line(design, blocks.mean / scale, covariance, apart, prior)
        per_time = scale / float(np.ptp(blocks.time))
        yield mixture._replace(
            slope=mixture.slope * per_time, standard_error=mixture.standard_error * per_time
        )


def _noises(blocks: _Blocks) -> tuple[Array, Array, Array]:
    """Covariances of the block means: white noise, flicker noise, random walk.

    Flicker noise is a sum of relaxations with time constants in equal steps of their logarithm.
    That of the random walk lacks a constant, which the line takes up.
    """
    distance = np.abs(blocks.time[:, None] - blocks.time) / blocks.duration
    constants = np.geomspace(_SHORTEST / blocks.time.size, 10.0, 16)
    flicker = sum(np.exp(-distance / constant) for constant in constants)
    walk = 1.0 - distance
    np.fill_diagonal(walk, 1.0 - blocks.apart / blocks.duration)
    return np.diag(blocks.samples.mean() / blocks.samples), np.asarray(flicker), walk


def _weighted_line(
    design: Array, mean: Array, covariance: Array, apart: Array, prior: float
) -> _Mixture:
    root = np.linalg.cholesky(covariance)
    whitened = np.linalg.solve(root, np.column_stack([design, mean]))
    normal = whitened[:, :2].T @ whitened[:, :2]
    line = np.linalg.solve(normal, whitened[:, :2].T @ whitened[:, 2])
    left = whitened[:, 2] - whitened[:, :2] @ line
    dof = mean.size - 2
    squares = max(float(left @ left), 1e-24)
    likelihood = -np.log(np.diag(root)).sum() - 0.5 * np.linalg.slogdet(normal)[1]
    likelihood -= 0.5 * dof * np.log(squares)
    error = np.sqrt(squares / dof * np.linalg.inv(normal)[1, 1])
    product = apart @ covariance
    effective = np.trace(product) ** 2 / np.sum(product * product.T)
    return _Mixture(float(line[1]), float(error), float(likelihood), float(effective), prior)


def _weights(mixtures: list[_Mixture]) -> Array:
    likelihood = np.array([mixture.log_likelihood for mixture in mixtures])
    weights = np.exp(likelihood - likelihood.max()) * [mixture.prior for mixture in mixtures]
    normalised: Array = weights / weights.sum()
    return normalised


def _limits(weights: Array, slopes: Array, errors: Array, dof: int) -> tuple[float, float]:
    """Quantiles of the mixture of Student's distributions, by bisection."""
    from scipy.special import stdtr  # type: ignore[import-untyped]

    tail = 0.5 * (1.0 - LEVEL)

    def below(x: float) -> float:
        return float(weights @ stdtr(dof, (x - slopes) / errors))

    def quantile(probability: float) -> float:
        low, high, width = float(slopes.min()), float(slopes.max()), float(errors.max())
        while below(low) > probability or below(high) < probability:
            low, high, width = low - width, high + width, 2.0 * width
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if below(middle) < probability else (low, middle)
        return 0.5 * (low + high)

    return quantile(tail), quantile(1.0 - tail)
