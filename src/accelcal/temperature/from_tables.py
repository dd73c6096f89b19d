"""Temperature laws from the coefficients of the tables, by generalised least squares.

Bias, scale factor and misalignment are bilinear in dT = T - T0 and continuous at T0 (section
"Metrological model" of the paper). The tables' coefficients carry their whole covariance into the
laws: a head error is common to all temperatures and leaves the slopes alone, a shift from launch
to launch is new at each and does not.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.solver import LeastSquares
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.uncertainty import Component, propagate
from accelcal.model import COEFFICIENTS, ERROR_TERMS
from accelcal.probability import f_survival
from accelcal.results.temperature import BilinearLaw, TemperatureModel
from accelcal.temperature.bilinear import (
    LEAST_RISE,
    bilinear_design,
    local_slopes,
    measured_sides,
    named_model,
)
from accelcal.temperature.hysteresis import Branches, branches, confounded, mean_hysteresis
from accelcal.temperature.run_temperatures import run_temperature_uncertainty

__all__ = ["laws_from_tables", "tables_of_one_mounting"]

Array = NDArray[np.float64]

_NOT_MEASURED = {
    "above": "no level more than 5 degC above T0: the slopes above are not determined",
    "below": "no level more than 5 degC below T0: the slopes below are not determined",
}
_NO_LEVEL_NEAR_T0 = (
    "one level on each side of T0 and none at it: the laws are not determined; measure at T0, or"
    " give T0 at a measured level"
)
_SIGNIFICANT = 0.001
_ROUNDING = 1e-9  # g, relative or rad: below it a misfit is of no interest
_K0, _K1, _M = (COEFFICIENTS.index(name) for name in ("K0", "K1", "M"))
_WITHOUT_LAW = ("K2", "K3", "M_ip")


class _Levels(NamedTuple):
    """k0, K1 and delta of R tables in one mounting, with the components of their errors.

    `values` and the components go k0 of all tables, then K1, then delta; the components then have
    `others`, which follow no law, of the table nearest to T0.
    """

    rise: Array
    values: Array
    components: Mapping[str, Component]
    others: tuple[str, ...]


def laws_from_tables(
    tables: Sequence[PreparedTable],
    estimate: JointEstimate,
    reference: float | None,
    temperature_uncertainty: float | None = None,
    unit: str | None = None,
    unfelt: Array | None = None,
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
    unfelt : ndarray, shape (tables,), optional
        Share of the recorded scatter of the temperatures that was not felt; all by default.

    Returns
    -------
    TemperatureModel or None
        The laws; None where there is one level only, or a temperature is unknown.

    Notes
    -----
    k0 = k0N + lam1 dT above T0 and lam2 dT below; K1 = K1N (1 + beta1|2 dT); delta = deltaN +
    gam1|2 dT. With the estimates q and their covariance C, the laws are the generalised least
    squares solution (X' C^-1 X)^-1 X' C^-1 q, and each component of error goes through the same
    matrix. An error of temperature acts by the slope of the law. Where a level was reached by
    heating and by cooling, k0 has the further term +h after heating and -h after cooling, with an h
    for each such level, so that the laws go through the middle of both branches and h_T leans on
    no slope. A run on one branch only, or on none that is known, has the uncertainty h.
    """
    chosen = tables_of_one_mounting(tables, estimate)
    if reference is None or len(chosen) < 2:
        return None
    temperature = np.array([tables[i].record.mean_temperature for i in chosen])
    rise = temperature - reference
    if not np.isfinite(rise).all() or np.ptp(rise) < LEAST_RISE:
        return None
    sides = measured_sides(rise)
    if np.linalg.matrix_rank(bilinear_design(rise, sides)) < 1 + len(sides):
        nothing = BilinearLaw(None, None, None)
        return TemperatureModel(nothing, nothing, nothing, warnings=(_NO_LEVEL_NEAR_T0,))
    own = [tables[i] for i in chosen]
    share = 1.0 if unfelt is None else unfelt[chosen]
    uncertain = run_temperature_uncertainty(own, temperature_uncertainty, share)
    model = _fitted(_levels(estimate, chosen, rise), sides, branches(own), uncertain, unit)
    said = (*confounded(estimate, model.hysteresis), *_far_reference(reference, temperature))
    return replace(model, warnings=(*model.warnings, *said))


