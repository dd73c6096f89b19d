"""Temperature laws from the coefficients of the tables, by generalised least squares.

Bias, scale factor and misalignment are bilinear in dT = T - T0 and continuous at T0 (section
"Metrological model" of the paper). The tables' coefficients carry their whole covariance into the
laws: a head error is common to all temperatures and leaves the slopes alone, a shift from launch
to launch is new at each and does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask, Places
from accelcal.estimate.uncertainty import Component, Intervals, combined, propagate
from accelcal.model import LAWS
from accelcal.numerics.probability import f_survival
from accelcal.reference import bilinear_design, measured_sides
from accelcal.results.covariance import BY_OTHERS, EFFECTS
from accelcal.results.temperature import TemperatureLaw, TemperatureModel
from accelcal.sentences import Told, of_each
from accelcal.temperature.bilinear import (
    LawStack,
    chance_of_misfit,
    contrasts_of,
    law_maps,
    local_slopes,
    misfit,
    relative_slopes,
    share_of_law,
    taken_from_the_other_side,
    tell_a_law,
    with_columns,
)
from accelcal.temperature.levels import Levels, LevelStack, alike, joint_components, levels_of
from accelcal.temperature.weaknesses import (
    NO_LEVEL_NEAR_T0,
    Branches,
    Hysteresis,
    branches_of,
    law_sentences,
    mean_hysteresis,
)

_SIGNIFICANT = 0.001  # chance below which levels off their law are told
_OF_EFFECTS = (EFFECTS, *BY_OTHERS)  # components of error that come from the effects of a model
_ROUNDING = 1e-9  # g, relative or rad: below it a misfit is of no interest
_PARTS = [f"{law} {part}" for law in LAWS for part in ("at_T0", "above", "below")]
_NAMES = (*_PARTS, "hysteresis")
_WITHOUT, _UNDETERMINED = -1, -2  # for the group of a record that has no laws, or unknown ones


class _Group(NamedTuple):
    """Laws of records alike; `maps`, shape (R, 3, m, n), take the tables to the parameters."""

    stack: LevelStack
    levels: Levels
    maps: Array
    laws: LawStack
    hysteresis: Hysteresis
    warnings: Told

    @property
    def names(self) -> list[str]:
        """Names of the `numbers`."""
        return [*self.laws.names, "hysteresis"]

    @property
    def numbers(self) -> Array:
        """Values, standard and expanded uncertainties, and degrees of freedom, (4, R, names)."""
        laws, loop = self.laws, self.hysteresis
        parts = ("standard", "expanded", "dof")
        of_laws = [laws.values, *(getattr(laws.intervals, part) for part in parts)]
        of_loop = [loop.mean[:, None], *(getattr(loop.intervals, part) for part in parts)]
        return np.concatenate([np.stack(of_laws), np.stack(of_loop)], axis=2)

    def model(self, index: int) -> TemperatureModel:
        """Laws of one record."""
        components, others = self._components(index)
        return self.laws.model(
            index,
            self.stack.unit,
            components,
            others=others,
            hysteresis=self.hysteresis.quantity(index),
            warnings=self.warnings[index],
        )

    def _components(self, index: int) -> tuple[dict[str, Component], tuple[str, ...]]:
        """Components of the laws of one record and of what follows no law."""
        of_laws = np.eye(3)[:, None, :, None] * self.maps[index][:, :, None]
        laws = of_laws.reshape(self.laws.values.shape[1], -1)
        return joint_components(self.stack, self.levels, index, laws)


class LawsOfRecords(NamedTuple):
    """Temperature laws of R records."""

    names: tuple[str, ...]  # ``"k0 at_T0"``, ``"k0 above"`` ... ``"delta below"``, ``"hysteresis"``
    # shape (R, 10): each with its standard and expanded uncertainty and degrees of freedom; NaN
    # where not determined, or unknown. Units are those of `TemperatureModel`
    value: Array
    standard: Array
    expanded: Array
    dof: Array
    warnings: Sequence[tuple[str, ...]]  # what is missing in the laws of each record, and why
    groups: tuple[_Group, ...]  # records alike, fitted together
    # shape (R,): group of each record and its place there; -1 without laws, -2 where the levels
    # determine none
    group: Places
    member: Places

    @property
    def has_laws(self) -> Mask:
        """Whether a record has laws, shape (R,), be it that its levels determine nothing."""
        return np.asarray(self.group != _WITHOUT)

    def model(self, index: int) -> TemperatureModel | None:
        """Laws of one record; None where there is one level only, or a temperature is unknown."""
        group = int(self.group[index])
        if group == _UNDETERMINED:
            nothing = TemperatureLaw(None, None, None)
            return TemperatureModel(nothing, nothing, nothing, warnings=self.warnings[index])
        return None if group < 0 else self.groups[group].model(int(self.member[index]))

    def told_by(self, models: Sequence[TemperatureModel | None]) -> LawsOfRecords:
        """Take the numbers and warnings of other laws of the same records."""
        numbers = np.full((4, *self.value.shape), np.nan)
        for row, model in enumerate(models):
            for name, found in model.quantities() if model else ():
                parts = found.value, found.standard_uncertainty, found.expanded_uncertainty
                numbers[:, row, self.names.index(name)] = *parts, found.dof  # None is NaN
        value, standard, expanded, dof = numbers
        warnings = [model.warnings if model else () for model in models]
        return self._replace(
            value=value, standard=standard, expanded=expanded, dof=dof, warnings=warnings
        )


def laws_of_records(stack: LevelStack) -> LawsOfRecords:
    """Fit the temperature laws of many records of one plan, records alike together.

    There are none where there is one level only, or a temperature is unknown.

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
    records = len(stack.reference)
    numbers = np.full((4, records, len(_NAMES)), np.nan)
    group, member = np.full(records, _WITHOUT), np.zeros(records, dtype=np.intp)
    warnings: list[tuple[str, ...]] = [()] * records
    groups: list[_Group] = []
    for rows in alike(stack):
        sides = measured_sides(stack.rise[rows[0]])
        told = tell_a_law(stack.rise[rows], sides)
        for row in rows[~told].tolist():
            group[row], warnings[row] = _UNDETERMINED, (NO_LEVEL_NEAR_T0,)
        if not told.any():
            continue
        rows = rows[told]
        found = _fitted(stack.of_records(rows), sides)
        group[rows], member[rows] = len(groups), np.arange(rows.size)
        groups.append(found)
        numbers[:, rows[:, None], [_NAMES.index(name) for name in found.names]] = found.numbers
        for row, said in zip(rows.tolist(), found.warnings.cells(), strict=True):
            warnings[row] = said
    value, standard, expanded, dof = numbers
    return LawsOfRecords(
        _NAMES, value, standard, expanded, dof, warnings, tuple(groups), group, member
    )


