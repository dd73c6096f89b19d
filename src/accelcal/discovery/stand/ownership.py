"""Effects that one unit has beside the others, whose each effect is, and where the head stands.

An effect is the stand's if it has one value in all units.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.columns import scaled
from accelcal.discovery.explanation import Explanation
from accelcal.discovery.family import Family, family_of, with_rates
from accelcal.discovery.instance import Instance, column_of, instance_of
from accelcal.discovery.search import search
from accelcal.discovery.stand.units import (
    Unit,
    amplitudes,
    beside_the_others,
    known,
    of_another_head,
    shared_columns,
)
from accelcal.effects.effect import Effect
from accelcal.effects.found import disturbances
from accelcal.head_angles import head_positions
from accelcal.numerics.grouping import distinct
from accelcal.numerics.probability import LEVEL, NORMAL_FACTOR, f_survival, student_quantile
from accelcal.results.discovery import Discovery
from accelcal.results.quantity import Quantity
from accelcal.results.stand_discovery import HeadPosition, StandEffect


def explained(family: Family, alpha: float, most: int) -> tuple[tuple[Explanation, ...], bool]:
    """Effects that explain a unit beside the others, best first, and whether they do so fully."""
    found = search(family, alpha=alpha, most=most)
    near = () if found.nearest is None else (found.nearest,)
    return found.explanations or near, bool(found.explanations) or found.before.p_value >= alpha


class Looker:
    """Looks at units beside the others; the null of one plan and kind of noise is simulated once.

    A head position has the declared uncertainty `head` [rad]; with `one_head`, those that the
    others tell are those of the unit too.
    """

    def __init__(
        self, effects: Sequence[Effect], head: float, seed: int, *, one_head: bool = True
    ) -> None:
        self._effects, self._head, self._seed = effects, head, seed
        self._one_head = one_head or not head
        self._families: dict[Hashable, Family] = {}

    def __call__(self, units: Sequence[Unit], number: int, shared: Sequence[Instance]) -> Family:
        """What is tested of a unit, on its readings without what the others tell of the stand."""
        unit = units[number]
        others = [*units[:number], *units[number + 1 :]] if len(units) >= FEWEST else []
        columns = shared_columns(unit, shared, self._head)
        told = known(others, shared, self._head, columns.shape[1])
        if not self._one_head:
            told = of_another_head(told, unit.head.shape[1], self._head)
        # false-alarm rates hardly differ from unit to unit; the rest is that of the unit
        family = family_of(beside_the_others(unit, columns, told), self._effects)
        if family.null not in self._families:
            self._families[family.null] = with_rates(family, self._seed)
        return family.with_rates_of(self._families[family.null])


class Own(NamedTuple):
    """Effects that one unit has alone."""

    instances: tuple[Instance, ...]  # the effects
    others: tuple[tuple[str, ...], ...]  # for each effect the ids of those that explain it as well
    p_values: tuple[float, ...]  # for each effect the chance that noise makes it look as needed
    complete: bool  # whether nothing is left that they do not explain
    silence: tuple[tuple[str, list[str]], ...] = ()
    """What is to be said of readings that a dead zone silences, with the ids that are in doubt."""


def instances_in(common: Discovery) -> tuple[Instance, ...]:
    """Effects of a discovery without their sizes."""
    return tuple(instance_of(item) for item in disturbances(common.effects))


def common_effects(
    units: Sequence[Unit], common: Discovery, names: Sequence[str], alpha: float
) -> Iterator[StandEffect]:
    """Tell the effects that were found in the mean of the units."""
    found = instances_in(common)
    for item, told in zip(found, common.effects, strict=True):
        effect = _effect(units, item, found, names, alpha)
        effect = replace(effect, p_value=told.p_value, indistinguishable=told.indistinguishable)
        yield effect if effect.verdict == "unit" else replace(effect, parameters=told.parameters)


def own_effects(
    units: Sequence[Unit],
    own: Mapping[int, Own],
    shared: Sequence[Instance],
    names: Sequence[str],
    alpha: float,
) -> Iterator[StandEffect]:
    """Tell the effects that were found in single units beside the others, the clearest first."""
    found = [
        (p, number, item, others)
        for number, told in own.items()
        for p, item, others in zip(told.p_values, told.instances, told.others, strict=True)
    ]
    found.sort(key=lambda one: one[:2])
    for name in dict.fromkeys(item.effect.id for _, _, item, _ in found):
        p_value, _, item, others = next(one for one in found if one[2].effect.id == name)
        effect = _effect(units, item, shared, names, alpha)
        yield replace(
            effect,
            verdict="unit" if effect.verdict == "stand" else effect.verdict,
            p_value=p_value,
            found_in=tuple(names[n] for _, n, i, _ in found if i.effect.id == name),
            indistinguishable=others,
        )


def _effect(
    units: Sequence[Unit],
    item: Instance,
    beside: Sequence[Instance],
    names: Sequence[str],
    alpha: float,
) -> StandEffect:
    """An effect with its size in each unit, whose it is as far as the sizes tell."""
    told = one_value(units, item, beside, alpha)
    unit = item.effect.amplitudes[int(np.argmax(np.abs(item.mixture)))].unit
    dofs = [own.comparison.space.dof for own in units]
    values = zip(names, told.sizes.tolist(), told.uncertainties.tolist(), dofs, strict=True)
    return StandEffect(
        id=item.effect.id,
        name=item.effect.name,
        verdict=told.verdict,
        parameters={},
        p_value=1.0,
        p_one_value=told.p_value,
        spread=told.spread,
        sizes={
            name: Quantity(value, u, unit, u * student_quantile(LEVEL, dof), float(dof))
            for name, value, u, dof in values
        },
        found_in=(),
        indistinguishable=(),
    )


def head_of(
    units: Sequence[Unit], shared: Sequence[Instance], head: float
) -> tuple[HeadPosition, ...]:
    """Estimate the errors of the head positions from all units; none for a perfect head."""
    if not head:
        return ()
    first = len(amplitudes(shared))
    size = shared_columns(units[0], shared, head).shape[1]
    told = known(units, shared, head, size)
    angles = distinct(head_positions(units[0].comparison.record.angle))
    errors = np.sqrt(np.diagonal(told.covariance))
    return tuple(
        HeadPosition(angle, Quantity(value, u, "rad", NORMAL_FACTOR * u))
        for angle, value, u in zip(
            angles.tolist(), told.value[first:].tolist(), errors[first:].tolist(), strict=True
        )
    )


Verdict = Literal["stand", "unit", "undecided"]

FEWEST = 3
"""Units that it takes to call an effect the stand's, and to tell a unit from the others."""

