"""Reading noise and head error of a test without repeated strokes, both from one set of residuals.

Noise acts on all readings alike, a head error where the output is steep. So the residuals where it
is flat tell of the noise, and the others of both. The return to the first position tells of the
noise alone, and the fewer positions there are, the more hangs on it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.estimate.contrasts import LackOfFit
from accelcal.estimate.grid import Grid
from accelcal.estimate.many_positions import ManyPositions

# Share of the head's variance that is taken off the residuals when the noise is estimated from
# them. With all of it (restricted maximum likelihood) the interval of K2 holds the truth in 92.6 %
# on 12 positions where there is no head error, as too much is put down to it (choices of
# benchmarks/coverage.py). With a third all hold it in 93.4 to 96.8 %, from 8 to 36 positions and
# whatever the head error (its regimes "one stroke").
_HEAD_SHARE = 1.0 / 3.0

_POINTS = 2000
"""Points of the grid on which the likelihood is searched."""


class ToldApart(NamedTuple):
    """What of the residuals is noise and what is the head, in each record of a stack."""

    noise: Array  # standard deviation over that of the residuals, shape (R,)
    noise_dof: Array  # its degrees of freedom, shape (R,)
    head: Array  # standard uncertainty of a head position [rad], shape (R,)


def told_apart(found: LackOfFit | ManyPositions, dof: float, declared: float | None) -> ToldApart:
    """Tell noise from head error, by contrasts in units of the residuals, which have some dof.

    The uncertainty of a head position is declared [rad], or None to be estimated.

    Notes
    -----
    Both by restricted maximum likelihood, but for `_HEAD_SHARE`. Beside a declared head error the
    noise has the degrees of freedom of its information, sum (noise / all)^2 of the variances; with
    less than one, all residuals pass for noise.
    """
    one = np.ones((len(found.number), 1))
    squares = found.deviance(one, 0.0 * one)[1]
    rest = np.maximum(dof - squares, 0.0)  # residuals in which the head does not show
    if declared is None:
        return _both(found, rest, dof)
    return _noise_beside(declared, found, rest, dof)


def _both(found: LackOfFit | ManyPositions, rest: Array, dof: float) -> ToldApart:
    strongest = found.strongest[:, None]

    def sums(ratio: Array) -> tuple[Array, Array]:
        """Those of log(variance), and of all squares over it."""
        spread, squares = found.deviance(np.ones_like(ratio), ratio / strongest**2)
        return spread, (rest + squares) / dof

    def misfit(ratio: Array) -> Array:
        spread, noise = sums(ratio)
        return np.asarray(dof * np.log(noise) + spread)

    best, least = _between(1e-3, 1e8).least(misfit)
    best = np.where(least < misfit(np.zeros_like(best)), best, 0.0)
    cautious = sums(_HEAD_SHARE * best)[1][:, 0]
    head = np.sqrt(best * sums(best)[1]) / strongest
    return ToldApart(np.sqrt(cautious), np.full(cautious.shape, dof), head[:, 0])


def _noise_beside(
    head: float, found: LackOfFit | ManyPositions, rest: Array, dof: float
) -> ToldApart:
    rest_dof = dof - found.number

    def misfit(noise: Array) -> Array:
        spread, squares = found.deviance(noise, np.full_like(noise, head**2))
        return np.asarray(spread + squares + rest_dof[:, None] * np.log(noise) + rest / noise)

    best, least = _between(1e-8, dof).least(misfit)
    one = np.ones_like(best)  # the exact answer without a head error, which no grid point hits
    best = np.where(misfit(one) < least, one, best)
    noise_dof = rest_dof + found.information(best, np.full_like(best, head**2))[:, 0]
    little = noise_dof < 1.0
    return ToldApart(
        np.where(little, 1.0, np.sqrt(best[:, 0])),
        np.where(little, dof, noise_dof),
        np.full(little.shape, head),
    )


def _between(first: float, last: float) -> Grid:
    return Grid(np.log(first), np.log(last / first) / (_POINTS - 1), _POINTS)
