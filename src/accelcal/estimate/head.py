"""Errors of the head's positions: the same at one position for all strokes, runs and mountings.

A wrong angle acts on a reading by dY/dth. What the model cannot absorb of it shows in the means of
the positions as lack of fit; there its size is estimated, and from there the part of it that can
be seen is taken out of the coefficients (best linear prediction).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.noise import ReadingNoise
from accelcal.estimate.tables import PreparedTable
from accelcal.grouping import distinct

__all__ = ["HeadError", "LackOfFit", "head_error", "lack_of_fit", "sensitivity"]

Array = NDArray[np.float64]

# A contrast in which the head shows less than this much of what it shows in the best one is left
# out where the size of the head error is estimated: it tells of the noise only.
_LEAST_STRENGTH = 0.05

# Between tables there are contrasts that rest on small differences of their coefficients, which
# noise and rounding make as well; below this share of the head's action they are left out.
_LEAST_SHOWN = 1e-4

# The share dof / (dof + this) of the reading noise is taken off the lack of fit when the head's
# variance is estimated from it. Were it all (restricted maximum likelihood), the estimate would be
# zero too often where head error and noise are alike, and the 95 % intervals on 8 positions would
# hold the truth in 89 to 92 %. This way they hold it in 93.5 % or more whatever the head error,
# and in 98 % where there is none (benchmarks/coverage.py, regimes "estimated" and "nothing
# declared"). Many contrasts need less of this caution.
_CAUTION = 6.0


class LackOfFit(NamedTuple):
    """What the means of the positions say against the model, in units of the reading noise.

    Attributes
    ----------
    positions : ndarray, shape (J,)
        Head positions of all tables [deg].
    contrasts : ndarray, shape (q,)
        Independent contrasts, each of variance 1 + (u * strength)^2 under a head error u.
    strengths : ndarray, shape (q,)
        How much a head error of 1 rad shows in each contrast [1/rad].
    directions : ndarray, shape (J, q)
        Pattern over the head positions that each contrast sees.
    """

    positions: Array
    contrasts: Array
    strengths: Array
    directions: Array

    def in_units_of(self, noise: float) -> LackOfFit:
        """Return the same contrasts where the reading noise is `noise` times what it was."""
        return self._replace(contrasts=self.contrasts / noise, strengths=self.strengths / noise)


class HeadError(NamedTuple):
    """Standard uncertainty of a head position and the errors seen.

    Attributes
    ----------
    uncertainty : float
        Standard uncertainty of one position [rad].
    dof : float
        Its degrees of freedom; infinite where declared.
    source : str
        ``"declared"``, ``"estimated"`` or ``"none"``.
    positions : ndarray, shape (J,)
        Head positions [deg].
    predicted : ndarray, shape (J,)
        Error of each position as far as the lack of fit shows it [rad].
    unseen : ndarray, shape (J, J)
        Matrix that leaves of the true errors what the prediction misses.
    from_noise : ndarray, shape (J, q)
        Matrix that brings the reading noise, as unit contrasts, into the prediction [rad].
    """

    uncertainty: float
    dof: float
    source: str
    positions: Array
    predicted: Array
    unseen: Array
    from_noise: Array

    def without_prediction(self) -> HeadError:
        """Return the same head error with nothing of it taken out of the readings."""
        return self._replace(
            predicted=np.zeros_like(self.predicted),
            unseen=np.eye(self.positions.size),
            from_noise=np.zeros_like(self.from_noise),
        )


def sensitivity(table: PreparedTable, coefficients: Array, positions: Array) -> Array:
    """How the error of each head position acts on each reading.

    Parameters
    ----------
    table : PreparedTable
        Table of n readings.
    coefficients : ndarray, shape (6,)
        Coefficients of the table, zero where not estimated [output unit / g^n].
    positions : ndarray, shape (J,)
        Head positions, sorted [deg].

    Returns
    -------
    ndarray, shape (n, J)
        dY/dth in the column of the reading's position, zero elsewhere [output unit / rad].
    """
    acting = np.zeros((table.head.size, positions.size))
    column = np.searchsorted(positions, table.head)
    acting[np.arange(table.head.size), column] = table.angular @ coefficients
    return acting


def lack_of_fit(
    tables: Sequence[PreparedTable],
    outputs: Sequence[Array],
    noises: Sequence[ReadingNoise],
    coefficients: Sequence[Array],
) -> LackOfFit:
    """Contrasts of the position means that no coefficient can absorb.

    Parameters
    ----------
    tables, outputs, noises
        The tables, their readings and their noise.
    coefficients : sequence of ndarray, shape (6,)
        Least-squares coefficients of each table.

    Returns
    -------
    LackOfFit
        Contrasts, none where the noise is unknown or the angles leave no residual.
    """
    positions = distinct(np.concatenate([table.head for table in tables]))
    if any(np.isnan(noise.factor) for noise in noises):
        nothing = np.zeros(0)
        return LackOfFit(positions, nothing, nothing, np.zeros((positions.size, 0)))
    seen, readings, whole = [], [], 0.0
    for table, y, noise, k in zip(tables, outputs, noises, coefficients, strict=True):
        spread = noise.factor * table.scatter
        basis = table.least_squares.basis
        acting = sensitivity(table, k, positions) / spread[:, None]
        seen.append(acting - basis @ (basis.T @ acting))
        whole = max(whole, float(np.abs(acting).max()))
        # taking the fit off first keeps the digits: the contrasts ignore it anyway
        readings.append((y - table.design @ k) / spread)
    left, strengths, right = np.linalg.svd(np.concatenate(seen), full_matrices=False)
    shown = strengths > _LEAST_SHOWN * whole
    return LackOfFit(
        positions=positions,
        contrasts=left[:, shown].T @ np.concatenate(readings),
        strengths=strengths[shown],
        directions=right[shown].T,
    )


def head_error(
    found: LackOfFit,
    declared: float | None,
    *,
    separable: bool = True,
    told_apart: float | None = None,
) -> HeadError:
    """Size of the head error, declared or estimated, and the errors as far as they are seen.

    Parameters
    ----------
    found : LackOfFit
        Contrasts of the position means.
    declared : float or None
        Declared standard uncertainty of a head position [rad]; None to estimate it.
    separable : bool, default True
        Whether the reading noise is known apart from the lack of fit; otherwise the head error is
        not estimated, as it is in the noise already.
    told_apart : float, optional
        Estimate that came together with that of the noise [rad].

    Returns
    -------
    HeadError
        Uncertainty, degrees of freedom, source and predicted errors.

    Notes
    -----
    Estimated, the degrees of freedom are the number of contrasts that tell of the head: two on 8
    positions.
    """
    if declared is not None:
        return _predict(found, declared, np.inf, "declared")
    if not separable or found.contrasts.size == 0:
        return _predict(found, 0.0, np.inf, "none")
    telling = found.strengths > _LEAST_STRENGTH * found.strengths.max()
    if told_apart is None:
        told_apart = _most_likely(found.contrasts[telling], found.strengths[telling])
    return _predict(found, told_apart, float(telling.sum()), "estimated")


def _most_likely(contrasts: Array, strengths: Array) -> float:
    """Uncertainty that makes the contrasts most likely, on a grid of 0.5 % steps [rad]."""
    unit = 1.0 / float(strengths.max())
    top = 2.0 + float(np.abs(contrasts / strengths).max()) / unit
    grid = np.concatenate([[0.0], np.geomspace(0.01, 2.0 * top, int(np.log(200 * top) / 0.005))])
    share = contrasts.size / (contrasts.size + _CAUTION)
    variance = share + (unit * grid[:, None] * strengths) ** 2
    likelihood = -(np.log(variance) + contrasts**2 / variance).sum(axis=1)
    return unit * float(grid[np.argmax(likelihood)])


def _predict(found: LackOfFit, uncertainty: float, dof: float, source: str) -> HeadError:
    shown = (uncertainty * found.strengths) ** 2
    gain = uncertainty**2 * found.strengths / (1.0 + shown)
    directions = found.directions
    return HeadError(
        uncertainty=uncertainty,
        dof=dof,
        source=source,
        positions=found.positions,
        predicted=directions @ (gain * found.contrasts),
        unseen=np.eye(found.positions.size)
        - (directions * (gain * found.strengths)) @ directions.T,
        from_noise=directions * gain,
    )
