"""Temperature laws from the coefficients of the tables, by generalised least squares.

Bias, scale factor and misalignment are bilinear in dT = T - T0 and continuous at T0 (section
"Metrological model" of the paper). The tables' coefficients carry their whole covariance into the
laws: a head error is common to all temperatures and leaves the slopes alone, a shift from launch
to launch is new at each and does not.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.joint import JointEstimate, JointStack
from accelcal.estimate.stack_of_one import stack_of_one
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.uncertainty import Component, propagate
from accelcal.probability import f_survival
from accelcal.results.temperature import BilinearLaw, TemperatureModel
from accelcal.temperature.bilinear import (
    LEAST_RISE,
    LawStack,
    bilinear_design,
    local_slopes,
    measured_sides,
    misfit,
    stacked_laws,
)
from accelcal.temperature.hysteresis import (
    Branches,
    Hysteresis,
    branches_of,
    confounded,
    mean_hysteresis,
)
from accelcal.temperature.levels import (
    Levels,
    LevelStack,
    alike,
    level_stack,
    levels_of,
)
from accelcal.temperature.run_temperatures import run_temperature_uncertainty

__all__ = ["LawsOfRecords", "laws_from_tables", "laws_of_records", "tables_of_one_mounting"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Places = NDArray[np.intp]

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
_QUANTITIES = ("bias", "scale factor", "misalignment")
_PARTS = [f"{law} {part}" for law in ("k0", "K1", "delta") for part in ("at_T0", *_NOT_MEASURED)]
_NAMES = (*_PARTS, "hysteresis")
_WITHOUT, _UNDETERMINED = -1, -2  # in place of a group


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
    if len(chosen) < 2:
        return None
    share = 1.0 if unfelt is None else unfelt
    uncertain = run_temperature_uncertainty(tables, temperature_uncertainty, share)
    levels = np.array([[table.record.mean_temperature for table in tables]])
    T0 = np.array([np.nan if reference is None else reference])
    of_levels = uncertain[0][None], uncertain[1][None]
    stack = level_stack(tables, stack_of_one(estimate), chosen, levels, of_levels, T0)
    return laws_of_records(stack._replace(unit=[unit])).model(0)


class _Group(NamedTuple):
    """Laws of records alike."""

    stack: LevelStack
    laws: LawStack
    hysteresis: Hysteresis
    off: Mask  # whether bias, scale factor and misalignment follow no law, shape (R, 3)

    def warnings(self, index: int) -> tuple[str, ...]:
        """Say what is missing in the laws of one record, and why."""
        stack, loop = self.stack, self.hysteresis.half_widths.shape[1] > 0
        return (
            *_unmeasured(self.laws.sides),
            *_misfits(self.off[index]),
            *self.hysteresis.said(index),
            *(filter(None, [confounded(stack.shift_source[index])]) if loop else ()),
            *_far_reference(float(stack.reference[index]), stack.temperature[index]),
        )

    def model(self, index: int) -> TemperatureModel:
        """Laws of one record."""
        hysteresis, warnings = self.hysteresis.quantity(index), self.warnings(index)
        unit = self.stack.unit[index]
        return self.laws.model(index, unit, hysteresis=hysteresis, warnings=warnings)


class LawsOfRecords(NamedTuple):
    """Temperature laws of R records.

    Attributes
    ----------
    names : tuple of str
        ``"k0 at_T0"``, ``"k0 above"`` ... ``"delta below"``, ``"hysteresis"``.
    value, standard, expanded, dof : ndarray, shape (R, 10)
        Each with its standard and expanded uncertainty and degrees of freedom; NaN where not
        determined, or unknown. Units are those of `TemperatureModel`.
    groups : tuple
        Records alike, fitted together.
    group, member : ndarray of int, shape (R,)
        Group of each record and its place there; -1 without laws, -2 where the levels determine
        none.
    """

    names: tuple[str, ...]
    value: Array
    standard: Array
    expanded: Array
    dof: Array
    groups: tuple[_Group, ...]
    group: Places
    member: Places

    @property
    def has_laws(self) -> Mask:
        """Whether a record has laws, shape (R,), be it that its levels determine nothing."""
        return np.asarray(self.group != _WITHOUT)

    def warnings(self, index: int) -> tuple[str, ...]:
        """Say what is missing in the laws of one record, and why."""
        group = int(self.group[index])
        if group < 0:
            return (_NO_LEVEL_NEAR_T0,) if group == _UNDETERMINED else ()
        return self.groups[group].warnings(int(self.member[index]))

    def model(self, index: int) -> TemperatureModel | None:
        """Laws of one record; None where there is one level only, or a temperature is unknown."""
        group = int(self.group[index])
        if group == _UNDETERMINED:
            nothing = BilinearLaw(None, None, None)
            return TemperatureModel(nothing, nothing, nothing, warnings=(_NO_LEVEL_NEAR_T0,))
        return None if group < 0 else self.groups[group].model(int(self.member[index]))


def laws_of_records(stack: LevelStack) -> LawsOfRecords:
    """Fit the temperature laws of many records of one plan.

    Parameters
    ----------
    stack : LevelStack
        Their tables.

    Returns
    -------
    LawsOfRecords
        The laws, see `laws_from_tables`. Records alike are solved together.
    """
    records = len(stack.reference)
    value, standard, expanded, dof = (np.full((records, len(_NAMES)), np.nan) for _ in range(4))
    group, member = np.full(records, _WITHOUT), np.zeros(records, dtype=np.intp)
    groups: list[_Group] = []
    for rows in alike(stack):
        sides = measured_sides(stack.rise[rows[0]])
        rank = np.linalg.matrix_rank(bilinear_design(stack.rise[rows], sides))
        group[rows] = _UNDETERMINED
        rows = rows[rank == 1 + len(sides)]
        if not rows.size:
            continue
        found = _fitted(stack.of_records(rows), sides)
        group[rows], member[rows] = len(groups), np.arange(rows.size)
        groups.append(found)
        at = np.ix_(rows, [_NAMES.index(name) for name in (*found.laws.names, "hysteresis")])
        value[at] = np.column_stack([found.laws.values, found.hysteresis.mean])
        for whole, name in ((standard, "standard"), (expanded, "expanded"), (dof, "dof")):
            parts = [getattr(of, name) for of in (found.laws.intervals, found.hysteresis.intervals)]
            whole[at] = np.column_stack(parts)
    return LawsOfRecords(_NAMES, value, standard, expanded, dof, tuple(groups), group, member)


def _fitted(stack: LevelStack, sides: Sequence[str]) -> _Group:
    levels, loop = levels_of(stack), branches_of(stack.temperature[0], stack.order)
    count, others = 3 * (1 + len(sides)), len(levels.others)
    if stack.uncertainty.any() or loop.loose.size:
        first = _applied(_solution(levels, sides, loop), levels.values)
        levels = _with_temperature_error(levels, first, sides, stack.uncertainty, stack.dof)
        levels = _with_open_loop(levels, loop.off_the_middle(first[:, count:]))
    solved = _solution(levels, sides, loop)
    values = _applied(solved, levels.values)
    size = solved.shape[1]
    whole = np.zeros((len(values), size + others, solved.shape[2] + others))
    whole[:, :size, : solved.shape[2]] = solved
    whole[:, size:, solved.shape[2] :] = np.eye(others)
    components = propagate(levels.components, whole)
    half_widths, kept = slice(count, size), np.delete(np.arange(size + others), slice(count, size))
    return _Group(
        stack=stack,
        laws=stacked_laws(values[:, :count], _some(components, kept), sides, levels.others),
        hysteresis=mean_hysteresis(
            values[:, half_widths],
            {name: part.part(half_widths) for name, part in components.items()},
            stack.temperature @ loop.mean,
        ),
        off=_off_the_law(levels, values, sides, loop),
    )


def _applied(matrix: Array, values: Array) -> Array:
    """Each record's matrix times its values, shape (R, m)."""
    return np.asarray((matrix @ values[..., None])[..., 0])


