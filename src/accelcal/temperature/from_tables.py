"""Temperature laws from the coefficients of the tables, by generalised least squares.

Bias, scale factor and misalignment are bilinear in dT = T - T0 and continuous at T0 (section
"Metrological model" of the paper). The tables' coefficients carry their whole covariance into the
laws: a head error is common to all temperatures and leaves the slopes alone, a shift from launch
to launch is new at each and does not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.solver import LeastSquares
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.uncertainty import Component, intervals, propagate
from accelcal.grouping import distinct
from accelcal.model import COEFFICIENTS
from accelcal.results.quantity import Quantity
from accelcal.results.temperature import TemperatureModel
from accelcal.temperature.bilinear import (
    LEAST_RISE,
    bilinear_design,
    local_slopes,
    measured_sides,
    named_laws,
    quantity,
)

__all__ = ["laws_from_tables", "tables_of_one_mounting", "unmeasured"]

Array = NDArray[np.float64]

_NOT_MEASURED = {
    "above": "no level more than 5 degC above T0: the slopes above are not determined",
    "below": "no level more than 5 degC below T0: the slopes below are not determined",
}
_K0, _K1, _M = (COEFFICIENTS.index(name) for name in ("K0", "K1", "M"))


class _Levels(NamedTuple):
    """k0, K1 and delta of R tables in one mounting, with the components of their errors.

    `values` and the components go k0 of all tables, then K1, then delta.
    """

    rise: Array
    values: Array
    components: Mapping[str, Component]

    @property
    def size(self) -> int:
        return self.rise.size


def laws_from_tables(
    tables: Sequence[PreparedTable],
    estimate: JointEstimate,
    reference: float | None,
    temperature_uncertainty: float | None = None,
    unit: str | None = None,
) -> TemperatureModel | None:
    """Fit the temperature laws.

    Parameters
    ----------
    tables : sequence of PreparedTable
        The tables of one record.
    estimate : JointEstimate
        Their coefficients.
    reference : float or None
        T0 [degC].
    temperature_uncertainty : float, optional
        Standard uncertainty of the temperature of a run [degC].
    unit : str, optional
        Output unit.

    Returns
    -------
    TemperatureModel or None
        The laws; None where there is one level only, or a temperature is unknown.

    Notes
    -----
    k0 = k0N + lam1 dT above T0 and lam2 dT below; K1 = K1N (1 + beta1|2 dT); delta = deltaN +
    gam1|2 dT. With the estimates q and their covariance C, the laws are the generalised least
    squares solution (X' C^-1 X)^-1 X' C^-1 q, and each component of error goes through the same
    matrix. An error of temperature acts by the slope of the law.
    """
    chosen = tables_of_one_mounting(tables, estimate)
    if reference is None or len(chosen) < 2:
        return None
    temperature = np.array([tables[i].record.temperature.mean() for i in chosen])
    rise = temperature - reference
    if not np.isfinite(rise).all() or np.ptp(rise) < LEAST_RISE:
        return None
    levels = _levels(estimate, chosen, rise)
    sides = measured_sides(rise)
    design = bilinear_design(rise, sides)
    first = _solution(levels, design)
    if temperature_uncertainty:
        levels = _with_temperature_error(levels, design, first, sides, temperature_uncertainty)
    solved = _solution(levels, design)
    k0, K1, delta = named_laws(
        solved @ levels.values, propagate(levels.components, solved), sides, unit
    )
    return TemperatureModel(
        k0=k0,
        K1=K1,
        delta=delta,
        hysteresis=_hysteresis(levels, [int(tables[i].record.run[0]) for i in chosen]),
        warnings=unmeasured(sides),
    )


def unmeasured(sides: Sequence[str]) -> tuple[str, ...]:
    """Say which slopes are missing, one sentence each."""
    return tuple(text for side, text in _NOT_MEASURED.items() if side not in sides)


def tables_of_one_mounting(tables: Sequence[PreparedTable], estimate: JointEstimate) -> list[int]:
    """Indices of the tables in the mounting that met most levels, where K0, K1 and M are known."""
    by_mounting: dict[str, list[int]] = {}
    for index, table in enumerate(tables):
        if {"K0", "K1", "M"} <= set(estimate.names[index]):
            by_mounting.setdefault(str(table.record.mounting[0]), []).append(index)
    return max(by_mounting.values(), key=len, default=[])


def _levels(estimate: JointEstimate, chosen: Sequence[int], rise: Array) -> _Levels:
    """Quotients by K1 and their error components, by the law of propagation."""
    size = len(chosen)
    jacobian = np.zeros((3 * size, sum(len(names) for names in estimate.names)))
    values = np.zeros(3 * size)
    for row, index in enumerate(chosen):
        k = estimate.coefficients[index]
        place = {
            name: estimate.part(index).start + i for i, name in enumerate(estimate.names[index])
        }
        values[row::size] = k[_K0] / k[_K1], k[_K1], k[_M] / k[_K1]
        for block, name, value in ((0, "K0", k[_K0]), (2, "M", k[_M])):
            jacobian[block * size + row, place[name]] = 1.0 / k[_K1]
            jacobian[block * size + row, place["K1"]] = -value / k[_K1] ** 2
        jacobian[size + row, place["K1"]] = 1.0
    return _Levels(rise, values, propagate(estimate.components, jacobian))


def _solution(levels: _Levels, design: Array) -> Array:
    """Generalised least-squares map of all three laws, shape (3 p, 3 R)."""
    whole = np.kron(np.eye(3), design)
    covariance = sum(part.covariance for part in levels.components.values())
    if not np.isfinite(covariance).all() or not np.diagonal(covariance).all():
        return LeastSquares(whole).map
    # in units of the standard uncertainties, so that g, mA and rad may stand side by side
    sigma = np.sqrt(np.diagonal(covariance))
    root = np.linalg.cholesky(covariance / np.outer(sigma, sigma) + 1e-12 * np.eye(sigma.size))
    whitened = np.linalg.solve(root, whole / sigma[:, None])
    return np.asarray(LeastSquares(whitened).map @ np.linalg.inv(root) / sigma)


def _with_temperature_error(
    levels: _Levels, design: Array, solution: Array, sides: Sequence[str], uncertainty: float
) -> _Levels:
    """Add what an error of each temperature does through the slopes of the laws."""
    laws = (solution @ levels.values).reshape(3, design.shape[1])
    local = laws @ local_slopes(levels.rise, sides).T
    acting = uncertainty * np.concatenate([np.diag(row) for row in local])
    component = Component(acting @ acting.T, np.full(acting.shape[0], np.inf))
    return _Levels(levels.rise, levels.values, {**levels.components, "temperature": component})


def _hysteresis(levels: _Levels, runs: Sequence[int]) -> Quantity | None:
    """Half the difference of the bias between levels reached by heating and by cooling."""
    order = np.argsort(runs, kind="stable")
    reached = np.zeros(levels.size)
    reached[order[1:]] = np.sign(np.diff(levels.rise[order]))
    rows = []
    for level in distinct(np.round(levels.rise)):
        here = np.abs(levels.rise - level) < 1.0
        heated, cooled = here & (reached > 0), here & (reached < 0)
        if heated.any() and cooled.any():
            rows.append(0.5 * (heated / heated.sum() - cooled / cooled.sum()))
    if not rows:
        return None
    mean = np.concatenate([np.mean(rows, axis=0), np.zeros(2 * levels.size)])
    (interval,) = intervals(propagate(levels.components, mean[None, :]))
    return quantity(float(mean @ levels.values), interval, "g")