_ALIKE = 0.02
"""Spread from unit to unit, over the size, that still counts as one value."""

_DIFFERENT = 1.0
"""Spread over the size that is to be ruled out: that of an effect which half of the units have."""

_LEVEL = 0.05


class OneValue(NamedTuple):
    """The sizes of an effect in U units, and whether they are one."""

    sizes: Array  # along the common mixture of its amplitudes, (U,)
    uncertainties: Array  # of the sizes, without what is common to all units, (U,)
    p_value: float  # chance that sizes that are one differ as much
    spread: float  # upper 95 % limit of the standard deviation from unit to unit, over the size
    verdict: Verdict  # whose the effect is


def one_value(
    units: Sequence[Unit], instance: Instance, beside: Sequence[Instance], alpha: float
) -> OneValue:
    """Fit an effect in each unit beside others, and test whether one size does for all.

    Whether the common size is more than noise is not judged here.

    Notes
    -----
    Head errors shift the sizes of all units alike, and do not enter the test.
    """
    fits = [_fit(unit, instance, beside) for unit in units]
    weights = [np.linalg.pinv(covariance, hermitian=True) for _, covariance in fits]
    total = np.linalg.pinv(sum(weights, np.zeros_like(weights[0])), hermitian=True)
    common = total @ sum(w @ size for w, (size, _) in zip(weights, fits, strict=True))
    squares = sum(
        float((size - common) @ w @ (size - common))
        for w, (size, _) in zip(weights, fits, strict=True)
    )
    degrees = (len(units) - 1) * common.size
    noise = sum(unit.comparison.space.dof for unit in units)
    p_value = f_survival(squares / degrees, degrees, noise)
    way = np.ones(1) if common.size == 1 else common / max(float(np.linalg.norm(common)), 1e-300)
    sizes = np.array([way @ size for size, _ in fits])
    uncertainties = np.array([np.sqrt(way @ covariance @ way) for _, covariance in fits])
    spread, limit = _spread(sizes, uncertainties)
    verdict: Verdict = "undecided"
    if p_value < alpha and spread > _ALIKE:
        verdict = "unit"
    elif len(units) >= FEWEST and limit < _DIFFERENT:
        verdict = "stand"
    return OneValue(sizes, uncertainties, p_value, limit, verdict)


def _fit(unit: Unit, instance: Instance, beside: Sequence[Instance]) -> tuple[Array, Array]:
    """Amplitudes of an effect in a unit, beside others, with their covariance."""
    c, space = unit.comparison.model.conditions, unit.comparison.space
    others = [item for item in (*beside, *unit.own) if item.effect.id != instance.effect.id]
    own = amplitudes([instance])
    columns = [space.see(column_of(item, c)) for item in (*own, *amplitudes(others))]
    units, norms = scaled(np.stack(columns, axis=1))
    inverse = np.linalg.pinv(units) / norms[:, None]
    kept = inverse[: len(own)]
    return kept @ unit.comparison.seen, kept @ kept.T


def _spread(sizes: Array, uncertainties: Array) -> tuple[float, float]:
    """Spread from unit to unit beyond the noise and its upper limit, both over the size."""
    from scipy.special import chdtri  # type: ignore[import-untyped]

    weights = uncertainties**-2.0
    common = float(weights @ sizes / weights.sum())
    squares = float(weights @ (sizes - common) ** 2)
    variance = 1.0 / float(weights.mean())
    degrees = sizes.size - 1
    largest = variance * max(squares / float(chdtri(degrees, 1.0 - _LEVEL)) - 1.0, 0.0)
    likely = variance * max(squares / degrees - 1.0, 0.0)
    size = max(abs(common), 1e-300)
    return float(np.sqrt(likely)) / size, float(np.sqrt(largest)) / size