def _some(components: Mapping[str, Component], kept: Places) -> dict[str, Component]:
    """Components of some of the estimates."""
    return {
        name: Component(part.covariance[:, kept[:, None], kept], part.dof[:, kept])
        for name, part in components.items()
    }


def _off_the_law(levels: Levels, parameters: Array, sides: Sequence[str], loop: Branches) -> Mask:
    """Which quantities do not follow their law, by chi-squared of what is left, shape (R, 3)."""
    law, covariance = bilinear_design(levels.rise, sides), levels.covariance
    records, size, count = law.shape
    off = np.zeros((records, len(_QUANTITIES)), dtype=np.bool_)
    known = np.isfinite(covariance).all(axis=(1, 2))
    for i in range(len(_QUANTITIES)):
        own = slice(i * size, (i + 1) * size)
        left = levels.values[:, own] - _applied(law, parameters[:, i * count : (i + 1) * count])
        dof = size - count
        if i == 0:
            left = left - parameters[:, 3 * count :] @ loop.paired.T
            dof -= loop.paired.shape[1]
        if dof >= 1:
            p = f_survival(misfit(left, covariance[:, own, own]) / dof, float(dof), np.inf)
            off[:, i] = known & (np.abs(left).max(axis=1) >= _ROUNDING) & (p < _SIGNIFICANT)
    return off


