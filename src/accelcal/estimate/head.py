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

from accelcal.arrays import Array, Places
from accelcal.estimate.contrasts import LEAST_SHOWN, Grid, LackOfFit
from accelcal.estimate.many_positions import ManyPositions
from accelcal.estimate.noise import ReadingNoise
from accelcal.estimate.tables import PreparedTable, positions_of
from accelcal.estimate.uncertainty import share_taken_off
from accelcal.numerics.grouping import Grouped

MANY_POSITIONS = 128
"""With more positions J, sums over the contrasts are formed without the contrasts, which would take
a time that grows as J^3 and matrices of J by J (see `many_positions`)."""

_ALMOST_NOTHING = 1e-6  # of the noise, so that contrasts which are zero have a likelihood as well


class HeadError(NamedTuple):
    """Standard uncertainty of a head position.

    `uncertainty` and `dof` have an axis of the records where they are of a stack.

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
    """

    uncertainty: Any
    dof: Any
    source: str
    positions: Array

    def of_records(self, records: int | slice) -> HeadError:
        """Return that of some records of a stack, or of one alone.

        Estimated, it has no degrees of freedom in a record that shows nothing of its head. Where
        that is so in all of them, it has no source.
        """
        own = self._replace(uncertainty=self.uncertainty[records], dof=self.dof[records])
        if own.source != "estimated" or np.any(own.dof > 0.0):
            return own
        return own._replace(dof=np.full_like(own.dof, np.inf), source="none")


def lack_of_fit(
    tables: Sequence[PreparedTable],
    outputs: Sequence[Array],
    noises: Sequence[ReadingNoise],
    coefficients: Sequence[Array],
    root: Array | None = None,
) -> LackOfFit | ManyPositions:
    """Contrasts of the position means that no coefficient can absorb.

    The tables are of any of R records; their readings are of shape (R, n) [output unit], their
    least-squares coefficients of shape (R, 6). A root, shape (J, J), makes the errors of the
    positions of independent ones; strengths and directions are those of the independent ones then.
    There are no contrasts where the noise is unknown or the angles leave no residual.

    Notes
    -----
    Readings at one position have one mean in common, and only means can show a head error, so each
    table is reduced to those of its positions, and these to what is orthogonal to its model.
    """
    positions = positions_of(tables)
    means = [PositionMeans.of(table, positions) for table in tables]
    rates, readings, whole = [], [], np.zeros(len(outputs[0]))
    for table, own, y, noise, k in zip(tables, means, outputs, noises, coefficients, strict=True):
        rate = k @ own.rate.T / noise.factor[:, None]
        whole = np.maximum(whole, (np.abs(rate) * own.largest).max(axis=1))
        rates.append(rate * own.norms)
        # the contrasts are blind to the fit; without it, more digits of the rest are kept
        readings.append(own.of_readings(y - k @ table.design.T) / noise.factor[:, None])
    if root is None and _are_many(means) and not np.isnan(whole).any():
        number = sum(own.places.size - own.model.shape[-1] for own in means)
        return ManyPositions.of(positions, number, [own.model for own in means], rates, readings)
    free = [own.free() for own in means]
    seen = [left * rate[:, None, :] for left, rate in zip(free, rates, strict=True)]
    shown = np.concatenate(seen, axis=1)
    shown = shown if root is None else shown @ root
    told = [
        y @ left.T if left.ndim == 2 else np.einsum("rj,rfj->rf", y, left)
        for y, left in zip(readings, free, strict=True)
    ]
    return _contrasts(positions, shown, np.concatenate(told, axis=1), whole)


def _are_many(means: Sequence[PositionMeans]) -> bool:
    """Tell positions of which contrasts would take too much to work out each."""
    coefficients = sum(own.model.shape[-1] for own in means)
    return bool(means[0].norms.shape[-1] > max(MANY_POSITIONS, coefficients))


