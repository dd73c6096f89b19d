"""Errors of the head's positions: the same at one position for all strokes, runs and mountings.

A wrong angle acts on a reading by dY/dth. What the model cannot absorb of it shows in the means of
the positions as lack of fit; there its size is estimated, and from there the part of it that can
be seen is taken out of the coefficients (best linear prediction).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.grid import Grid
from accelcal.estimate.noise import NoiseStack
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

    All arrays but `positions` begin with an axis of the records where they are of a stack. There a
    contrast that tells nothing has the strength 0, in one record it is left out.

    Attributes
    ----------
    positions : ndarray, shape (J,)
        Head positions of all tables [deg].
    contrasts : ndarray, shape (..., q)
        Independent contrasts, each of variance 1 + (u * strength)^2 under a head error u.
    strengths : ndarray, shape (..., q)
        How much a head error of 1 rad shows in each contrast [1/rad].
    directions : ndarray, shape (..., J, q)
        Pattern over the head positions that each contrast sees.
    """

    positions: Array
    contrasts: Array
    strengths: Array
    directions: Array

    def in_units_of(self, noise: Array) -> LackOfFit:
        """Return the same contrasts where the reading noise is `noise` times what it was."""
        size = noise[..., None]
        return self._replace(contrasts=self.contrasts / size, strengths=self.strengths / size)

    def one(self, record: int) -> LackOfFit:
        """Return the contrasts of one record."""
        shown = self.strengths[record] > 0.0
        return LackOfFit(
            self.positions,
            self.contrasts[record, shown],
            self.strengths[record, shown],
            self.directions[record][:, shown],
        )


