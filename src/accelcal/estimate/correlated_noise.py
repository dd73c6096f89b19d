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

from accelcal.arrays import Array, Ints, Mask, Places
from accelcal.estimate.noise import ReadingNoise, is_noise
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.trend import directed, moments, trend_of
from accelcal.numerics.grouping import Grouped, distinct, grouped
from accelcal.numerics.lag_sums import neighbours, polynomial, products_by_lag, sums_by_lag
from accelcal.numerics.one_thread import multiply

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

    def of_records(self, records: int | slice | Places) -> Correlation:
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
        through : ndarray, shape (p, n), or (R, p, n) where the records have gaps of their own
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
        rows = np.flatnonzero(self.counts)
        if through.ndim == 2:
            plan = _neighbours(table)
            return self.of_records(rows)._beside(plan, through, noise.of_records(rows), own, dof)
        whole, free = own.copy(), dof.copy()
        for at, row in enumerate(rows.tolist()):
            one, each = slice(at, at + 1), slice(row, row + 1)
            there, plan = np.isfinite(table.scatter[row]), _neighbours(table, row)
            part = through[row][:, there], noise.of_records(each), own[one], dof[one]
            whole[one], free[one] = self.of_records(each)._beside(plan, *part)
        return whole, free

    def _beside(
        self, plan: _Neighbours, through: Array, noise: ReadingNoise, own: Array, dof: Array
    ) -> tuple[Array, Array]:
        """The same in records that are all correlated."""
        rho, uncertainty = self
        rows = through.T[plan.order]
        by_lag = _lag_products(rows.tobytes(), len(rows))
        alone = noise.factor**2
        shrunk = np.strings.startswith(noise.source, "replicates")

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
    dof = np.array([np.atleast_1d(plan.dof) for plan in plans])  # (tables, 1), or (tables, R)
    enough = dof.sum(axis=0) >= _LEAST
    if not enough.any():
        nothing = np.zeros(len(outputs[0]))
        return Correlation(nothing, nothing)
    weight = dof / dof.sum(axis=0)
    shown = (weight * list(map(_Neighbours.shown, plans, outputs, steps))).sum(axis=0)
    curve = (weight[:, None] * [plan.expected.reshape(_RHO.size, -1) for plan in plans]).sum(axis=0)
    own = (weight**2 * [np.atleast_1d(plan.variance) for plan in plans]).sum(axis=0)
    variance = own + np.zeros(shown.size)
    some = np.flatnonzero(enough & (shown - curve[0] > _SIGNIFICANT * np.sqrt(variance)))
    if some.size:
        pairs = zip(tables, outputs, strict=True)
        uneven = [_uneven_variance(table, y, some) for table, y in pairs]
        of_some = weight[:, some] if weight.shape[1] > 1 else weight
        variance[some] = (of_some**2 * uneven).sum(axis=0)
    spread = np.sqrt(variance)
    clear = enough & (shown - curve[0] > _SIGNIFICANT * spread)
    rho = np.where(clear, _along(shown, curve, _RHO), 0.0)
    slope = _along(rho, _RHO, np.gradient(curve, _RHO, axis=0))
    # Beside a correlation the ratio scatters less, but not as little as 1 - rho^2 would make it: in
    # simulations of 27 to 162 readings 0.9 to 1.2 times of what stands here.
    return Correlation(rho, spread * np.sqrt(1.0 - rho**2 / 2.0) / slope)


def _along(values: Array, x: Array, y: Array) -> Array:
    """Interpolate at values of shape (R,), by a curve of shape (G, 1), or (G, R) of each."""
    if max(x.size, y.size) == _RHO.size:
        return np.interp(values, x.ravel(), y.ravel())
    curves = (np.broadcast_to(each.T, (values.size, _RHO.size)) for each in (x, y))
    return np.array([np.interp(*own) for own in zip(values, *curves, strict=True)])


