"""Weighted regression that knows a scatter beyond the stated uncertainties.

A value y_i of one calibration is a straight line in time, plus steps, plus two errors: one of the
stated standard uncertainty u_i, and one of a standard deviation tau that all share and nobody has
stated: from launch to launch, from stand to stand. tau is that of Paule and Mandel (1982). The
covariance of the coefficients is that of Knapp and Hartung (2003), scaled by the scatter about the
fit, with Student's quantile of n - p degrees of freedom.

Whether a calibration of larger u_i scatters more is not known: calibrations of one head share its
error, however large they state it. The fit is the mean over proportions of the variances from as
stated to all alike, each weighted by its restricted likelihood (Hoeting 1999).

One calibration may stand apart from all others: a bad one, or one alone beside a jump. The farthest
of all is judged by Student's t with the correction of Bonferroni (Cook and Weisberg 1982).

A bias that walks off and comes back leaves neighbours alike, and a walk of a few years looks like a
drift. Few calibrations do not tell one from the other, so the drift has a second interval, for the
case that a quarter to all of what scatters is a random walk: the mean over such shares, each
weighted by its restricted likelihood (Hoeting 1999).

References
----------
Cook, R. D., Weisberg, S. (1982), Residuals and Influence in Regression, section 2.2.2.
Hoeting, J. A., et al. (1999), Statistical Science 14, 382-417: averages over models.
Knapp, G., Hartung, J. (2003), Statistics in Medicine 22, 2693-2710.
Paule, R. C., Mandel, J. (1982), J. Res. Natl. Bur. Stand. 87, 377-385.
Viechtbauer, W. (2007), Statistics in Medicine 26, 37-52: the interval of tau.
J. Durbin, G. S. Watson, "Testing for serial correlation in least squares regression", Biometrika 37
(1950) 409: the ratio, here against drawn values in place of its bounds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.numerics.covariance import ratios_by_the_others
from accelcal.numerics.probability import (
    LEVEL,
    NORMAL_FACTOR,
    f_quantile,
    student_quantile,
    student_survival,
)

ROUNDING = 1e-12
"""Sum of squares about the line, over the variances, below which it is rounding: the values are a
millionth of their standard deviations off the line."""

_FEWEST = 2
"""Degrees of freedom that the others need, to see how they scatter."""

_ROUNDS = 4
_GRID = 41
_PROPORTIONS = 6


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A fitted regression of n values on p columns."""

    # shape (p,): the coefficients and their standard uncertainties
    coefficients: Array
    uncertainties: Array
    # tau, the standard deviation beyond the stated uncertainties [unit of the values]
    scatter: float
    scatter_limits: tuple[float, float]  # ends of its 95 % interval
    dof: int  # n - p, of Student's quantile
    # shape (p,): standard uncertainties of what all values have in common, beside `uncertainties`
    shared: Array

    def interval(self, place: int, level: float = LEVEL) -> tuple[float, float]:
        """Standard uncertainty of a coefficient, and half the width of its interval."""
        own, shared = float(self.uncertainties[place]), float(self.shared[place])
        wide = math.hypot(student_quantile(level, self.dof) * own, NORMAL_FACTOR * shared)
        return math.hypot(own, shared), wide


def fit_line(columns: Array, values: Array, uncertainty: Array) -> Fit:
    """Fit values with stated uncertainties, shape (n,), and a common scatter beyond them.

    They depend on p columns, shape (n, p), with n > p.

    Notes
    -----
    The factor of Knapp and Hartung, sum w r^2 / (n - p), may be below 1: stated uncertainties have
    parts that all calibrations share, which do not scatter. No uncertainty is below 1/t of that by
    what is stated, with Student's t for 95 %, so that no interval is narrower than the standard
    uncertainty by what is stated: values on a line by chance do not make it certain.

    Examples
    --------
    >>> columns = np.stack([np.ones(4), np.arange(4.0)], axis=1)
    >>> fit = fit_line(columns, np.array([1.0, 3.1, 4.9, 7.0]), np.full(4, 0.1))
    >>> fit.coefficients.round(2), fit.dof
    (array([1.03, 1.98]), 2)
    """
    dof = values.size - columns.shape[1]
    scatter, *limits = (
        scatter_where(columns, values, uncertainty, squares) for squares in (dof, *_expected(dof))
    )
    fits = _Weighted.of(columns, values, proportions(uncertainty**2 + scatter**2))
    chances = shares(fits.log_size - 0.5 * dof * np.log(np.maximum(fits.squares, ROUNDING)))
    variances = np.diagonal(fits.inverse, axis1=1, axis2=2)
    mean = chances @ fits.coefficients
    within = fits.squares[:, None] / dof * variances
    found = chances @ (within + (fits.coefficients - mean) ** 2)
    least = variances[0] / student_quantile(LEVEL, dof) ** 2
    uncertainties = np.sqrt(np.maximum(found, least))
    return Fit(mean, uncertainties, scatter, (limits[0], limits[1]), dof, 0.0 * mean)


