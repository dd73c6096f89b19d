"""A linear estimator of one table: the coefficients are a matrix times the readings.

Each closed form works on the mean over the strokes present at each of the nine positions of the
8-position test, so it is such a matrix too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Literal, NamedTuple, get_args

import numpy as np

from accelcal.arguments.options import check_choice
from accelcal.arrays import Array
from accelcal.errors import DesignError, InputError
from accelcal.estimate.estimability import signed
from accelcal.estimate.tables import PreparedTable
from accelcal.geometry import side_of
from accelcal.head_angles import turn_angles
from accelcal.model import COEFFICIENTS

Method = Literal["least-squares", "closed-form", "sign-corrected", "printed"]

METHODS: tuple[Method, ...] = get_args(Method)
"""Names of the estimators; the first is the default."""


class LinearEstimator(NamedTuple):
    """Coefficients of one table as a linear map of its readings."""

    table: PreparedTable  # of n readings
    names: tuple[str, ...]  # the p coefficients that are estimated
    map: Array  # the estimator, shape (p, n), or (R, p, n) of R records with gaps of their own
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
    lost = [name for name in COEFFICIENTS if name not in table.estimability.kept]
    if lost:
        raise InputError(
            f"{', '.join(lost)} cannot be told or was not asked for, but method {method!r} has a"
            " fixed set of coefficients; use least-squares"
        )
    matrix = _closed_form_map(table, method, delta0)
    given = [bool(np.isfinite(row).all()) for row in matrix]
    names = tuple(name for name, has in zip(COEFFICIENTS, given, strict=True) if has)
    rows = matrix[given]
    return LinearEstimator(table, names, rows, lambda y: y @ rows.T, _closed_form_meaning(method))


# -- the three closed forms ------------------------------------------------------------------------


def _closed_form_map(table: PreparedTable, method: str, delta0: float) -> Array:
    """Matrix of a closed form, one of `accelcal.printed.CLOSED_FORMS`, on n readings, shape (6, n).

    A row is NaN for a coefficient that the form does not estimate. The printed form alone has a
    place for the fixture angle [rad].

    Raises
    ------
    DesignError
        If the readings are not at the eight positions 0, 45 .. 315 deg, or `delta0` is not zero
        with a form that is exact only there.

    Notes
    -----
    Equation (6) uses Y1 and Y9. Where the return J = 9 was not read, Y1 stands for it.
    """
    if delta0 != 0.0 and method != "printed":
        raise DesignError(
            f"delta0 is {delta0} rad with method {method!r}; the closed form holds at"
            " delta0 = 0 only, so use least-squares"
        )
    from accelcal.printed import estimator_matrix

    means = _position_means(table.record.angle)
    sign = np.repeat([1.0, side_of(table.mounting)], [4, 2])  # of M and M_ip
    return np.asarray(estimator_matrix(method, delta0) @ means * sign[:, None])


def _closed_form_meaning(method: str) -> dict[str, str]:
    """Say what the estimates of a closed form stand for, where it is not what they are named.

    By coefficient it is the combination that noise-free data at delta0 = 0 return.

    Examples
    --------
    >>> _closed_form_meaning("sign-corrected")
    {'K1': 'K1 + 0.75 K3'}
    """
    from accelcal.printed import documented_bias

    rows = zip(COEFFICIENTS, documented_bias(method), np.eye(6), strict=True)
    return {
        name: _combination(row)
        for name, row, itself in rows
        if np.isfinite(row).all() and np.abs(row - itself).max() > 1e-9
    }


def _combination(shares: Array) -> str:
    terms = [
        signed(float(share), name)
        for name, share in zip(COEFFICIENTS, shares, strict=True)
        if abs(share) > 1e-9
    ]
    return " ".join(terms).removeprefix("+ ")


def _position_means(angle: Array) -> Array:
    """Matrix that takes the mean over the strokes present at each of J = 1..9, shape (9, n)."""
    at = np.abs(angle - turn_angles(8)[:, None]) < 1e-6
    if not at.any(axis=0).all():
        stray = float(angle[~at.any(axis=0)][0])
        raise DesignError(
            f"a reading at {stray:g} deg; the closed forms need the eight positions 0, 45 .. 360"
            " deg, so use least-squares"
        )
    at[8] = at[8] if at[8].any() else at[0]
    at[0] = at[0] if at[0].any() else at[8]
    missing = [str(j + 1) for j in range(9) if not at[j].any()]
    if missing:
        raise DesignError(
            f"no reading at position J = {', '.join(missing)}; the closed forms need all eight"
            " positions, so use least-squares"
        )
    return np.asarray(at / at.sum(axis=1, keepdims=True), dtype=np.float64)