class _Neighbours(NamedTuple):
    """What the residuals of neighbours in a table of n readings tell of their correlation.

    Where R records have gaps of their own, all begin with an axis of them, `expected` ends with it,
    and the order ends with the gaps, whose precision is 0.

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
    dof: Any = 0.0
    expected: Array = np.zeros(_RHO.size)
    variance: Any = 0.0
    pure: Array = np.ones(1)

    def shown(self, output: Array, step: Array) -> Array:
        """Products of neighbouring residuals over their squares, of readings (R, n), shape (R,).

        Where these are no larger than rounding makes them, what independent readings give.
        """
        if not np.any(self.dof):
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
        if self.order.ndim == 2:
            own = np.take_along_axis(output, self.order, axis=1) * self.precision
            return np.asarray(own - (self.taken @ (self.taken.mT @ own[..., None]))[..., 0]).T
        own = output.T[self.order] * self.precision[:, None]
        return np.asarray(own - multiply(self.taken, multiply(self.taken.T, own)))


def _uneven_variance(table: PreparedTable, output: Array, rows: Places) -> Array:
    """See `_Neighbours.uneven_variance`, of some of R records."""
    if table.scatter.ndim == 1:
        return _neighbours(table).uneven_variance(output[rows])
    there = np.isfinite(table.scatter)
    each = ((_neighbours(table, i), output[i : i + 1, there[i]]) for i in rows.tolist())
    return np.concatenate([plan.uneven_variance(own) for plan, own in each])


def _neighbours(table: PreparedTable, row: int | None = None) -> _Neighbours:
    """That of a table, or of one of the records that have gaps of their own in it."""
    scatter = table.scatter if row is None else table.scatter[row]
    arrays = table.record.angle, table.head, table.record.stroke, scatter
    if scatter.ndim == 2:
        return _told(*arrays)
    there = np.isfinite(scatter)
    return _found(*(each[there].tobytes() for each in arrays))


@lru_cache(maxsize=16)
def _found(angle: bytes, head: bytes, stroke: bytes, scatter: bytes) -> _Neighbours:
    at, on_head, spread = (np.frombuffer(each) for each in (angle, head, scatter))
    return _told(at, on_head, np.frombuffer(stroke, dtype=np.int64), spread)


def _told(angle: Array, head: Array, stroke: Ints, scatter: Array) -> _Neighbours:
    moment, there = moments(angle, stroke, None), np.isfinite(scatter)
    first = np.argsort(moment[0], kind="stable")
    # those that are there come first, in the order of time
    order = np.take(first, np.argsort(~there[..., first], axis=-1, kind="stable"))
    precision = 1.0 / np.take_along_axis(scatter, order, axis=-1)
    direction = directed(angle, stroke)
    known = _Neighbours(order, precision, grouped(head[first]))
    n, number = angle.size, there.sum(axis=-1)
    if n * distinct(direction).size > _MOST:
        return known
    cells, positions = (_means(keys, order, precision) for keys in (direction, head))
    # what is missing is put at the first reading, so that first and last stay what they are
    within = np.where(there, moment, moment[0][order[..., :1]])
    trend = trend_of(angle, stroke, within, cells.shape[-1]).columns
    trend = np.take_along_axis(trend, order.reshape(-1, n, 1), axis=1).reshape(*order.shape, -1)
    trend = trend * precision[..., None]
    more = _orthonormal(trend - cells @ (cells.mT @ trend), number)
    taken = np.concatenate([cells, more], axis=-1)
    rest = np.maximum(number - positions.shape[-1], 1)[..., None]
    pure, dof = _of_rest(positions, number) / rest, number - (taken**2).sum(axis=(-2, -1)).round()
    if (dof < 2).any():  # the ratio of a single one is the same whatever the readings are
        return known._replace(pure=pure)
    ordered = np.take_along_axis(there, order, axis=-1)
    found = neighbours(taken, np.zeros(n, dtype=np.int64), n, ordered)
    expected = polynomial(found.products.T, _RHO) / polynomial(found.squares.T, _RHO)
    variance = found.of_ratio(expected[0])
    return known._replace(taken=taken, dof=dof, expected=expected, variance=variance, pure=pure)


def _means(keys: NDArray[Any], order: Places, precision: Array) -> Array:
    """Orthonormal columns of the means of the readings of each key, in units of their noise."""
    key, cell, _ = grouped(keys)
    columns = np.equal.outer(cell, np.arange(key.size))[order] * precision[..., None]
    return np.asarray(columns / np.sqrt((columns**2).sum(axis=-2, keepdims=True)))


def _orthonormal(columns: Array, number: Any) -> Array:
    """Orthonormal columns, zero where there are fewer, for so many readings."""
    basis, size, _ = np.linalg.svd(columns, full_matrices=False)
    told = size > _ROUNDING * np.sqrt(number)[..., None]
    return np.asarray(np.where(told[..., None, :], basis, 0.0))


# -- matrices along their diagonals, see `accelcal.numerics.lag_sums` -----------------------------


def _of_rest(basis: Array, number: Any) -> Array:
    """Of 1 - basis @ basis.T, for so many readings."""
    found = -sums_by_lag(basis, basis)
    found[..., 0] += number
    return found


@lru_cache(maxsize=16)
def _lag_products(rows: bytes, n: int) -> Array:
    return products_by_lag(np.frombuffer(rows).reshape(n, -1))


def _positive(matrix: Array) -> Array:
    """Each symmetric matrix without its negative part."""
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray(vectors * np.maximum(values, 0.0)[:, None, :] @ vectors.mT)