def _fitted(stack: LevelStack, sides: Sequence[str]) -> _Group:
    loop, count = branches_of(stack.temperature[0], stack.order), 1 + len(sides)
    rise = stack.rise
    rise = rise[:1] if (rise == rise[:1]).all() else rise  # one design for all records
    design, levels = bilinear_design(rise, sides), levels_of(stack)
    maps = law_maps(design, loop.paired, _weighing(levels, design))
    uncertain = np.hypot(stack.uncertainty, taken_from_the_other_side(stack.rise, sides))
    if uncertain.any() or loop.loose.size:
        first = _applied(maps, levels.values)
        slopes = _applied(local_slopes(rise, sides)[:, None], first[..., :count])
        by_heat, by_loop = slopes * uncertain[:, None], first[:, 0, count:]
        levels = levels.at_uncertain_levels(by_heat, stack.dof, loop.off_the_middle(by_loop))
        maps = law_maps(design, loop.acting, _weighing(levels, design))
    fitted = _applied(maps, levels.values)
    hysteresis = _hysteresis(levels, fitted[:, 0, count:], maps[:, 0, count:], stack, loop)
    off = _off_the_law(levels, fitted, design, loop)
    said = law_sentences(
        *(sides, off, hysteresis, stack.shift_source),
        *(stack.reference, stack.temperature, levels.share_of_heat),
    )
    laws, maps = _laws(levels, fitted[..., :count], maps[:, :, :count], sides)
    return _Group(stack, levels, maps, laws, hysteresis, of_each(said, len(off)))


