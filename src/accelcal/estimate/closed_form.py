"""The three closed forms as estimators of a whole table.

Each works on the mean over the strokes present at each of the nine positions of the 8-position
test, so each is a matrix that maps the readings of a table to its coefficients.
"""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array
from accelcal.errors import DesignError
from accelcal.estimate.estimability import signed
from accelcal.estimate.tables import PreparedTable
from accelcal.geometry import side_of
from accelcal.head_angles import turn_angles
from accelcal.model import COEFFICIENTS
from accelcal.printed import documented_bias, estimator_matrix


def closed_form_map(table: PreparedTable, method: str, delta0: float) -> Array:
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
    means = _position_means(table.record.angle)
    sign = np.repeat([1.0, side_of(table.mounting)], [4, 2])  # of M and M_ip
    return np.asarray(estimator_matrix(method, delta0) @ means * sign[:, None])


def closed_form_meaning(method: str) -> dict[str, str]:
    """Say what the estimates of a closed form stand for, where it is not what they are named.

    By coefficient it is the combination that noise-free data at delta0 = 0 return.

    Examples
    --------
    >>> closed_form_meaning("sign-corrected")
    {'K1': 'K1 + 0.75 K3'}
    """
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
