"""The solver core: linear least squares by an orthogonal method.

Columns are scaled by powers of two, which rounds nothing, and factorised by Householder QR. In
units of g a tumble design has a condition number near 8, and one correction from the residuals
keeps the digits of coefficients that are thousands of times smaller than the scale factor. Designs
that need more are refined by the augmented system. Residuals are summed in twice the working
precision.

References
----------
A. Bjorck, "Iterative refinement of linear least squares solutions I", BIT 7 (1967) 257-278.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from accelcal.errors import DesignError

__all__ = ["LeastSquares"]

Array = NDArray[np.float64]

_WELL_CONDITIONED = 100.0  # below it, one correction from the residuals is enough


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
    >>> LeastSquares([[1.0, 0.0], [1.0, 1.0], [1.0, 2.0]]).solve([1.0, 3.0, 5.0]).round(12).tolist()
    [1.0, 2.0]
    """

    map: Array
    condition: float
    basis: Array
    _matrix: Array
    _sigma: Array
    _scaled: Array
    _scale: Array
    _triangle: Array

    def __init__(self, matrix: ArrayLike, sigma: ArrayLike = 1.0) -> None:
        given = np.asarray(matrix, dtype=np.float64)
        rows, columns = given.shape
        spread = np.broadcast_to(np.asarray(sigma, dtype=np.float64), rows)
        design = given / spread[:, None]
        norms = np.sqrt((design * design).sum(axis=0))
        if rows < columns or not norms.all():
            raise DesignError(_dependent(rows, columns))
        scale = np.exp2(np.round(np.log2(norms)))
        scaled = design / scale
        basis, triangle = np.linalg.qr(scaled)
        singular = np.linalg.svd(triangle, compute_uv=False)
        if singular[-1] <= rows * np.finfo(float).eps * singular[0]:
            raise DesignError(_dependent(rows, columns))
        values = {
            "map": np.linalg.solve(triangle, basis.T) / scale[:, None] / spread,
            "condition": float(singular[0] / singular[-1]),
            "basis": basis,
            "_matrix": given,
            "_sigma": spread,
            "_scaled": scaled,
            "_scale": scale,
            "_triangle": triangle,
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def solve(self, y: ArrayLike) -> Array:
        """Least-squares coefficients.

        Parameters
        ----------
        y : array_like, shape (n,)
            Observations.

        Returns
        -------
        ndarray, shape (p,)
            Coefficients.
        """
        right = np.asarray(y, dtype=np.float64)
        if self.condition > _WELL_CONDITIONED:
            return self._refined(right / self._sigma)
        x: Array = self.map @ right
        return x + self.map @ _accurate_residual(right, np.zeros_like(right), self._matrix, x)

    def _refined(self, y: Array, steps: int = 3) -> Array:
        x = np.asarray(np.linalg.solve(self._triangle, self.basis.T @ y), dtype=np.float64)
        residual: Array = y - self._scaled @ x
        nothing = np.zeros(x.size)
        for _ in range(steps):
            f = _accurate_residual(y, residual, self._scaled, x)
            g = _accurate_residual(nothing, nothing, self._scaled.T, residual)  # -A' r
            h = np.linalg.solve(self._triangle.T, g)
            d = self.basis.T @ f
            x = x + np.linalg.solve(self._triangle, d - h)
            residual = residual + f - self.basis @ (d - h)
        return x / self._scale


def _dependent(rows: int, columns: int) -> str:
    return (
        f"{rows} readings do not determine {columns} coefficients;"
        " the columns of the design are linearly dependent, so ask for fewer coefficients"
    )


def _accurate_residual(y: Array, r: Array, matrix: Array, x: Array) -> Array:
    """Return y - r - matrix @ x, each row summed exactly before it is rounded once."""
    product = matrix * x
    rest = _product_error(matrix, np.broadcast_to(x, matrix.shape), product)
    terms = np.column_stack([y, -r, -product, -rest])
    return np.array([math.fsum(row) for row in terms.tolist()])


def _product_error(a: Array, b: Array, product: Array) -> Array:
    """Rounding error of a * b, exactly (Dekker's product with Veltkamp's splitting)."""
    a_high, a_low = _split(a)
    b_high, b_low = _split(b)
    return ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


def _split(a: Array) -> tuple[Array, Array]:
    c = 134217729.0 * a  # 2^27 + 1
    high = c - (c - a)
    return high, a - high