def _weighing(levels: Levels, design: Array) -> Array:
    """Covariance by which the levels are weighed, shape (R, 3, n, n), see `share_of_law`.

    Errors of the effects, and what else these may be, weigh nothing: the laws are those beside the
    effects as named, of which the same readings tell the sizes.
    """
    parts = (part.covariance for name, part in levels.components.items() if name not in _OF_EFFECTS)
    covariance = np.array(sum(parts))
    share = share_of_law(levels.values[:, 1], design)
    covariance[:, 1] *= share[:, :, None] * share[:, None]
    return covariance


def _applied(matrix: Array, values: Array) -> Array:
    """Each matrix times its values, shapes (..., m, n) and (..., n)."""
    return np.asarray(np.einsum("...mn,...n->...m", matrix, values))


def _laws(
    levels: Levels, fitted: Array, maps: Array, sides: Sequence[str]
) -> tuple[LawStack, Array]:
    """Make the slopes of K1 relative: the laws, and the maps that lead to them, (R, 3, p, n)."""
    values = fitted.copy()
    maps = np.broadcast_to(maps, (*fitted.shape, maps.shape[-1])).copy()
    values[:, 1], jacobian = relative_slopes(fitted[:, 1])
    maps[:, 1] = jacobian @ maps[:, 1]
    variances, freedom = [], []
    for part in levels.components.values():
        passed = np.einsum("...mn,...mn->...m", maps @ part.covariance, maps)
        variances.append(passed)
        freedom.append(np.broadcast_to(part.dof.min(axis=-1, keepdims=True), passed.shape))
    intervals = combined(variances, freedom)
    records = len(values)
    flat = Intervals(*(part.reshape(records, -1) for part in intervals))
    return LawStack(tuple(sides), values.reshape(records, -1), flat), maps


def _hysteresis(
    levels: Levels, half_widths: Array, maps: Array, stack: LevelStack, loop: Branches
) -> Hysteresis:
    parts = levels.components.items() if half_widths.size else ()
    of_bias = {name: Component(part.covariance[:, 0], part.dof[:, 0]) for name, part in parts}
    components = propagate(of_bias, maps)
    return mean_hysteresis(half_widths, components, stack.temperature @ loop.mean)


def _off_the_law(levels: Levels, fitted: Array, design: Array, loop: Branches) -> Mask:
    """Which quantities do not follow their law, by what is left, shape (R, 3).

    Few are off by chi-squared, which takes their errors as known; these are tested with the degrees
    of freedom of their errors.
    """
    size, count = design.shape[-2:]
    left = levels.values - _applied(design[:, None], fitted[..., :count])
    left[:, 0] -= fitted[:, 0, count:] @ loop.acting.T
    covariance = levels.covariance
    known = np.isfinite(covariance.reshape(len(left), -1)).all(axis=1)
    unit = np.ones((len(left), 3))
    unit[:, 1] = np.abs(fitted[:, 1, 0])  # the scale factor is in units of the output
    more = np.abs(left).max(axis=-1) >= _ROUNDING * unit
    off = np.zeros((len(left), 3), dtype=np.bool_)
    for i, law in enumerate((with_columns(design, loop.acting), design, design)):
        dof = size - law.shape[-1]
        if dof >= 1:
            p = f_survival(misfit(left[:, i], covariance[:, i]) / dof, float(dof), np.inf)
            off[:, i] = known & more[:, i] & (p < _SIGNIFICANT)
            rows = np.flatnonzero(off[:, i])
            off[rows, i] = _chance(levels, rows, i, law) < _SIGNIFICANT
    return off


def _chance(levels: Levels, rows: Places, quantity: int, law: Array) -> Array:
    """Chance that a quantity which follows its law is as far off, of some records."""
    parts = {
        name: Component(
            part.covariance[rows, quantity],
            np.broadcast_to(part.dof, levels.values.shape)[rows, quantity],
        )
        for name, part in levels.components.items()
    }
    of_rows = law if len(law) == 1 else law[rows]
    return chance_of_misfit(levels.values[rows, quantity], parts, contrasts_of(of_rows))
