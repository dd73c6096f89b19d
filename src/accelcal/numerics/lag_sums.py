"""Sums along the diagonals of matrices, as noise with a memory asks for them.

Where P holds rho^|i - j|, the covariance of a process of first order, tr(A P) is a polynomial of
rho: its coefficients are the sums of A along its diagonals, those on both sides together.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from accelcal.arrays import Array, Ints, Mask
from accelcal.numerics.grouping import distinct


def sums_by_lag(first: Array, second: Array) -> Array:
    """Sum ``first @ second.T`` along its diagonals, without the matrix, of columns (..., n, k).

    These are the sum of the diagonal, then those at each distance from it on both sides together,
    shape (..., n).

    Examples
    --------
    >>> column = np.array([[1.0], [2.0], [3.0]])
    >>> sums_by_lag(column, column).round(9).tolist()  # 1 + 4 + 9, 2 (2 + 6), 2 * 3
    [14.0, 16.0, 6.0]
    """
    n = first.shape[-2]
    one, other = (np.fft.rfft(each, 2 * n, axis=-2) for each in (first, second))
    sums = np.fft.irfft((one * other.conj()).sum(axis=-1), 2 * n)
    sums[..., 1:n] += sums[..., :n:-1]
    return np.asarray(sums[..., :n])


class Neighbours(NamedTuple):
    """What is expected of the products of neighbours in residuals, see `neighbours`.

    Attributes
    ----------
    products, squares : ndarray, shape (..., lags)
        Mean of the sum of products, and of that of squares, as polynomials of the correlation of
        neighbours.
    variance : float or ndarray, shape (...)
        Half of the variance of the sum of products, of independent readings of variance 1.
    """

    products: Array
    squares: Array
    variance: Any

    def of_ratio(self, mean: Any) -> Any:
        """Variance of the ratio of both sums, of independent readings, from its mean."""
        dof = self.squares[..., 0]
        return 2.0 * (self.variance - dof * mean**2) / (dof * (dof + 2.0))


def neighbours(basis: Array, run: Ints, lags: int, there: Mask | None = None) -> Neighbours:
    """Tell what to expect of the residuals of n readings beside an orthonormal basis.

    Neighbours follow each other in the same run, shape (n,). Sums are taken up to so many lags. Of
    several bases, shape (..., n, k), each may have its first readings only; which are `there`,
    shape (..., n), and the basis is 0 at the others.

    Notes
    -----
    The basis B leaves P y with P = I - B B'. With D, by which e' D e sums the products of
    neighbours, the means are traces of P D P and of P with the correlations, and the variance is
    twice the trace of (P D P)^2 (Durbin and Watson, Biometrika 37 (1950) 409).
    """
    own = np.ones(run.size, dtype=np.bool_) if there is None else there
    both = 1.0 * ((run[1:] == run[:-1]) & own[..., 1:])
    beside = np.zeros_like(basis)  # D B
    beside[..., :-1, :] += 0.5 * both[..., None] * basis[..., 1:, :]
    beside[..., 1:, :] += 0.5 * both[..., None] * basis[..., :-1, :]
    inside = basis.mT @ beside
    products, squares = np.zeros((2, *basis.shape[:-2], lags))
    number, pairs = own.sum(axis=-1), both.sum(axis=-1)
    for each in distinct(run).tolist():
        of_run = run == each
        some = slice(min(lags, np.count_nonzero(of_run)))
        part, left = basis[..., of_run, :], (basis @ inside - 2.0 * beside)[..., of_run, :]
        products[..., some] += sums_by_lag(left, part)[..., some]
        squares[..., some] -= sums_by_lag(part, part)[..., some]
    products[..., 1:2] += pairs[..., None]
    squares[..., 0] += number
    variance = pairs / 2.0 - 2.0 * (beside**2).sum(axis=(-2, -1)) + (inside**2).sum(axis=(-2, -1))
    return Neighbours(products, squares, variance)


def products_by_lag(columns: Array) -> Array:
    """Sum the products of each two columns at each distance, from shape (n, p) to shape (n, p, p).

    They are the coefficients of C' P C as a polynomial of rho.

    Examples
    --------
    >>> products_by_lag(np.array([[1.0], [2.0], [3.0]])).round(9).ravel().tolist()
    [14.0, 16.0, 6.0]
    """
    n = len(columns)
    own = np.fft.rfft(columns, 2 * n, axis=0)
    sums = np.fft.irfft(own[:, :, None] * own[:, None].conj(), 2 * n, axis=0)[:n]
    sums[1:] += sums[1:].mT
    return np.asarray(sums)


def polynomial(by_lag: Array, rho: Array) -> Array:
    """Evaluate such polynomials, of coefficients of shape (n, ...), at correlations of shape (C,).

    Examples
    --------
    >>> polynomial(np.array([14.0, 16.0, 6.0]), np.array([0.0, 0.5])).tolist()
    [14.0, 23.5]
    """
    powers = rho[:, None] ** np.arange(len(by_lag))
    return np.asarray(np.tensordot(powers, by_lag, axes=1))
