"""Reading noise of units without replicates, from what is left beside the errors of a shared head.

Readings of one stroke leave residuals that hold errors of the head too. Clamped at another angle,
or beside other units, they tell the two apart: what no error of the head explains is noise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.estimate.contrasts import LackOfFit
from accelcal.estimate.declared_scatter import moderated
from accelcal.estimate.unrepeated import told_apart
from accelcal.numerics.covariance import posterior

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
