"""Reading noise and head error of tests without repeated strokes, from one set of residuals.

Noise acts on all readings alike, a head error where the output is steep. So the residuals where it
is flat tell of the noise, and the others of both. The return to the first position tells of the
noise alone, and the fewer positions there are, the more hangs on it.

Several units on one head, or one clamped at several angles, tell the two apart: what no error of
the head explains is noise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.estimate.contrasts import Grid, LackOfFit
from accelcal.estimate.declared_scatter import moderated
from accelcal.estimate.many_positions import ManyPositions
from accelcal.numerics.covariance import posterior

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


_STEPS = 500
_DONE = 1e-9
_LEAST = 1e-12
"""Of the variance of the residuals: less is rounding."""


class Evidence(NamedTuple):
    """What the readings of one unit tell beside its own coefficients, in units of its noise.

    Attributes
    ----------
    information : ndarray, shape (J, J)
        S^T S, with S what no coefficient absorbs of their dependence on the head [1/rad^2].
    pull : ndarray, shape (J,)
        S^T z, with z the readings [1/rad].
    squares : float
        Sum of squares of z beside the coefficients, the head not taken out.
    left : float
        Readings less coefficients.
    """

    information: Array
    pull: Array
    squares: float
    left: float

    def in_units_of(self, noise: float) -> Evidence:
        """Return the same where the noise is `noise` times what it was."""
        square = noise**2
        return Evidence(
            self.information / square, self.pull / square, self.squares / square, self.left
        )

    def lack_of_fit(self) -> LackOfFit:
        """Return the contrasts of z that show the head, in a stack of one record."""
        values, vectors = np.linalg.eigh(self.information)
        shown = values > 1e-9 * values[-1]
        strengths, directions = np.sqrt(values[shown]), vectors[:, shown]
        contrasts = directions.T @ self.pull / strengths
        return LackOfFit(np.zeros(len(values)), contrasts[None], strengths[None], directions[None])


def noise_beside_head(
    units: Sequence[Evidence], unknown: Sequence[bool], sizes: Sequence[float], declared: float
) -> tuple[Array, Array]:
    """Estimate the noise of n units that are read on one head, where it is unknown, and its dof.

    All are in units of their noise, or of their residuals where it is unknown, which have sizes
    [g]; the uncertainty of a head position is declared [rad]. The noise is in these units, 1 where
    it is known; its degrees of freedom are `Evidence.left` where nothing tells it from the head.

    Notes
    -----
    By restricted maximum likelihood: each alone by `accelcal.estimate.unrepeated.told_apart`, then
    all together with the errors of the head in common. Weights by noises that each unit tells for
    itself would trust those that are small by chance, so they are moderated by each other.
    """
    chosen = [i for i, asked in enumerate(unknown) if asked]
    noise, dof = np.ones(len(units)), np.array([unit.left for unit in units])
    for i in chosen:
        noise[i], dof[i] = _alone(units[i], declared)
    if len(units) == 1 or not chosen:
        return noise, dof
    joint = _jointly(units, noise, chosen, declared)
    freedom = _degrees(_scaled(units, joint), chosen, declared)
    told, size = freedom >= 1.0, np.array(sizes)[chosen]
    of_all = np.array(chosen)[told]
    if not of_all.size:
        return noise, dof
    squares, doubt = moderated((joint[of_all] * size[told]) ** 2, freedom[told])
    noise[of_all] = np.sqrt(squares) / size[told]
    dof[of_all] = 1.0 / (0.5 * doubt + 1.0 / freedom[told].sum())
    return noise, dof


def _alone(unit: Evidence, declared: float) -> tuple[float, float]:
    """Noise of a unit by itself, no less than that which the head cannot make."""
    whole = math.sqrt(max(unit.squares / unit.left, _LEAST))
    residuals = unit.in_units_of(whole)
    shown = residuals.lack_of_fit()
    found = told_apart(shown, unit.left, declared)
    rest_dof = unit.left - float(shown.number[0])
    rest = residuals.squares - float(np.sum(shown.contrasts**2))
    least = math.sqrt(max(rest, 0.0) / rest_dof) if rest_dof >= 1.0 else 0.0
    return whole * max(float(found.noise[0]), least), float(found.noise_dof[0])


def _jointly(
    units: Sequence[Evidence], noise: Array, chosen: Sequence[int], declared: float
) -> Array:
    """Noise of all with the errors of the head in common, by restricted maximum likelihood.

    At the maximum the squares of what errors and coefficients leave are what that keeps of the
    noise, left - tr(M C) of its variance, M being the information of the unit and C the covariance
    of the errors.
    """
    for _ in range(_STEPS):
        scaled = _scaled(units, noise)
        errors, spread = together(scaled, declared)
        ratio = np.ones(len(units))
        for i in chosen:
            unit = scaled[i]
            squares = unit.squares + errors @ (unit.information @ errors - 2.0 * unit.pull)
            kept = unit.left - np.sum(unit.information * spread)
            ratio[i] = math.sqrt(max(float(squares / kept), 0.0))
        noise = np.maximum(noise * ratio, np.sqrt(_LEAST))
        if np.abs(ratio - 1.0).max() < _DONE:
            break
    return noise


def together(units: Sequence[Evidence], declared: float) -> tuple[Array, Array]:
    """Estimate the errors of J head positions from all that units tell of them.

    The units are in units of their noise, the declared uncertainty of a position in rad; the
    covariance is of shape (J, J).
    """
    start = np.eye(len(units[0].pull)) / declared**2
    information = start + np.sum([unit.information for unit in units], axis=0)
    return posterior(information, np.sum([unit.pull for unit in units], axis=0))


def _scaled(units: Sequence[Evidence], noise: Array) -> list[Evidence]:
    return [unit.in_units_of(size) for unit, size in zip(units, noise.tolist(), strict=True)]


def _degrees(units: Sequence[Evidence], chosen: Sequence[int], declared: float) -> Array:
    """Degrees of freedom of the noises, each estimated beside the others.

    By the information on the logarithms of their variances, half of left - 2 tr(M C) + tr(M C M C)
    of a unit with itself and of tr(M C N C) with another.
    """
    spread = together(units, declared)[1]
    seen = [unit.information @ spread for unit in units]
    whole = np.array([[np.sum(seen[i] * seen[j].T) for j in chosen] for i in chosen])
    whole += np.diag([units[i].left - 2.0 * np.trace(seen[i]) for i in chosen])
    return np.asarray(1.0 / np.diagonal(np.linalg.pinv(whole)))