def _fitted(
    levels: _Levels,
    sides: Sequence[str],
    loop: Branches,
    uncertain: tuple[Array, Array],
    unit: str | None,
) -> TemperatureModel:
    count, others = 3 * (1 + len(sides)), len(levels.others)
    if uncertain[0].any() or loop.loose.size:
        first = _solution(levels, sides, loop) @ levels.values
        levels = _with_temperature_error(levels, first, sides, *uncertain)
        levels = _with_open_loop(levels, loop.off_the_middle(first[count:]))
    solved = _solution(levels, sides, loop)
    values = solved @ levels.values
    whole = np.zeros((solved.shape[0] + others, solved.shape[1] + others))
    whole[: solved.shape[0], : solved.shape[1]] = solved
    whole[solved.shape[0] :, solved.shape[1] :] = np.eye(others)
    half_widths = slice(count, solved.shape[0])
    hysteresis, said = mean_hysteresis(
        values[half_widths],
        {
            name: part.part(half_widths)
            for name, part in propagate(levels.components, whole).items()
        },
        loop.temperature,
    )
    return named_model(
        values[:count],
        propagate(levels.components, np.delete(whole, half_widths, axis=0)),
        sides,
        unit,
        others=levels.others,
        hysteresis=hysteresis,
        warnings=(*_unmeasured(sides), *_misfits(levels, values, sides, loop), *said),
    )


def _misfits(
    levels: _Levels, parameters: Array, sides: Sequence[str], loop: Branches
) -> Iterator[str]:
    """Say which quantity does not follow its law, by chi-squared of what is left of it."""
    law = bilinear_design(levels.rise, sides)
    size, count = law.shape
    covariance = np.asarray(sum(part.covariance for part in levels.components.values()))
    for i, name in enumerate(("bias", "scale factor", "misalignment")):
        own = slice(i * size, (i + 1) * size)
        left = levels.values[own] - law @ parameters[i * count : (i + 1) * count]
        dof = size - count
        if i == 0:
            left = left - loop.paired @ parameters[3 * count :]
            dof -= loop.paired.shape[1]
        if dof < 1 or not np.isfinite(covariance).all() or np.abs(left).max() < _ROUNDING:
            continue
        squares = float(left @ np.linalg.pinv(covariance[own, own], hermitian=True) @ left)
        if f_survival(squares / dof, float(dof), np.inf) < _SIGNIFICANT:
            yield (
                f"the {name} does not follow its bilinear law: a curvature, another break, or an"
                " undeclared shift from run to run; its slopes are less certain than U says"
            )


def _far_reference(reference: float, temperature: Array) -> Iterator[str]:
    """Say that the values at T0 are extrapolated, where T0 is far outside the levels."""
    low, high = temperature.min(), temperature.max()
    outside = max(low - reference, reference - high)
    if outside > LEAST_RISE:
        yield (
            f"T0 = {reference:g} degC lies {outside:g} degC outside the levels, {low:g} to"
            f" {high:g} degC: the values at T0 are extrapolated, and U holds nothing of a curvature"
        )


def _unmeasured(sides: Sequence[str]) -> tuple[str, ...]:
    """Say which slopes are missing, one sentence each."""
    return tuple(text for side, text in _NOT_MEASURED.items() if side not in sides)


def tables_of_one_mounting(tables: Sequence[PreparedTable], estimate: JointEstimate) -> list[int]:
    """Choose tables that mean the same by K0, K1 and M: one mounting, the same things absorbed.

    Of several such sets the one with most tables.
    """
    alike: dict[tuple[object, ...], list[int]] = {}
    for index, table in enumerate(tables):
        if {"K0", "K1", "M"} <= set(estimate.names[index]):
            meaning = (estimate.stands_for[index].get(name) for name in ("K0", "K1", "M"))
            alike.setdefault((str(table.record.mounting[0]), *meaning), []).append(index)
    return max(alike.values(), key=len, default=[])


