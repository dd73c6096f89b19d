"""The solver core: linear least squares by an orthogonal method, for a stack of tables at once.

Columns are scaled by powers of two, which rounds nothing, and factorised by Householder QR.
Replicates are brought down to their means first. Tables of one design share the factorisation: each
is solved by two small products, the second with its residuals, which keeps the digits of
coefficients that are thousands of times smaller than the scale factor. In units of g a tumble
design has a condition number near 8; designs that need more are refined by the augmented system.

Tables with gaps or weights of their own are solved by normal equations in the orthonormal basis of
the common design, to which only the sum of the weights of a row matters. Those are as well
conditioned as the weights allow, which the normal equations of the columns are not, and the same
correction by the residuals follows.

References
----------
A. Bjorck, "Iterative refinement of linear least squares solutions I", BIT 7 (1967) 257-278.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arrays import Array, Ints, Mask, Places
from accelcal.errors import DesignError
from accelcal.estimate.replicates import (
    MEMORY,
    CutDesign,
    Means,
    Replicates,
    twice_precise_residual,
)
from accelcal.numerics.one_thread import multiply

_Step = Callable[[Array], tuple[Array, Array]]


_MANY = 0.5
"""Where more than this share of the tables have gaps, all are solved in the way made for gaps."""

_REFINEMENTS = 3
"""Steps of iterative refinement."""

_WELL_CONDITIONED = 100.0  # below it, one correction from the residuals is enough

# Where more than this is left of all diagonal elements of the normal equations, the readings of a
# table determine its coefficients. A smaller pivot makes the rounding errors of the next so many
# times larger, so that these may pass for more than zero: eigenvalues tell then.
_CLEAR_PIVOT = 1e-4
_LEAST_EIGENVALUE = 1e-12


class Solution(NamedTuple):
    """Least squares of one table, or of a stack of T of them, which all shapes then begin with.

    Attributes
    ----------
    coefficients : ndarray, shape (..., p)
        Coefficients; NaN where gaps leave too few observations.
    squares : ndarray, shape (...)
        Sum of the squared residuals, weighted.
    variances : ndarray, shape (p,) or (..., p)
        Variance of each coefficient where the weights are inverse variances; one for all tables
        that have the same weights.
    readings : ndarray of int, shape (...)
        How many observations there are.
    """

    coefficients: Array
    squares: Array
    variances: Array
    readings: Ints

    def replaced(self, chosen: Places, other: Solution) -> Solution:
        """Put the solutions of the chosen tables in the places of these."""
        variances = np.broadcast_to(self.variances, self.coefficients.shape).copy()
        whole = self._replace(variances=variances)
        for values, part in zip(whole, other, strict=True):
            values[chosen] = part
        return whole

    def of(self, table: int) -> Solution:
        """That of one table."""
        x, squares, variances, readings = self
        one = variances if variances.ndim == 1 else variances[table]
        return Solution(x[table], squares[table], one, readings[table])


@dataclass(frozen=True, slots=True, eq=False, init=False)
class LeastSquares:
    """A factorised design matrix, ready to solve for any number of right-hand sides.

    Parameters
    ----------
    matrix : array_like, shape (n, p)
        Design matrix of full column rank, n >= p.
    sigma : array_like, shape (n,), optional
        Standard uncertainty of each observation, or anything proportional to it; by default all
        are alike.

    Attributes
    ----------
    map : ndarray, shape (p, n)
        The estimator as a matrix: coefficients = map @ y.
    condition : float
        Condition number of the weighted, column-scaled matrix.
    basis : ndarray, shape (n, p)
        Orthonormal basis of the column space of the weighted matrix.

    Raises
    ------
    DesignError
        If the matrix has fewer rows than columns or its columns are linearly dependent.

    Examples
    --------
    >>> line = LeastSquares([[1.0, 0.0], [1.0, 1.0], [1.0, 2.0]])
    >>> line.solve([1.0, 3.0, 5.0]).tolist()
    [1.0, 2.0]
    >>> line.solve([[1.0, 3.0, 5.0], [2.0, 2.0, 2.0]]).tolist()
    [[1.0, 2.0], [2.0, 0.0]]
    """

    map: Array
    condition: float
    basis: Array
    _sigma: Array
    _scale: Array
    _replicates: Replicates
    _precision: Array  # of the groups of replicates: inverse squares of sigma, shape (g,)
    _design: Array  # of the groups, with the columns scaled, without the weights, shape (g, p)
    _cut: CutDesign  # the same
    _start: Array  # the map from means of the groups, shape (p, g)
    _triangle: Array
    _back: Array  # inverse of the triangle
    _dual: Array  # the basis for sums of the groups that are not yet weighted, shape (p, g)
    _weighing: Array  # the design for the same, shape (p, g)
    _variances: Array

    def __init__(self, matrix: ArrayLike, sigma: ArrayLike = 1.0) -> None:
        given = np.asarray(matrix, dtype=np.float64)
        rows, columns = given.shape
        norms = np.sqrt((given * given).sum(axis=0))
        if rows < columns or not norms.all():
            raise DesignError(_dependent(rows, columns))
        scale = np.exp2(np.round(np.log2(norms)))
        spread = np.broadcast_to(np.asarray(sigma, dtype=np.float64), rows)
        same = Replicates.of(np.column_stack([given, spread]))
        design = given[same.first] / scale
        factors = _factors(design, spread[same.first], same.size)
        values = factors | {
            "map": factors["map"][:, same.group] / scale[:, None],
            "basis": factors["basis"][same.group],
            "_sigma": spread,
            "_scale": scale,
            "_replicates": same,
            "_design": design,
            "_cut": CutDesign.of(design),
            "_start": same.size * factors["map"],
            "_variances": (factors["_back"] ** 2).sum(axis=1) / scale**2,
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def solve(self, y: ArrayLike) -> Array:
        """Least-squares coefficients.

        Parameters
        ----------
        y : array_like, shape (n,) or (T, n)
            Observations of one table, or of each of a stack.

        Returns
        -------
        ndarray, shape (p,) or (T, p)
            Coefficients.
        """
        return self.fit(y).coefficients

    def fit(self, y: ArrayLike, weight: Array | None = None) -> Solution:
        """Least squares with the sum of squares that is left.

        Parameters
        ----------
        y : array_like, shape (n,) or (T, n)
            Observations of one table, or of each of a stack; NaN where there is none.
        weight : ndarray, shape (T, n), optional
            Weights beside those of `sigma`, zero where there is no observation.

        Returns
        -------
        Solution
            Coefficients, squares and variances.
        """
        right = np.asarray(y, dtype=np.float64)
        if self.condition > _WELL_CONDITIONED and weight is None and not np.isnan(right).any():
            return self._refined(right)
        means = self._replicates.means(np.atleast_2d(right), weight)
        gaps = np.flatnonzero(means.readings < self._sigma.size)
        if weight is None and not gaps.size:
            found = self._alike(means)
        elif weight is not None or gaps.size > _MANY * len(means.readings):
            found = self._by_own_weights(means)
        else:
            own = self._by_own_weights(means.taken(gaps))
            found = self._alike(means).replaced(gaps, own)
        return found if right.ndim == 2 else found.of(0)

    def _alike(self, means: Means) -> Solution:
        """Solve tables without gaps."""
        start = self._start @ means.reference
        return self._corrected(means, start, self._step, self._variances)

    def _by_own_weights(self, means: Means) -> Solution:
        """Solve tables that each have weights of its own in the groups."""
        half = self._half(means.weight)
        half[:, :, means.readings < len(half)] = np.nan

        def step(right: Array) -> tuple[Array, Array]:
            seen = np.einsum("pit,pt->it", half, self._weighing @ right)
            return seen, np.einsum("pit,it->pt", half, seen)

        variances = np.einsum("pit,pit->pt", half, half).T / self._scale**2
        _, start = step(means.weight * means.reference)
        return self._corrected(means, start, step, variances)

    def _step(self, right: Array) -> tuple[Array, Array]:
        """What the basis sees of weighted sums of the groups, and the solution, shape (p, T)."""
        shape = (len(self._back), right.shape[1])
        seen = np.matmul(self._dual, right, out=MEMORY.array("seen", shape))
        return seen, np.matmul(self._back, seen, out=MEMORY.array("step", shape))

    def _corrected(self, means: Means, start: Array, step: _Step, variances: Array) -> Solution:
        """Correct a solution by its residuals."""
        x = self._cut.near(start)
        residual = self._cut.subtract_fit(means.reference, x)
        right = MEMORY.array("right", residual.shape)
        np.multiply(means.weight, residual, out=right)
        right += means.sums
        seen, correction = step(right)
        x += correction
        right += means.sums
        right *= residual
        right += means.squares
        squares = np.einsum("g,gt->t", self._precision, right)  # a product may use threads
        squares -= np.einsum("it,it->t", seen, seen)
        np.maximum(squares, 0.0, out=squares)
        coefficients = np.multiply(x, 1.0 / self._scale[:, None])
        return Solution(coefficients.T, squares, variances, means.readings.astype(np.int64))

    def _half(self, weight: Array) -> Array:
        """Half of the covariance of the scaled coefficients, half @ half.T, shape (p, p, T).

        Forward elimination of the normal equations in the basis, with the way back to the
        coefficients below them; NaN where singular. It goes without pivoting, which positive
        definite matrices of equal diagonals do not need.
        """
        size, tables = len(self._back), weight.shape[1]
        rows = self._design @ self._back
        products = rows[:, :, None] * rows[:, None, :] * self._precision[:, None, None]
        normal = products.reshape(-1, size**2).T
        left = MEMORY.array("normal equations", (2 * size, size, tables))
        multiply(normal, weight, left[:size].reshape(-1, tables))
        left[size:] = self._back[:, :, None]
        diagonal = np.einsum("iit->it", left[:size])
        clear = _CLEAR_PIVOT * diagonal
        with np.errstate(divide="ignore", invalid="ignore"):
            for k in range(size):
                column = left[k : size + k + 1, k]
                column /= np.sqrt(column[0])
                product = MEMORY.array("product", (size, size - k - 1, tables))
                np.multiply(column[1:, None], column[1 : size - k], out=product)
                left[k + 1 : size + k + 1, k + 1 :] -= product
        doubtful = np.flatnonzero(~(diagonal**2 > clear).all(axis=0))
        if doubtful.size:
            some = (normal @ weight[:, doubtful]).T.reshape(-1, size, size)
            left[size:, :, doubtful[~_determined(some)]] = np.nan
        return np.asarray(left[size:])

    def _refined(self, right: Array) -> Solution:
        y = right / self._sigma
        matrix = self._design[self._replicates.group] / self._sigma[:, None]
        x = self._through_triangle(y @ self.basis)
        residual = y - x @ matrix.T
        nothing = np.zeros_like(x)
        for _ in range(_REFINEMENTS):
            f = twice_precise_residual(y, residual, matrix, x)
            g = twice_precise_residual(nothing, nothing, matrix.T, residual)  # -A' r
            h = np.linalg.solve(self._triangle.T, g.T).T
            d = f @ self.basis
            x = x + self._through_triangle(d - h)
            residual = residual + f - (d - h) @ self.basis.T
        squares = np.einsum("...n,...n->...", residual, residual)
        readings = np.full(squares.shape, self._sigma.size)
        return Solution(x / self._scale, squares, self._variances, readings)

    def _through_triangle(self, right: Array) -> Array:
        return np.asarray(np.linalg.solve(self._triangle, right.T).T)


class WithGaps(NamedTuple):
    """Least squares of T tables of one design with gaps of their own, as `LeastSquares` has it.

    Attributes
    ----------
    whole : LeastSquares
        That of a table without gaps.
    weight : ndarray, shape (T, n)
        One for each observation, zero at a gap.
    map : ndarray, shape (T, p, n)
        The estimators as matrices.
    basis : ndarray, shape (T, n, p)
        Orthonormal bases of the column spaces of the weighted matrices.
    """

    whole: LeastSquares
    weight: Array
    map: Array
    basis: Array

    @classmethod
    def of(cls, matrix: ArrayLike, there: Mask) -> WithGaps:
        """Make ready for the observations that are there, shape (T, n), of a design as there."""
        whole, weight = LeastSquares(matrix), there.astype(np.float64)
        rows = weight[..., None] * whole.basis
        triangle = np.linalg.cholesky(rows.mT @ rows).mT
        basis = np.linalg.solve(triangle.mT, rows.mT).mT
        back = whole.map @ whole.basis @ np.linalg.inv(triangle)
        return cls(whole, weight, back @ basis.mT, basis)

    def solve(self, y: Array) -> Array:
        """Coefficients of the tables, shape (T, p)."""
        return self.fit(y).coefficients

    def fit(self, y: Array) -> Solution:
        """Least squares of observations of shape (T, n), of any value at gaps."""
        return self.whole.fit(y, self.weight)


def _determined(normal: Array) -> Mask:
    """Tell which normal equations, shape (T, p, p), are not singular."""
    root = np.sqrt(np.linalg.diagonal(normal))
    root[root == 0.0] = 1.0
    scaled = normal / root[:, :, None] / root[:, None, :]
    return np.asarray(np.linalg.eigvalsh(scaled)[:, 0] > _LEAST_EIGENVALUE)


def _factors(design: Array, sigma: Array, size: int) -> dict[str, Any]:
    """Factorise a design of which each row stands for that many observations.

    The map and the basis are those of one observation each, the map without the scale.
    """
    root, precision = np.sqrt(size) / sigma[:, None], sigma**-2.0
    basis, triangle = np.linalg.qr(design * root)
    singular = np.linalg.svd(triangle, compute_uv=False)
    rows, columns = size * len(design), len(triangle)
    if singular[-1] <= rows * np.finfo(float).eps * singular[0]:
        raise DesignError(_dependent(rows, columns))
    return {
        "map": np.linalg.solve(triangle, (basis * root / size).T),
        "condition": float(singular[0] / singular[-1]),
        "basis": basis / np.sqrt(size),
        "_precision": precision,
        "_triangle": triangle,
        "_back": np.linalg.inv(triangle),
        "_dual": np.ascontiguousarray((basis / root).T * precision),
        "_weighing": np.ascontiguousarray(design.T * precision),
    }


def _dependent(rows: int, columns: int) -> str:
    return (
        f"{rows} readings do not determine {columns} coefficients;"
        " the columns of the design are linearly dependent, so ask for fewer coefficients"
    )
