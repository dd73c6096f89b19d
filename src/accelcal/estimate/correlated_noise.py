"""Reading noise that is correlated from one reading to the next, as that of a slow filter.

Neighbouring readings then err alike, and a mean of many is less certain than their number says:
where each is correlated by r with the next one, by r^2 with the one after it and so on,
(1 + r) / (1 - r) of them count as one. What tells of it are replicates, readings at one angle and
in one direction, a smooth drift set aside: their residuals go with those of their neighbours.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array, Mask, Places
from accelcal.estimate.noise import ReadingNoise, is_noise
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.trend import directed, moments, trend_of
from accelcal.numerics.grouping import Grouped, grouped
from accelcal.numerics.lag_sums import neighbours, polynomial, products_by_lag, sums_by_lag
from accelcal.numerics.one_thread import multiply
from accelcal.numerics.sorting import distinct

_SIGNIFICANT = 2.3263478740408408
"""Normal quantile of 99 %: the correlation of one independent record in a hundred counts."""

_LEAST = 8.0
"""Degrees of freedom of the residuals of a record below which they tell nothing of their order."""

_RHO = np.linspace(0.0, 0.95, 39)
"""Correlations that are looked at."""

_FEWEST = 2.0
"""Degrees of freedom of what is told by a correlation of which little is known."""

_STEP = 0.01
"""Of a correlation, for a derivative."""

_MOST = 2**18
"""Readings times angles of a table beyond which it is not looked at: memory grows with them."""

_ROUNDING = 1e-9


class Correlation(NamedTuple):
    """Correlation of each reading with the next one in time, in R records."""

    rho: Array  # 0 where it is not significant at 1 %, shape (R,)
    uncertainty: Array  # its standard uncertainty, shape (R,)

    @property
    def counts(self) -> Mask:
        """Which records have one, shape (R,)."""
        return np.asarray(self.rho > 0.0)

    @property
    def readings_as_one(self) -> Array:
        """How many readings count as one in their mean, shape (R,)."""
        return np.asarray((1.0 + self.rho) / (1.0 - self.rho))

    def of_records(self, records: int | slice) -> Correlation:
        """Return that of some records of a stack, or of one alone."""
        return Correlation(self.rho[records], self.uncertainty[records])

    def beside(
        self, table: PreparedTable, through: Array, noise: ReadingNoise, own: Array, dof: Array
    ) -> tuple[Array, Array]:
        """Covariance by the noise of one table in the records that are correlated.

        Parameters
        ----------
        table : PreparedTable
            The table of n readings.
        through : ndarray, shape (p, n)
            What errors of the readings, over their declared scatter, do to p estimates.
        noise : ReadingNoise
            Noise of the table, as of independent readings.
        own : ndarray, shape (C, p, p)
            What it does to the estimates of these records.
        dof : ndarray, shape (C, p)
            Its degrees of freedom.

        Returns
        -------
        covariance : ndarray, shape (C, p, p)
            The same with what the correlation adds. What it would take off is left: nothing is
            surer than with independent readings.
        dof : ndarray, shape (C, p)
            Its degrees of freedom, by the uncertainty of noise and correlation.
        """
        rho, uncertainty = (each[self.counts] for each in self)
        plan = _neighbours(table)
        rows = through.T[plan.order]
        by_lag = _lag_products(rows.tobytes(), len(rows))
        alone = noise.factor[self.counts] ** 2
        shrunk = np.strings.startswith(noise.source[self.counts], "replicates")

        def at(rho: Array) -> Array:
            left = np.where(shrunk, polynomial(plan.pure, rho), 1.0)
            return np.asarray((alone / left)[:, None, None] * polynomial(by_lag, rho))

        added = _positive(at(rho) - alone[:, None, None] * by_lag[0])
        whole = own + added
        higher, lower = np.minimum(rho + _STEP, _RHO[-1]), rho - _STEP
        slope = (at(higher) - at(lower)) / (higher - lower)[:, None, None]
        variance, moved = (np.diagonal(each, axis1=1, axis2=2) for each in (whole, slope))
        relative = moved * uncertainty[:, None] / np.where(variance > 0.0, variance, 1.0)
        return whole, np.maximum(2.0 / (2.0 / dof + relative**2), _FEWEST)


def correlation(
    tables: Sequence[PreparedTable], outputs: Sequence[Array], steps: Sequence[Array]
) -> Correlation:
    """Estimate how each reading is correlated with the next one, alike in all tables of a record.

    The readings are of shape (R, n) in each table, with steps of shape (R,) [output unit]. It is
    not looked for where all residuals together have fewer than eight degrees of freedom, or a table
    has readings at very many angles.

    Notes
    -----
    The sum of the products of neighbouring residuals over the sum of their squares [1]_ is compared
    with what independent readings give, whose mean and variance the plan tells exactly, and the
    correlation is the one with which it would be expected. That variance is larger where the noise
    differs by position. Neighbours are those in the order of the strokes.

    References
    ----------
    .. [1] J. Durbin and G. S. Watson, "Testing for serial correlation in least squares regression",
       Biometrika 37 (1950) 409-428.
    """
    plans = [_neighbours(table) for table in tables]
    dof = np.array([plan.dof for plan in plans])
    if dof.sum() < _LEAST:
        nothing = np.zeros(len(outputs[0]))
        return Correlation(nothing, nothing)
    weight = dof / dof.sum()
    shown = weight @ list(map(_Neighbours.shown, plans, outputs, steps))
    curve = weight @ [plan.expected for plan in plans]
    variance = np.full(shown.size, weight**2 @ [plan.variance for plan in plans])
    some = np.flatnonzero(shown - curve[0] > _SIGNIFICANT * np.sqrt(variance))
    if some.size:
        pairs = zip(plans, outputs, strict=True)
        variance[some] = weight**2 @ [plan.uneven_variance(y[some]) for plan, y in pairs]
    spread = np.sqrt(variance)
    rho = np.where(shown - curve[0] > _SIGNIFICANT * spread, np.interp(shown, curve, _RHO), 0.0)
    slope = np.interp(rho, _RHO, np.gradient(curve, _RHO))
    # Beside a correlation the ratio scatters less, but not as little as 1 - rho^2 would make it: in
    # simulations of 27 to 162 readings 0.9 to 1.2 times of what stands here.
    return Correlation(rho, spread * np.sqrt(1.0 - rho**2 / 2.0) / slope)


class _Neighbours(NamedTuple):
    """What the residuals of neighbours in a table of n readings tell of their correlation.

    Attributes
    ----------
    order : ndarray of int, shape (n,)
        The readings in the order of time.
    precision : ndarray, shape (n,)
        Inverse declared scatter of each, in that order.
    positions : Grouped
        The readings in that order by head position.
    taken : ndarray, shape (n, k)
        Orthonormal columns of all that a residual does not hold.
    dof : float
        Degrees of freedom of the residuals, 0 where they are not looked at.
    expected : ndarray, shape (G,)
        Mean of what `shown` gives at each of `_RHO`.
    variance : float
        Variance of that, of independent readings.
    pure : ndarray, shape (n,)
        Share of the variance of a reading that the scatter at the positions shows, as a polynomial
        of the correlation.
    """

    order: Places
    precision: Array
    positions: Grouped
    taken: Array = np.zeros((0, 0))
    dof: float = 0.0
    expected: Array = np.zeros(_RHO.size)
    variance: float = 0.0
    pure: Array = np.ones(1)

    def shown(self, output: Array, step: Array) -> Array:
        """Products of neighbouring residuals over their squares, of readings (R, n), shape (R,).

        Where these are no larger than rounding makes them, what independent readings give.
        """
        if not self.dof:
            return np.zeros(len(output))
        residual = self._residual(output)
        products = np.einsum("nr,nr->r", residual[1:], residual[:-1])
        squares = np.einsum("nr,nr->r", residual, residual)
        size = np.sqrt(squares / self.dof) / self.precision.max()
        told = is_noise(size, step, output)
        ratio = products / np.where(told, squares, 1.0)
        return np.asarray(np.where(told, ratio, self.expected[0]))

    def uneven_variance(self, output: Array) -> Array:
        """Variance of that if the noise of each position is as its residuals show, shape (R,)."""
        if not self.dof:
            return np.zeros(len(output))
        squares = self.positions.sums(self._residual(output) ** 2)
        own = (squares / self.positions.members[:, None])[self.positions.cell]
        products = (own[1:] * own[:-1]).mean(axis=0) / own.mean(axis=0) ** 2
        return np.asarray(self.variance * np.maximum(products, 1.0))

    def _residual(self, output: Array) -> Array:
        """What means and drift leave of the readings in the order of time, shape (n, R)."""
        own = output.T[self.order] * self.precision[:, None]
        return np.asarray(own - multiply(self.taken, multiply(self.taken.T, own)))


def _neighbours(table: PreparedTable) -> _Neighbours:
    record = table.record
    arrays = record.angle, table.head, record.stroke, table.scatter
    return _found(*(each.tobytes() for each in arrays))


@lru_cache(maxsize=16)
def _found(angle: bytes, head: bytes, stroke: bytes, scatter: bytes) -> _Neighbours:
    at, on_head, spread = (np.frombuffer(each) for each in (angle, head, scatter))
    number, n = np.frombuffer(stroke, dtype=np.int64), at.size
    moment = moments(at, number, None)
    order = np.argsort(moment[0], kind="stable")
    precision, direction = 1.0 / spread[order], directed(at, number)
    known = _Neighbours(order, precision, grouped(on_head[order]))
    if n * distinct(direction).size > _MOST:
        return known
    cells, positions = (_means(keys[order], precision) for keys in (direction, on_head))
    trend = trend_of(at, number, moment, cells.shape[1]).columns[0][order] * precision[:, None]
    taken = np.hstack([cells, _orthonormal(trend - cells @ (cells.T @ trend))])
    pure, dof = _of_rest(positions) / max(n - positions.shape[1], 1), n - taken.shape[1]
    if dof < 2:  # the ratio of a single one is the same whatever the readings are
        return known._replace(pure=pure)
    found = neighbours(taken, np.zeros(n, dtype=np.int64), n)
    expected = polynomial(found.products, _RHO) / polynomial(found.squares, _RHO)
    variance = found.of_ratio(expected[0])
    return known._replace(taken=taken, dof=dof, expected=expected, variance=variance, pure=pure)


def _means(keys: NDArray[Any], precision: Array) -> Array:
    """Orthonormal columns of the means of the readings of each key, in units of their noise."""
    key, cell, _ = grouped(keys)
    columns = np.equal.outer(cell, np.arange(key.size)) * precision[:, None]
    return np.asarray(columns / np.sqrt((columns**2).sum(axis=0)))


def _orthonormal(columns: Array) -> Array:
    basis, size, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(basis[:, size > _ROUNDING * np.sqrt(len(columns))])


# -- matrices along their diagonals, see `accelcal.numerics.lag_sums` -----------------------------


def _of_rest(basis: Array) -> Array:
    """Of 1 - basis @ basis.T."""
    found = -sums_by_lag(basis, basis)
    found[0] += len(basis)
    return found


@lru_cache(maxsize=16)
def _lag_products(rows: bytes, n: int) -> Array:
    return products_by_lag(np.frombuffer(rows).reshape(n, -1))


def _positive(matrix: Array) -> Array:
    """Each symmetric matrix without its negative part."""
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray(vectors * np.maximum(values, 0.0)[:, None, :] @ vectors.mT)
