"""The solver core: linear least squares by an orthogonal method, for a stack of tables at once.

Columns are scaled by powers of two, which rounds nothing, and factorised by Householder QR. Tables
of one design share the factorisation: each is solved by two products with one matrix, the second
with its residuals, which keeps the digits of coefficients that are thousands of times smaller than
the scale factor. In units of g a tumble design has a condition number near 8; designs that need
more are refined by the augmented system.

Tables with weights of their own, zero at their gaps, are solved by normal equations in the
orthonormal basis of the common design. Those are as well conditioned as the weights allow, which
the normal equations of the columns are not, and the same correction by the residuals follows.

References
----------
A. Bjorck, "Iterative refinement of linear least squares solutions I", BIT 7 (1967) 257-278.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from accelcal.errors import DesignError
from accelcal.estimate.residuals import CutDesign, twice_precise_residual

__all__ = ["LeastSquares", "Solution"]

Array = NDArray[np.float64]

_WELL_CONDITIONED = 100.0  # below it, one correction from the residuals is enough

# Where less than this is left of a diagonal element of the normal equations, the readings of a
# table do not determine its coefficients.
_LEAST_PIVOT = 1e-12


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
    """

    coefficients: Array
    squares: Array
    variances: Array


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
    _triangle: Array
    _back: Array  # inverse of the triangle
    _dual: Array  # the basis over sigma
    _first: Array  # the map to the coefficients of the scaled columns
    _precision: Array  # inverse squares of sigma
    _cut: CutDesign  # of the matrix with its columns scaled, without the weights

    def __init__(self, matrix: ArrayLike, sigma: ArrayLike = 1.0) -> None:
        given = np.asarray(matrix, dtype=np.float64)
        rows, columns = given.shape
        norms = np.sqrt((given * given).sum(axis=0))
        if rows < columns or not norms.all():
            raise DesignError(_dependent(rows, columns))
        scale = np.exp2(np.round(np.log2(norms)))
        spread = np.broadcast_to(np.asarray(sigma, dtype=np.float64), rows)
        basis, triangle = np.linalg.qr(given / scale / spread[:, None])
        singular = np.linalg.svd(triangle, compute_uv=False)
        if singular[-1] <= rows * np.finfo(float).eps * singular[0]:
            raise DesignError(_dependent(rows, columns))
        values = {
            "map": np.linalg.solve(triangle, basis.T) / scale[:, None] / spread,
            "condition": float(singular[0] / singular[-1]),
            "basis": basis,
            "_sigma": spread,
            "_scale": scale,
            "_triangle": triangle,
            "_back": np.linalg.inv(triangle),
            "_dual": basis / spread[:, None],
            "_first": np.linalg.solve(triangle, basis.T) / spread,
            "_precision": spread**-2.0,
            "_cut": CutDesign.of(given / scale),
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

    def fit(self, y: ArrayLike, work: Array | None = None) -> Solution:
        """Least squares with the sum of squares that is left.

        Parameters
        ----------
        y : array_like, shape (n,) or (T, n)
            Observations of one table, or of each of a stack.
        work : ndarray, shape (2, n) or (2, T, n), optional
            Memory to work in.

        Returns
        -------
        Solution
            Coefficients, squares and variances.
        """
        right = np.asarray(y, dtype=np.float64)
        if self.condition > _WELL_CONDITIONED:
            x, squares = self._refined(right / self._sigma)
        else:
            start = self._cut.near(right @ self._first.T)
            residual = self._cut.residual(right, start, work)
            seen = residual @ self._dual
            x = start + seen @ self._back.T
            squares = np.square(residual, out=residual) @ self._precision - _squares(seen)
        variances = (self._back**2).sum(axis=1) / self._scale**2
        return Solution(x / self._scale, np.maximum(squares, 0.0), variances)

    def fit_weighted(self, y: Array, weight: Array, work: Array | None = None) -> Solution:
        """Least squares where each table has weights of its own.

        Parameters
        ----------
        y : ndarray, shape (T, n)
            Observations; anything finite where the weight is zero.
        weight : ndarray, shape (T, n)
            Weights beside those of `sigma`; zero leaves an observation out.
        work : ndarray, shape (2, T, n), optional
            Memory to work in.

        Returns
        -------
        Solution
            Coefficients, squares and variances.
        """
        inverse = _inverse(self._normal_equations(weight))
        work = np.empty((2, *y.shape)) if work is None else work
        start, _ = self._weighted_step(np.multiply(weight, y, out=work[0]), inverse)
        start = self._cut.near(start @ self._back.T)
        residual = self._cut.residual(y, start, work)
        weighted = np.multiply(weight, residual, out=work[1])
        step, seen = self._weighted_step(weighted, inverse)
        squares = np.multiply(weighted, residual, out=residual) @ self._precision
        squares -= np.einsum("tp,tp->t", step, seen)
        back = self._back / self._scale[:, None]
        pairs = (back[:, :, None] * back[:, None, :]).reshape(len(back), -1)
        return Solution(
            (start + step @ self._back.T) / self._scale,
            np.maximum(squares, 0.0),
            (pairs @ inverse.reshape(pairs.shape[1], -1)).T,
        )

    def _normal_equations(self, weight: Array) -> Array:
        """Normal equations in the basis, shape (p, p, T)."""
        size = self.basis.shape[1]
        products = self.basis[:, :, None] * self.basis[:, None, :]
        return np.asarray((products.reshape(-1, size**2).T @ weight.T).reshape(size, size, -1))

    def _weighted_step(self, weighted: Array, inverse: Array) -> tuple[Array, Array]:
        """Solve the normal equations; the solution and the right-hand side, shape (T, p)."""
        right = self._dual.T @ weighted.T
        return (inverse * right).sum(axis=1).T, right.T

    def _refined(self, y: Array, steps: int = 3) -> tuple[Array, Array]:
        matrix = (self._cut.high + self._cut.low).T / self._sigma[:, None]
        x = self._through_triangle(y @ self.basis)
        residual = y - x @ matrix.T
        nothing = np.zeros_like(x)
        for _ in range(steps):
            f = twice_precise_residual(y, residual, matrix, x)
            g = twice_precise_residual(nothing, nothing, matrix.T, residual)  # -A' r
            h = np.linalg.solve(self._triangle.T, g.T).T
            d = f @ self.basis
            x = x + self._through_triangle(d - h)
            residual = residual + f - (d - h) @ self.basis.T
        return x, _squares(residual)

    def _through_triangle(self, right: Array) -> Array:
        return np.asarray(np.linalg.solve(self._triangle, right.T).T)


def _squares(rows: Array) -> Array:
    return np.asarray(np.einsum("...n,...n->...", rows, rows))


def _inverse(normal: Array) -> Array:
    """Invert a stack of normal equations by sweeping, shape (p, p, T); NaN where singular.

    Without pivoting, which positive definite matrices of equal diagonals do not need.
    """
    left = normal.copy()
    for k, whole in enumerate(np.einsum("kkt->kt", normal)):
        pivot = np.where(left[k, k] > _LEAST_PIVOT * whole, left[k, k], np.nan)
        row = left[k] / pivot
        column = left[:, k].copy()
        left -= column[:, None] * row
        left[k], left[:, k] = row, -column / pivot
        left[k, k] = 1.0 / pivot
    return left


def _dependent(rows: int, columns: int) -> str:
    return (
        f"{rows} readings do not determine {columns} coefficients;"
        " the columns of the design are linearly dependent, so ask for fewer coefficients"
    )
