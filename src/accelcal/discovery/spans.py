"""Spans of columns: their lengths, an orthonormal basis, and what it leaves of other columns."""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array, Places


def lengths(columns: Array) -> Array:
    """Length of each column, shape (k,) for (n, k)."""
    return np.asarray(np.sqrt((columns**2).sum(axis=0)))


def scaled(columns: Array) -> tuple[Array, Array]:
    """Columns of length 1, and the lengths that they had; one of zeros stays, and has length 1."""
    norms = lengths(columns)
    norms[norms == 0.0] = 1.0
    return columns / norms, norms


def orthonormal(columns: Array) -> Array:
    """Orthonormal basis of the span of some columns, of whatever rank."""
    norms = lengths(columns)
    kept = columns[:, norms > 0.0] / norms[norms > 0.0]
    if kept.shape[1] < 2:
        return np.asarray(kept)
    values, vectors = _eigen(kept.T @ kept)
    good = values > 1e-11 * max(values[-1], 1.0)
    return np.asarray(kept @ (vectors[:, good] / np.sqrt(values[good])))


def beyond(basis: Array, taken: Array, least: float) -> Array:
    """Orthonormal basis of what another one, which is taken, leaves of a basis.

    It has the directions of which so much is left; which columns span the basis is all the same.
    """
    left = without(basis, taken)
    values, vectors = _eigen(left.T @ left)
    good = values > least**2
    return np.asarray(left @ (vectors[:, good] / np.sqrt(values[good])))


def _eigen(matrix: Array) -> tuple[Array, Array]:
    """Eigenvalues and vectors; where many are alike, LAPACK's quick way may not converge."""
    try:
        values, vectors = np.linalg.eigh(matrix)
    except np.linalg.LinAlgError:
        from scipy.linalg import eigh  # type: ignore[import-untyped]

        values, vectors = eigh(matrix, driver="ev")
    return values, vectors


def without(columns: Array, taken: Array) -> Array:
    """Take the span of an orthonormal basis out of some columns."""
    return np.asarray(columns - taken @ (taken.T @ columns))


def length_without(part: Array) -> Array:
    """Length that is left of unit vectors without a part of them, shape (k,).

    The part, shape (h, k), is that in an orthonormal basis.
    """
    return np.asarray(np.sqrt(np.maximum(1.0 - (part**2).sum(axis=0), 0.0)))


def squares_in(basis: Array, seen: Array) -> float:
    """Sum of squares of the part of a vector that an orthonormal basis spans."""
    return float(((basis.T @ seen) ** 2).sum())


def first_largest(values: Array, rounding: float = 1e-9) -> int:
    """Index of the first of `all_largest`."""
    return int(all_largest(values, rounding)[0])


def all_largest(values: Array, rounding: float = 1e-9) -> Places:
    """Indices of the largest of some values above zero, of all that are alike but for rounding.

    The largest alone would depend on the processor.
    """
    return np.flatnonzero(values >= (1.0 - rounding) * values.max(initial=0.0))