def proportions(variance: Array) -> Array:
    """List variances between those given, shape (n,), and their mean, alike for all, shape (k, n).

    The first are as given, the last all alike, the others evenly between.
    """
    alike = np.linspace(0.0, 1.0, _PROPORTIONS)[:, None]
    return np.asarray((1.0 - alike) * variance + alike * variance.mean())


def shares(likelihood: Array) -> Array:
    """Turn logarithms of likelihoods along the first axis into shares that add up to 1."""
    relative = np.exp(likelihood - likelihood.max(axis=0))
    return np.asarray(relative / relative.sum(axis=0))


def scatter_where(columns: Array, values: Array, uncertainty: Array, squares: float) -> float:
    """Find the scatter beyond the stated uncertainties with which the weighted squares add up.

    These are sum w r^2 with w = 1 / (u^2 + tau^2): n - p tells tau (Paule and Mandel 1982),
    quantiles of chi-squared its interval (Viechtbauer 2007). It is 0 where the stated uncertainties
    explain the scatter [unit of the values].
    """
    low, high = 0.0, float(np.std(values)) * math.sqrt(values.size / squares)
    for _ in range(_ROUNDS):
        tried = np.linspace(low, high, _GRID)
        variance = uncertainty**2 + tried[:, None] ** 2
        above = _Weighted.of(columns, values, variance).squares > squares
        number = int(np.count_nonzero(above))  # as they fall with tau
        if number == 0:
            return low
        low, high = tried[number - 1], tried[min(number, _GRID - 1)]
    return float(0.5 * (low + high))


def _expected(dof: int) -> tuple[float, float]:
    """Ends of the interval that holds a sum of squares of `dof` degrees in 95 %, larger first."""
    tail = 0.5 * (1.0 - LEVEL)
    return dof * f_quantile(tail, dof, math.inf), dof * f_quantile(1.0 - tail, dof, math.inf)


class _Weighted(NamedTuple):
    """Fits with weights of k sets of variances.

    `coefficients`, shape (k, p), `inverse`, shape (k, p, p), of the normal matrix, and of shape
    (k,) the weighted `squares` about the fit, and `log_size`, the logarithm of the restricted
    likelihood but for them.
    """

    coefficients: Array
    inverse: Array
    squares: Array
    log_size: Array

    @classmethod
    def of(cls, columns: Array, values: Array, variance: Array) -> _Weighted:
        """Fit with each row of variances, shape (k, n)."""
        weighted = columns / variance[:, :, None]
        normal = np.einsum("kij,il->kjl", weighted, columns)
        inverse = np.linalg.inv(normal)
        coefficients = np.einsum("kjl,kil,i->kj", inverse, weighted, values)
        squares = ((values - coefficients @ columns.T) ** 2 / variance).sum(axis=1)
        log_size = -0.5 * (np.log(variance).sum(axis=1) + np.linalg.slogdet(normal)[1])
        return cls(coefficients, inverse, squares, np.asarray(log_size))


def farthest(columns: Array, values: Array, uncertainty: Array) -> tuple[int, float]:
    """Find the value that is farthest from what the others say: its place, and its chance by noise.

    Values and standard uncertainties, shape (n,), follow the columns of a line, (n, p). The chance
    is that of the farthest of all, 1 where the others are too few to tell. The scatter is that of
    the others. Whether it is in proportion to the stated uncertainties is not known: the chance is
    the largest for proportions from as stated to all alike.

    Examples
    --------
    >>> columns = np.stack([np.ones(8), np.arange(8.0)], axis=1)
    >>> place, chance = farthest(columns, np.array([1, 2, 4, 4, 5, 7, 7, 20.0]), np.ones(8))
    >>> place, round(chance, 4)
    (7, 0.0001)
    """
    dof = values.size - columns.shape[1] - 1
    if dof < _FEWEST:
        return 0, 1.0
    sigma = np.sqrt(proportions(uncertainty**2))
    ratios = [_ratios(columns / own[:, None], values / own, dof) for own in sigma]
    least = np.min(ratios, axis=0)
    place = int(least.argmax())
    both_sides = 2.0 * student_survival(float(least[place]), dof)
    return place, min(1.0, values.size * both_sides)