def _misfits(off: Mask) -> Iterator[str]:
    """Say which quantity of a record does not follow its law."""
    for name, is_off in zip(_QUANTITIES, off.tolist(), strict=True):
        if is_off:
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


def tables_of_one_mounting(
    tables: Sequence[PreparedTable], estimate: JointEstimate | JointStack, axis: str = ""
) -> list[int]:
    """Choose tables that mean the same by K0, K1 and M: one mounting, the same things absorbed.

    Of several such sets the one with most tables; with `axis`, only of those with that axis,
    ``"o"`` or ``"p"``, along the shaft.
    """
    found: dict[tuple[object, ...], list[int]] = {}
    for index, table in enumerate(tables):
        mounting = str(table.record.mounting[0])
        if {"K0", "K1", "M"} <= set(estimate.names[index]) and mounting.startswith(axis):
            meaning = (estimate.stands_for[index].get(name) for name in ("K0", "K1", "M"))
            found.setdefault((mounting, *meaning), []).append(index)
    return max(found.values(), key=len, default=[])


def _solution(levels: Levels, sides: Sequence[str], loop: Branches) -> Array:
    """Generalised least-squares map of the laws of k0, K1 and delta and, last, of the half widths.

    Each law is solved by itself: the correlations between them are weak, and their uncertainties
    may differ by many powers of ten. Propagation through the map keeps them all.
    """
    law, covariance = bilinear_design(levels.rise, sides), levels.covariance
    records, size, count = law.shape
    pairs = np.broadcast_to(loop.paired, (records, *loop.paired.shape))
    solution = np.zeros((records, 3 * count + loop.paired.shape[1], 3 * size))
    for i, design in enumerate((np.concatenate([law, pairs], axis=2), law, law)):
        own = slice(i * size, (i + 1) * size)
        found = _generalised(design, covariance[:, own, own])
        solution[:, i * count : (i + 1) * count, own] = found[:, :count]
        solution[:, 3 * count : 3 * count + found.shape[1] - count, own] = found[:, count:]
    return solution


def _generalised(design: Array, covariance: Array) -> Array:
    """Generalised least-squares maps, (R, parameters, n); plain where the weights are unknown."""
    variance = np.einsum("...nn->...n", covariance)
    known = np.isfinite(covariance).all(axis=(1, 2)) & (variance > 0.0).all(axis=1)
    size = variance.shape[1]
    sigma = np.sqrt(np.where(known[:, None], variance, 1.0))
    among = covariance / (sigma[:, :, None] * sigma[:, None])
    root = np.linalg.cholesky(np.where(known[:, None, None], among, 0.0) + _diagonal(known, size))
    whitened = np.linalg.solve(root, design / sigma[..., None])
    norms = np.sqrt((whitened**2).sum(axis=1, keepdims=True))  # slopes are far from the values
    solved = np.linalg.pinv(whitened / norms) / norms.swapaxes(1, 2)
    return np.asarray(solved @ np.linalg.inv(root) / sigma[:, None])


def _diagonal(known: Mask, size: int) -> Array:
    """What keeps a matrix of correlations definite; all of it where they are unknown."""
    return np.where(known, 1e-12, 1.0)[:, None, None] * np.eye(size)


def _with_temperature_error(
    levels: Levels, parameters: Array, sides: Sequence[str], uncertainty: Array, dof: Array
) -> Levels:
    """Add what an error of each temperature does through the slopes of the laws."""
    size, count = levels.rise.shape[1], 1 + len(sides)
    laws = parameters[:, : 3 * count].reshape(-1, 3, count)
    local = laws @ local_slopes(levels.rise, sides).swapaxes(1, 2)
    acting = local[..., None] * np.eye(size) * uncertainty[:, None, None]
    acting = acting.reshape(-1, 3 * size, size)
    aside = len(levels.others)
    component = Component(
        np.pad(acting @ acting.swapaxes(1, 2), ((0, 0), (0, aside), (0, aside))),
        np.pad(np.tile(dof, 3), ((0, 0), (0, aside)), constant_values=np.inf),
    )
    return levels._replace(components={**levels.components, "temperature": component})


def _with_open_loop(levels: Levels, off_the_middle: Array) -> Levels:
    """Add that the bias of some runs lies off the middle of the loop by an unknown amount."""
    behind = levels.values.shape[1] + len(levels.others) - levels.rise.shape[1]
    acting = np.pad(off_the_middle, ((0, 0), (0, behind), (0, 0)))
    component = Component(acting @ acting.swapaxes(1, 2), np.full(acting.shape[:2], np.inf))
    return levels._replace(components={**levels.components, "hysteresis": component})
