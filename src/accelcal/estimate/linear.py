"""A linear estimator of one table: the coefficients are a matrix times the readings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Literal, NamedTuple, get_args

import numpy as np

from accelcal.arguments.options import check_choice
from accelcal.arrays import Array
from accelcal.errors import InputError
from accelcal.estimate.tables import PreparedTable
from accelcal.model import COEFFICIENTS

Method = Literal["least-squares", "closed-form", "sign-corrected", "printed"]

METHODS: tuple[Method, ...] = get_args(Method)
"""Names of the estimators; the first is the default."""


class LinearEstimator(NamedTuple):
    """Coefficients of one table as a linear map of its readings."""

    table: PreparedTable  # of n readings
    names: tuple[str, ...]  # the p coefficients that are estimated
    map: Array  # the estimator, shape (p, n)
    solve: Callable[[Array], Array]  # the same, of readings (..., n), with less rounding error
    stands_for: Mapping[str, str]  # what an estimate tells, where it is not the coefficient alone

    def coefficients(self, output: Array) -> Array:
        """Coefficients, shape (..., 6), of readings, shape (..., n); zero where not estimated."""
        return self.expand(self.solve(output))

    def expand(self, values: Array) -> Array:
        """Put the values of the p estimated coefficients among all six, the others zero."""
        full = np.zeros((*values.shape[:-1], len(COEFFICIENTS)))
        full[..., [COEFFICIENTS.index(name) for name in self.names]] = values
        return full


def linear_estimator(
    table: PreparedTable, method: str = METHODS[0], delta0: float = 0.0
) -> LinearEstimator:
    """Make the estimator of a table by one of `METHODS`; the printed one has a fixture angle [rad].

    Raises
    ------
    InputError
        If the method is unknown, or a closed form is asked for some of the coefficients only.
    DesignError
        If a closed form meets a table that is not an 8-position test.
    """
    check_choice(METHODS, method=method)
    if method == METHODS[0]:
        found, solver = table.estimability, table.least_squares
        return LinearEstimator(table, found.kept, solver.map, solver.solve, found.stands_for)
    from accelcal.estimate.closed_form import closed_form_map, closed_form_meaning

    lost = [name for name in COEFFICIENTS if name not in table.estimability.kept]
    if lost:
        raise InputError(
            f"{', '.join(lost)} cannot be told or was not asked for, but method {method!r} has a"
            " fixed set of coefficients; use least-squares"
        )
    matrix = closed_form_map(table, method, delta0)
    given = [bool(np.isfinite(row).all()) for row in matrix]
    names = tuple(name for name, has in zip(COEFFICIENTS, given, strict=True) if has)
    rows = matrix[given]
    return LinearEstimator(table, names, rows, lambda y: y @ rows.T, closed_form_meaning(method))