def _contrasts(positions: Array, seen: Array, readings: Array, whole: Array) -> LackOfFit:
    records, rows, columns = seen.shape
    if rows == 0 or np.isnan(whole).any():  # the noise is unknown in all records, or in none
        nothing = np.zeros((records, 0))
        return LackOfFit(positions, nothing, nothing, np.zeros((records, columns, 0)))
    left, strengths, right = _singular(seen, LEAST_SHOWN * whole)
    shown = strengths > LEAST_SHOWN * whole[:, None]
    some = shown.any(axis=0)  # the strongest come first
    contrasts = (readings[:, None, :] @ left[:, :, some])[:, 0]
    return LackOfFit(
        positions=positions,
        contrasts=np.where(shown[:, some], contrasts, 0.0),
        strengths=np.where(shown, strengths, 0.0)[:, some],
        directions=right[:, :, some],
    )


def _singular(matrix: Array, least: Array) -> tuple[Array, Array, Array]:
    """Singular values of each matrix, the largest first, with the vectors as columns.

    They come from the squares of the smaller side, in half the time: rounding leaves eight digits
    of one of `LEAST_SHOWN`, and none is wanted below it, as `least`, shape (R,), tells of each.
    """
    if matrix.shape[1] > matrix.shape[2]:
        return _singular(matrix.mT, least)[::-1]
    turned = np.ascontiguousarray(matrix.mT)
    squares, left = _eigen(matrix @ turned, least**2)
    values, left = np.sqrt(np.maximum(squares, 0.0))[:, ::-1], left[:, :, ::-1]
    right = turned @ left / np.where(values > 0.0, values, 1.0)[:, None, :]
    return left, values, right


def _eigen(matrix: Array, least: Array) -> tuple[Array, Array]:
    """Eigenvalues of each matrix, the largest last, and vectors; what is below `least` may lack.

    The tables of one accelerometer see the head nearly in proportion to each other, so that most
    contrasts between them show next to nothing. The pivoted Cholesky factorisation leaves these out
    in a tenth of the time of all vectors, as far as it ends before half of the columns.
    """
    rest, most = matrix.copy(), (matrix.shape[1] - 1) // 2
    columns = np.zeros((*matrix.shape[:2], most))
    is_open = np.ones(len(matrix), dtype=np.bool_)
    for place in range(most):
        pivot = np.einsum("rii->ri", rest).argmax(axis=1)[:, None]
        own = np.take_along_axis(rest, pivot[..., None], axis=2)[..., 0]
        size = np.where(is_open[:, None], np.take_along_axis(own, pivot, axis=1), np.inf)
        own /= np.sqrt(np.where(size > 0.0, size, np.inf))
        rest -= own[:, :, None] * own[:, None, :]
        columns[:, :, place] = own
        is_open &= np.einsum("rii->r", rest) >= least
        if not is_open.any():
            return _eigen_of_product(columns[:, :, : place + 1])
    values, vectors = np.linalg.eigh(matrix)
    if not is_open.all():
        few, left = _eigen_of_product(columns[~is_open])
        values[~is_open], vectors[~is_open] = 0.0, 0.0
        values[~is_open, -most:], vectors[~is_open, :, -most:] = few, left
    return values, vectors


def _eigen_of_product(columns: Array) -> tuple[Array, Array]:
    """Those of each L L' that are not 0."""
    values, turned = np.linalg.eigh(columns.mT @ columns)
    return values, columns @ turned / np.sqrt(np.where(values > 0.0, values, np.inf))[:, None, :]


def head_error(
    found: LackOfFit | ManyPositions,
    declared: float | None,
    *,
    separable: bool = True,
    told_apart: Array | None = None,
) -> HeadError:
    """Size of the head error, as declared [rad], or estimated from contrasts.

    It is not estimated unless it is `separable` from the reading noise, which holds it otherwise.
    One that came together with that of the noise is `told_apart` [rad].

    Notes
    -----
    Estimated, the degrees of freedom are the number of contrasts that tell of the head: two on 8
    positions.
    """
    like = np.zeros(found.number.shape)
    if declared is not None:
        return HeadError(like + declared, like + np.inf, "declared", found.positions)
    if not separable or not found.number.any():
        return HeadError(like, like + np.inf, "none", found.positions)
    telling, dof = found.telling()
    size = _most_likely(telling, dof) if told_apart is None else told_apart
    return HeadError(size, dof + like, "estimated", found.positions)