def _ratios(columns: Array, values: Array, dof: int) -> Array:
    """Distance of each value from the line of the others, over its standard uncertainty by them."""
    base = np.linalg.qr(columns).Q
    left = values - base @ (base.T @ values)
    freedom = np.maximum(1.0 - (base**2).sum(axis=1), ROUNDING)
    return ratios_by_the_others(left, freedom, dof + 1.0, ROUNDING)


_TELLING = 3
"""Residual degrees of freedom below which neighbours tell nothing."""

_DRAWS = 4000

_OF_A_WALK = (0.25, 0.5, 0.75, 1.0)
"""Shares of the scatter about the line that a walk may make."""

_LEAST = 1e-6
"""Share of independent scatter that is left beside a walk: the first value has no other."""


def chance_of_neighbours(columns: Array, values: Array, sigma: Array) -> float:
    """Chance that independent errors leave neighbours as much alike as these, one-sided.

    The values, shape (n,), have errors with the standard deviations sigma, up to a factor, about a
    line of p columns by date, (n, p). The chance is by values that are drawn, the same each time;
    it is 1 where there are too few, or rounding alone is left of them.

    Examples
    --------
    >>> columns = np.ones((12, 1))
    >>> round(chance_of_neighbours(columns, np.sin(np.arange(12.0) / 2.0), np.ones(12)), 3)
    0.0
    >>> round(chance_of_neighbours(columns, np.cos(2.0 * np.arange(12.0)), np.ones(12)), 1)
    0.8
    """
    if values.size - columns.shape[1] < _TELLING:
        return 1.0
    basis = np.linalg.qr(columns / sigma[:, None]).Q
    drawn = np.random.default_rng(0).standard_normal((_DRAWS, values.size))
    whole = np.concatenate([(values / sigma)[None], drawn])
    left = whole - (whole @ basis) @ basis.T
    if (left[0] ** 2).sum() < ROUNDING:
        return 1.0
    ratio = (np.diff(left, axis=1) ** 2).sum(axis=1) / np.maximum((left**2).sum(axis=1), 1e-300)
    return float(np.mean(ratio[1:] <= ratio[0]))


def line_of_a_walk(
    time: Array, columns: Array, values: Array, variance: Array
) -> tuple[Array, Array]:
    """Fit values that walk: a part of what scatters stays, and adds up.

    Dates, rising [years], have values with the variances that their errors would have if these were
    independent, up to a factor, all of shape (n,); they depend on p columns, (n, p), with n > p.
    The coefficients come with their standard uncertainties by n - p degrees of freedom.

    Examples
    --------
    >>> time = np.arange(10.0)
    >>> columns = np.stack([np.ones(10), time], axis=1)
    >>> values = np.array([0.0, 1.0, 3.0, 3.0, 2.0, 4.0, 6.0, 7.0, 7.0, 9.0])
    >>> line, uncertainty = line_of_a_walk(time, columns, values, np.ones(10))
    >>> float(line[1].round(2)), float(uncertainty[1].round(2))
    (0.97, 0.29)
    """
    basis, since = np.linalg.qr(columns).Q, time - time[0]
    alone, walk = np.diag(variance), np.minimum.outer(since, since)
    walk = walk * (_about_the_line(alone, basis) / _about_the_line(walk, basis))
    alone = alone * (1.0 - np.array(_OF_A_WALK) + _LEAST)[:, None, None]
    whole = alone + np.array(_OF_A_WALK)[:, None, None] * walk
    root = np.linalg.inv(np.linalg.cholesky(whole))
    seen, told = root @ columns, root @ values
    inverse = np.linalg.inv(seen.mT @ seen)
    found = (inverse @ (seen.mT @ told[..., None]))[..., 0]
    squares = ((told - (seen @ found[..., None])[..., 0]) ** 2).sum(axis=1)
    dof = values.size - columns.shape[1]
    size = np.linalg.slogdet(root)[1] + 0.5 * np.linalg.slogdet(inverse)[1]
    chances = shares(size - 0.5 * dof * np.log(np.maximum(squares, 1e-300)))
    mean = chances @ found
    within = (squares / dof)[:, None] * np.diagonal(inverse, axis1=1, axis2=2)
    return mean, np.sqrt(chances @ (within + (found - mean) ** 2))


def _about_the_line(covariance: Array, basis: Array) -> float:
    """Expected sum of squares that errors leave about a line."""
    return float(np.trace(covariance) - np.trace(basis.T @ covariance @ basis))