def _levels(estimate: JointEstimate, chosen: Sequence[int], rise: Array) -> _Levels:
    """Quotients by K1 and their error components, by the law of propagation."""
    size = len(chosen)
    nearest = chosen[int(np.abs(rise).argmin())]
    others = [name for name in _WITHOUT_LAW if name in estimate.names[nearest]]
    quotients = [_quotient(estimate, i, "K0") for i in chosen]
    quotients += [np.zeros_like(quotients[0]) for _ in chosen]  # the scale factors themselves
    quotients += [_quotient(estimate, i, "M") for i in chosen]
    quotients += [_quotient(estimate, nearest, name) for name in others]
    for row, i in enumerate(chosen):
        quotients[size + row][_place(estimate, i, "K1")] = 1.0
    k = np.array([estimate.coefficients[i] for i in chosen])
    values = np.concatenate([k[:, _K0] / k[:, _K1], k[:, _K1], k[:, _M] / k[:, _K1]])
    components = propagate({**estimate.components, **estimate.alike}, np.stack(quotients))
    return _Levels(rise, values, components, tuple(ERROR_TERMS[name] for name in others))


def _place(estimate: JointEstimate, table: int, name: str) -> int:
    start: int = estimate.part(table).start
    return start + estimate.names[table].index(name)


def _quotient(estimate: JointEstimate, table: int, name: str) -> Array:
    """Derivative of a coefficient over K1 of a table by all coefficients of all tables."""
    k = estimate.coefficients[table]
    row = np.zeros(sum(len(names) for names in estimate.names))
    row[_place(estimate, table, name)] = 1.0 / k[_K1]
    row[_place(estimate, table, "K1")] = -k[COEFFICIENTS.index(name)] / k[_K1] ** 2
    return row


def _solution(levels: _Levels, sides: Sequence[str], loop: Branches) -> Array:
    """Generalised least-squares map of the laws of k0, K1 and delta and, last, of the half widths.

    Each law is solved by itself: the correlations between them are weak, and their uncertainties
    may differ by many powers of ten. Propagation through the map keeps them all.
    """
    law = bilinear_design(levels.rise, sides)
    bias = np.column_stack([law, loop.paired])
    covariance = sum(part.covariance for part in levels.components.values())
    size, count = levels.rise.size, law.shape[1]
    solution = np.zeros((3 * count + bias.shape[1] - count, 3 * size))
    for i, design in enumerate((bias, law, law)):
        own = slice(i * size, (i + 1) * size)
        found = _generalised(design, np.asarray(covariance)[own, own])
        solution[i * count : (i + 1) * count, own] = found[:count]
        solution[3 * count : 3 * count + found.shape[0] - count, own] = found[count:]
    return solution


def _generalised(design: Array, covariance: Array) -> Array:
    """Generalised least-squares map, shape (parameters, R); plain where the weights are unknown."""
    sigma = np.sqrt(np.diagonal(covariance))
    if not (np.isfinite(covariance).all() and sigma.all()):
        return LeastSquares(design).map
    root = np.linalg.cholesky(covariance / np.outer(sigma, sigma) + 1e-12 * np.eye(sigma.size))
    whitened = np.linalg.solve(root, design / sigma[:, None])
    return np.asarray(LeastSquares(whitened).map @ np.linalg.inv(root) / sigma)


def _with_temperature_error(
    levels: _Levels, parameters: Array, sides: Sequence[str], uncertainty: Array, dof: Array
) -> _Levels:
    """Add what an error of each temperature does through the slopes of the laws."""
    laws = parameters[: 3 * (1 + len(sides))].reshape(3, -1)
    local = laws @ local_slopes(levels.rise, sides).T
    acting = np.concatenate([np.diag(row) for row in local]) * uncertainty
    aside = len(levels.others)
    component = Component(
        np.pad(acting @ acting.T, (0, aside)),
        np.pad(np.tile(dof, 3), (0, aside), constant_values=np.inf),
    )
    return levels._replace(components={**levels.components, "temperature": component})


def _with_open_loop(levels: _Levels, off_the_middle: Array) -> _Levels:
    """Add that the bias of some runs lies off the middle of the loop by an unknown amount."""
    behind = levels.values.size + len(levels.others) - levels.rise.size
    acting = np.pad(off_the_middle, ((0, behind), (0, 0)))
    component = Component(acting @ acting.T, np.full(acting.shape[0], np.inf))
    return levels._replace(components={**levels.components, "hysteresis": component})
