"""A covariance in a result: rows of plain numbers, with its place in a JSON document."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from accelcal.results.checked import DamageError, checked, list_of, number, text

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from accelcal.arrays import Array

Rows = tuple[tuple[float, ...], ...]
Covariance = tuple[tuple[str, ...], Rows]

_ROUNDING = 1e-6


class Correlated:
    """A result with the covariance of its quantities, as rows that stay and as an array."""

    __slots__ = ()

    covariance_matrix: Rows

    @property
    def covariance(self) -> Array:
        """Their covariance, shape (n, n); (0, 0) where it is unknown."""
        import numpy as np  # here, as some results are read without it

        n = len(self.covariance_matrix)
        return np.array(self.covariance_matrix, dtype=np.float64).reshape(n, n)


def rows_of(matrix: NDArray[Any]) -> Rows:
    """Take the rows of a matrix as plain numbers, which a frozen result holds.

    Parameters
    ----------
    matrix : ndarray, shape (n, m)
        The matrix.

    Returns
    -------
    tuple of tuple of float
        Its rows.
    """
    return tuple(map(tuple, matrix.tolist()))


def covariance_document(names: Sequence[str], matrix: Rows) -> dict[str, Any]:
    """Return a covariance as it stands in a JSON document.

    Parameters
    ----------
    names : sequence of str
        What the rows belong to.
    matrix : tuple of tuple of float
        The rows; none where the covariance is unknown.

    Returns
    -------
    dict
        As `covariance` reads it.
    """
    return {"names": list(names), "matrix": [list(row) for row in matrix]}


def covariance(value: Any) -> Covariance:
    """Take the names and the matrix of a covariance; both are empty where it is unknown."""
    names = checked(value, "names", list_of(text))
    matrix = checked(value, "matrix", list_of(list_of(number)))
    sizes = {len(row) for row in matrix} | {len(matrix)}
    if sizes != {len(names)} or len(set(names)) < len(names):
        raise DamageError(f"{len(names)} names, and no matrix of that size")
    sigma = [matrix[i][i] ** 0.5 if matrix[i][i] >= 0.0 else -1.0 for i in range(len(matrix))]
    for i, row in enumerate(matrix):
        for j, item in enumerate(row):
            most = sigma[i] * sigma[j]
            if sigma[i] < 0.0 or abs(item) > most * (1.0 + _ROUNDING):
                raise DamageError(f"{item:g} in place of a covariance", "matrix", i, j)
            if abs(item - matrix[j][i]) > most * _ROUNDING:
                raise DamageError(f"{item:g} in a matrix that is not symmetric", "matrix", i, j)
    return names, matrix