def _most_likely(found: LackOfFit | ManyPositions, telling: NDArray[Any]) -> Array:
    """Uncertainty that makes the contrasts most likely, on a grid of 0.5 % steps [rad]."""
    strongest = found.strongest[..., None]
    unit = 1.0 / np.where(strongest > 0.0, strongest, 1.0)
    top = 2.0 + strongest * found.largest()[..., None]
    number = np.maximum(telling[..., None], 1)
    share = np.maximum(share_taken_off(number), _ALMOST_NOTHING)

    def misfit(size: Array) -> Array:
        spread, squares = found.deviance(share, (unit * size) ** 2)
        return spread + squares

    points = np.floor(np.log(200.0 * top) / 0.005)
    grid = Grid(np.log(0.01), np.log(200.0 * top) / (points - 1.0), points)
    best, least = grid.least(misfit)
    nothing = misfit(np.zeros_like(best))
    return np.asarray((unit * np.where(least < nothing, best, 0.0))[..., 0])


# -- means of the positions ------------------------------------------------------------------------


class PositionMeans(NamedTuple):
    """Means of a table at the positions of all, in units of their own uncertainty; zero elsewhere.

    Attributes
    ----------
    places : ndarray of int
        Positions of the table among the J of all.
    at_head : Grouped
        The readings of the table by its positions.
    weight : ndarray, shape (..., n)
        Inverse variances of the readings; all but `rate` begin with the records where these have
        gaps of their own.
    norms : ndarray, shape (..., J)
        Inverse uncertainty of the mean at each position.
    model : ndarray, shape (..., J, p)
        Orthonormal columns of the model.
    rate : ndarray, shape (J, 6)
        Derivative of the design by the angle [1/rad].
    largest : ndarray, shape (..., J)
        Inverse scatter of the surest reading.
    """

    places: Places
    at_head: Grouped
    weight: Array
    norms: Array
    model: Array
    rate: Array
    largest: Array

    @classmethod
    def of(cls, table: PreparedTable, positions: Array) -> PositionMeans:
        """Bring the readings of a table to means at some of J positions, shape (J,) [deg]."""
        at_head = table.at_head
        places, first = np.searchsorted(positions, at_head.key), at_head.starts
        order = at_head.order

        def all_over(values: Array) -> Array:
            whole = np.zeros((*values.shape[:-2], positions.size, values.shape[-1]))
            whole[..., places, :] = values
            return whole

        weight = table.scatter**-2.0
        norms = np.sqrt(at_head.sums(weight[..., None]))
        basis = at_head.sums(table.least_squares.basis / table.scatter[..., None])
        model = np.linalg.qr(basis / norms)[0]
        largest = np.sqrt(np.maximum.reduceat(weight[..., order], first, axis=-1))
        found = map(all_over, (norms, model, table.angular[order[first]], largest[..., None]))
        norms, model, rate, largest = found
        return cls(places, at_head, weight, norms[..., 0], model, rate, largest[..., 0])

    def of_readings(self, y: Array) -> Array:
        """Means of readings of shape (R, n), shape (R, J)."""
        means = np.zeros((len(y), self.norms.shape[-1]))
        sums = self.at_head.weighted_sums(y, self.weight)
        means[:, self.places] = sums / self.norms[..., self.places]
        return means

    def free(self) -> Array:
        """Orthonormal contrasts of the means that no coefficient absorbs, shape (..., f, J)."""
        model = self.model[..., self.places, :]
        *records, own, p = model.shape
        free = np.zeros((*records, own - p, self.norms.shape[-1]))
        free[..., self.places] = np.linalg.qr(model, mode="complete")[0][..., p:].mT
        return free
