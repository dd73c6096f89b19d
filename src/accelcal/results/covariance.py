"""A covariance in a result: rows of plain numbers, with its place in a JSON document."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from accelcal.results.checked import DamageError, checked, list_of, number, text

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from accelcal.arrays import Array

Rows = tuple[tuple[float, ...], ...]
Covariance = tuple[tuple[str, ...], Rows]

UNKNOWN: Covariance = ((), ())

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


class CorrelatedByName(Correlated):
    """A result whose document has its covariance with what the rows belong to."""

    __slots__ = ()

    covariance_names: tuple[str, ...]

    def _covariance_document(self) -> dict[str, Any]:
        """Return the covariance as it stands in the JSON document."""
        rows = [list(row) for row in self.covariance_matrix]
        return {"names": list(self.covariance_names), "matrix": rows}

    @staticmethod
    def _covariance_fields(document: Mapping[str, Any], *missing: Covariance) -> dict[str, Any]:
        """Read the fields of the covariance; of a document that has none they are `missing`."""
        names, matrix = checked(document, "covariance", covariance, *missing)
        return {"covariance_names": names, "covariance_matrix": matrix}


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
