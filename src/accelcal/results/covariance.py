"""A covariance in a result: rows of plain numbers, with its place in a JSON document.

What sources of error give to quantities that are used together has the covariance C = sum C_s of
the sources s, each known from nu_s degrees of freedom. A result keeps C and D = sum C_s / nu_s: the
harmonic mean of the degrees of freedom, weighted by the shares of the variance
(`accelcal.estimate.uncertainty`), is then known for all that follows from the quantities by
derivatives J,

    u^2 = J C J',  1 / nu = J D J' / u^2.

It also keeps those C_s that whoever uses the quantities may count by itself.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from accelcal.results.documents.checked import (
    DamageError,
    checked,
    list_of,
    mapping_of,
    member,
    number,
    text,
)
from accelcal.results.documents.fields import Document, document_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from accelcal.arrays import Array

Rows = tuple[tuple[float, ...], ...]
Covariance = tuple[tuple[str, ...], Rows]

UNKNOWN: Covariance = ((), ())

EFFECTS = "effects"
"""Source of error: the sizes of the effects of a model."""

BY_OTHERS = LOOK_ALIKES, ALTERNATIVES = "look-alikes", "alternatives"
"""Sources of error: what may be there in the place of the effects of a model. Use that takes these
up counts the former by itself."""

NO_COVARIANCE: Mapping[str, Any] = MappingProxyType(
    {"covariance_names": (), "covariance_matrix": (), "over_dof_matrix": (), "shares": {}}
)
"""Fields of a `CorrelatedBySource` whose covariance is unknown."""


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
        rows = [list(row) for row in self.covariance_matrix]
        return {"names": list(self.covariance_names), "matrix": rows}

    @staticmethod
    def _covariance_fields(document: Document, *missing: Covariance) -> dict[str, Any]:
        """Read the fields of the covariance; of a document that has none they are `missing`."""
        names, matrix = checked(document, "covariance", covariance, *missing)
        return {"covariance_names": names, "covariance_matrix": matrix}


class CorrelatedBySource(CorrelatedByName):
    """A result that tells the degrees of freedom of its covariance in all directions."""

    __slots__ = ()

    over_dof_matrix: Rows
    shares: Mapping[str, Rows]

    def share(self, sources: Collection[str]) -> Array:
        """What some sources of `shares` give to the covariance, shape (n, n)."""
        import numpy as np

        own = [np.array(rows) for source, rows in self.shares.items() if source in sources]
        return np.asarray(sum(own, start=np.zeros_like(self.covariance)))

    @property
    def over_dof(self) -> Array:
        """The covariance, each source over its degrees of freedom, shape (n, n).

        Where it was not kept, the degrees of freedom of each quantity stand for those of its
        sources, and for two quantities their geometric mean.
        """
        import numpy as np

        covariance = self.covariance
        if len(self.over_dof_matrix) == len(covariance):
            return np.array(self.over_dof_matrix, dtype=np.float64).reshape(covariance.shape)
        names = self.covariance_names[: len(covariance)]
        root = np.sqrt([1.0 / self._dof_of(name) for name in names])
        return np.asarray(covariance * np.outer(root, root))

    @abstractmethod
    def _dof_of(self, name: str) -> float:
        """Return the degrees of freedom of a quantity of the covariance."""

    def _covariance_document(self) -> dict[str, Any]:
        found = CorrelatedByName._covariance_document(self)
        found["over_dof"] = [list(row) for row in self.over_dof_matrix]
        return {**found, "shares": document_of(self.shares)} if self.shares else found

    @staticmethod
    def _covariance_fields(document: Document, *missing: Covariance) -> dict[str, Any]:
        """Read the fields of the covariance; what is over the degrees of freedom may be missing."""
        known = CorrelatedByName._covariance_fields(document, *missing)
        over_dof = member("over_dof", symmetric, UNKNOWN[1])
        of_sources = checked(document, "covariance", over_dof, UNKNOWN[1])
        if of_sources and len(of_sources) != len(known["covariance_names"]):
            raise DamageError("no matrix of the size of the other", "covariance", "over_dof")
        nothing: dict[str, Rows] = {}
        by_source = member("shares", mapping_of(_square), nothing)
        shares = checked(document, "covariance", by_source, nothing)
        if any(len(own) != len(known["covariance_names"]) for own in shares.values()):
            raise DamageError("no matrices of the size of the other", "covariance", "shares")
        return {**known, "over_dof_matrix": of_sources, "shares": shares}


def correlation_of(covariance: Array) -> Array:
    """Correlations of a covariance; NaN for what is exact."""
    import numpy as np

    sigma = np.sqrt(np.diagonal(covariance))
    scale = np.outer(sigma, sigma)
    unknown = np.full(scale.shape, np.nan)
    return np.asarray(np.divide(covariance, scale, out=unknown, where=scale > 0.0))


def rows_of(matrix: NDArray[Any]) -> Rows:
    """Take the rows of a matrix as plain numbers, which a frozen result holds."""
    return tuple(map(tuple, matrix.tolist()))


def covariance(value: Any) -> Covariance:
    """Take the names and the matrix of a covariance; both are empty where it is unknown."""
    names = checked(value, "names", list_of(text))
    matrix = checked(value, "matrix", symmetric)
    if len(matrix) != len(names) or len(set(names)) < len(names):
        raise DamageError(f"{len(names)} names, and no matrix of that size")
    return names, matrix


def _square(value: Any) -> Rows:
    matrix = list_of(list_of(number))(value)
    if {len(row) for row in matrix} - {len(matrix)}:
        raise DamageError("rows that are no square matrix")
    return matrix


def symmetric(value: Any) -> Rows:
    """Take a matrix that may be a covariance."""
    matrix = _square(value)
    sigma = [row[i] ** 0.5 if row[i] >= 0.0 else -1.0 for i, row in enumerate(matrix)]
    for i, row in enumerate(matrix):
        for j, item in enumerate(row):
            most = sigma[i] * sigma[j]
            if sigma[i] < 0.0 or abs(item) > most * (1.0 + _ROUNDING):
                raise DamageError(f"{item:g} in place of a covariance", i, j)
            if abs(item - matrix[j][i]) > most * _ROUNDING:
                raise DamageError(f"{item:g} in a matrix that is not symmetric", i, j)
    return matrix
