"""Sums along the diagonals of matrices, as noise with a memory asks for them.

Where P holds rho^|i - j|, the covariance of a process of first order, tr(A P) is a polynomial of
rho: its coefficients are the sums of A along its diagonals, those on both sides together.
"""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array


def sums_by_lag(first: Array, second: Array) -> Array:
    """Sum ``first @ second.T`` along its diagonals, without the matrix.

    Parameters
    ----------
    first, second : ndarray, shape (n, k)
        Columns.

    Returns
    -------
    ndarray, shape (n,)
        Sum of the diagonal, then those at each distance from it on both sides together.

    Examples
    --------
    >>> column = np.array([[1.0], [2.0], [3.0]])
    >>> sums_by_lag(column, column).round(9).tolist()  # 1 + 4 + 9, 2 (2 + 6), 2 * 3
    [14.0, 16.0, 6.0]
    """
    n = len(first)
    one, other = (np.fft.rfft(each, 2 * n, axis=0) for each in (first, second))
    sums = np.fft.irfft((one * other.conj()).sum(axis=1), 2 * n)
    return np.asarray(np.concatenate([sums[:1], sums[1:n] + sums[:n:-1]]))


def products_by_lag(columns: Array) -> Array:
    """Sum the products of each two columns at each distance.

    Parameters
    ----------
    columns : ndarray, shape (n, p)
        Columns C.

    Returns
    -------
    ndarray, shape (n, p, p)
        Coefficients of C' P C as a polynomial of rho.

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
    """Evaluate such polynomials.

    Parameters
    ----------
    by_lag : ndarray, shape (n, ...)
        Their coefficients.
    rho : ndarray, shape (C,)
        Correlations.

    Returns
    -------
    ndarray, shape (C, ...)
        Their values.

    Examples
    --------
    >>> polynomial(np.array([14.0, 16.0, 6.0]), np.array([0.0, 0.5])).tolist()
    [14.0, 23.5]
    """
    powers = rho[:, None] ** np.arange(len(by_lag))
    return np.asarray(np.tensordot(powers, by_lag, axes=1))