class HeadError(NamedTuple):
    """Standard uncertainty of a head position and the errors seen.

    All but `source` and `positions` begin with an axis of the records where they are of a stack.

    Attributes
    ----------
    uncertainty : float or ndarray
        Standard uncertainty of one position [rad].
    dof : float or ndarray
        Its degrees of freedom; infinite where declared.
    source : str
        ``"declared"``, ``"estimated"`` or ``"none"``.
    positions : ndarray, shape (J,)
        Head positions [deg].
    predicted : ndarray, shape (..., J)
        Error of each position as far as the lack of fit shows it [rad].
    unseen : ndarray, shape (..., J, J)
        Matrix that leaves of the true errors what the prediction misses.
    from_noise : ndarray, shape (..., J, q)
        Matrix that brings the reading noise, as unit contrasts, into the prediction [rad].
    """

    uncertainty: Any
    dof: Any
    source: str
    positions: Array
    predicted: Array
    unseen: Array
    from_noise: Array

    def shaped(self, root: Array) -> HeadError:
        """Return the errors where `root` makes them of independent ones of one size.

        Parameters
        ----------
        root : ndarray, shape (J, J)
            Root of the covariance over the square of `uncertainty`.
        """
        return self._replace(
            predicted=self.predicted @ root.T,
            unseen=root @ self.unseen,
            from_noise=root @ self.from_noise,
        )

    def without_prediction(self) -> HeadError:
        """Return the same head error with nothing of it taken out of the readings."""
        return self._replace(
            predicted=np.zeros_like(self.predicted),
            unseen=np.zeros_like(self.unseen) + np.eye(self.positions.size),
            from_noise=np.zeros_like(self.from_noise),
        )

    def one(self, record: int) -> HeadError:
        """Return the head error of one record."""
        seen = self.source != "estimated" or self.dof[record] > 0.0
        return HeadError(
            float(self.uncertainty[record]),
            float(self.dof[record]) if seen else np.inf,
            self.source if seen else "none",
            self.positions,
            self.predicted[record],
            self.unseen[record],
            self.from_noise[record],
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
    return np.asarray((table.angular @ coefficients)[:, None] * (table.head[:, None] == positions))


def lack_of_fit(
    tables: Sequence[PreparedTable],
    outputs: Sequence[Array],
    noises: Sequence[NoiseStack],
    coefficients: Sequence[Array],
    root: Array | None = None,
) -> LackOfFit:
    """Contrasts of the position means that no coefficient can absorb.

    Parameters
    ----------
    tables : sequence of PreparedTable
        The tables of any record of a stack.
    outputs : sequence of ndarray, shape (R, n)
        Their readings in all records [output unit].
    noises : sequence of NoiseStack
        Their noise.
    coefficients : sequence of ndarray, shape (R, 6)
        Least-squares coefficients of each table.
    root : ndarray, shape (J, J), optional
        What makes the errors of the positions of independent ones, see `HeadError.shaped`; the
        strengths and directions are those of the independent ones then.

    Returns
    -------
    LackOfFit
        Contrasts, none where the noise is unknown or the angles leave no residual.

    Notes
    -----
    Readings at one position have one mean in common, and only means can show a head error, so each
    table is reduced to those of its positions, and these to what is orthogonal to its model.
    """
    positions = distinct(np.concatenate([table.head for table in tables]))
    seen, readings, whole = [], [], np.zeros(len(outputs[0]))
    for table, y, noise, k in zip(tables, outputs, noises, coefficients, strict=True):
        means = _PositionMeans.of(table, positions)
        rate = k @ means.rate.T / noise.factor[:, None]
        seen.append(means.free * rate[:, None, :])
        whole = np.maximum(whole, (np.abs(rate) * means.largest).max(axis=1))
        # taking the fit off first keeps the digits: the contrasts ignore it anyway
        left = y - k @ table.design.T
        readings.append(left @ (means.weights / table.scatter).T / noise.factor[:, None])
    shown = np.concatenate(seen, axis=1)
    shown = shown if root is None else shown @ root
    return _contrasts(positions, shown, np.concatenate(readings, 1), whole)


class _PositionMeans(NamedTuple):
    """What the means of the positions of a table can tell beside its coefficients.

    `weights`, shape (f, n), takes the f free contrasts of the readings in units of their scatter;
    `free`, shape (f, J), is how an error that acts alike on all positions shows in them; `rate`,
    shape (J, 6), is the derivative of the design by the angle at each position [1/rad] and
    `largest`, shape (J,), the inverse scatter of its surest reading.
    """

    weights: Array
    free: Array
    rate: Array
    largest: Array

    @classmethod
    def of(cls, table: PreparedTable, positions: Array) -> _PositionMeans:
        at = (positions[:, None] == table.head) / table.scatter
        norms = np.sqrt((at * at).sum(axis=1))
        mean = at[norms > 0.0] / norms[norms > 0.0, None]
        basis = np.linalg.qr(mean @ table.least_squares.basis, mode="complete")[0]
        left = basis[:, len(table.estimability.kept) :].T
        free = np.zeros((len(left), positions.size))
        free[:, norms > 0.0] = left * norms[norms > 0.0]
        first = np.argmax(at > 0.0, axis=1)
        return cls(left @ mean, free, table.angular[first], at.max(axis=1))


def _contrasts(positions: Array, seen: Array, readings: Array, whole: Array) -> LackOfFit:
    records, rows, columns = seen.shape
    if rows == 0 or np.isnan(whole).any():  # the noise is unknown in all records, or in none
        nothing = np.zeros((records, 0))
        return LackOfFit(positions, nothing, nothing, np.zeros((records, columns, 0)))
    left, strengths, right = _singular(seen)
    shown = strengths > _LEAST_SHOWN * whole[:, None]
    some = shown.any(axis=0)  # the strongest come first
    contrasts = (readings[:, None, :] @ left[:, :, some])[:, 0]
    return LackOfFit(
        positions=positions,
        contrasts=np.where(shown[:, some], contrasts, 0.0),
        strengths=np.where(shown, strengths, 0.0)[:, some],
        directions=right[:, :, some],
    )


def _singular(matrix: Array) -> tuple[Array, Array, Array]:
    """Singular values of each matrix, the largest first, with the vectors as columns.

    They come from the squares of the smaller side, in half the time: rounding leaves eight digits
    of one of `_LEAST_SHOWN`, and none is wanted below it.
    """
    if matrix.shape[1] > matrix.shape[2]:
        return _singular(np.swapaxes(matrix, 1, 2))[::-1]
    turned = np.ascontiguousarray(np.swapaxes(matrix, 1, 2))
    squares, left = np.linalg.eigh(matrix @ turned)
    values, left = np.sqrt(np.maximum(squares, 0.0))[:, ::-1], left[:, :, ::-1]
    right = turned @ left / np.where(values > 0.0, values, 1.0)[:, None, :]
    return left, values, right


def head_error(
    found: LackOfFit,
    declared: float | None,
    *,
    separable: bool = True,
    told_apart: Array | None = None,
) -> HeadError:
    """Size of the head error, declared or estimated, and the errors as far as they are seen.

    Parameters
    ----------
    found : LackOfFit
        Contrasts of the position means, of one record or of a stack.
    declared : float or None
        Declared standard uncertainty of a head position [rad]; None to estimate it.
    separable : bool, default True
        Whether the reading noise is known apart from the lack of fit; otherwise the head error is
        not estimated, as it is in the noise already.
    told_apart : ndarray, optional
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
    like = np.zeros(found.contrasts.shape[:-1])
    if declared is not None:
        return _predict(found, like + declared, like + np.inf, "declared")
    if not separable or not found.strengths.any():
        return _predict(found, like, like + np.inf, "none")
    telling = found.strengths > _LEAST_STRENGTH * found.strengths.max(axis=-1, keepdims=True)
    if told_apart is None:
        told_apart = _most_likely(found.contrasts, found.strengths, telling)
    return _predict(found, told_apart, telling.sum(axis=-1) + like, "estimated")


def _most_likely(contrasts: Array, strengths: Array, telling: NDArray[np.bool_]) -> Array:
    """Uncertainty that makes the contrasts most likely, on a grid of 0.5 % steps [rad]."""
    strongest = strengths.max(axis=-1, keepdims=True)
    unit = 1.0 / np.where(strongest > 0.0, strongest, 1.0)
    shape, squares = (np.where(telling, x, 0.0) ** 2 for x in (unit * strengths, contrasts))
    ratio = squares / np.where(telling, shape, 1.0)
    top = 2.0 + np.sqrt(ratio.max(axis=-1, keepdims=True))
    number = np.maximum(telling.sum(axis=-1, keepdims=True), 1)
    share = number / (number + _CAUTION)

    def misfit(size: Array) -> Array:  # in a contrast that does not tell a constant
        variance = share[..., None] + shape[..., None] * size[..., None, :] ** 2
        return np.asarray((np.log(variance) + squares[..., None] / variance).sum(axis=-2))

    points = np.floor(np.log(200.0 * top) / 0.005)
    grid = Grid(np.log(0.01), np.log(200.0 * top) / (points - 1.0), points)
    best, least = grid.least(misfit)
    nothing = misfit(np.zeros_like(best))
    return np.asarray((unit * np.where(least < nothing, best, 0.0))[..., 0])


def _predict(found: LackOfFit, uncertainty: Array, dof: Array, source: str) -> HeadError:
    size = uncertainty[..., None]
    shown = (size * found.strengths) ** 2
    gain = size**2 * found.strengths / (1.0 + shown)
    directions = found.directions
    from_noise = directions * gain[..., None, :]
    seen = (from_noise * found.strengths[..., None, :]) @ np.swapaxes(directions, -1, -2)
    return HeadError(
        uncertainty=uncertainty,
        dof=dof,
        source=source,
        positions=found.positions,
        predicted=(directions @ (gain * found.contrasts)[..., None])[..., 0],
        unseen=np.eye(found.positions.size) - seen,
        from_noise=from_noise,
    )
