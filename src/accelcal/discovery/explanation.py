"""Some effects fitted together: their nonlinear parameters, what they take up, what they leave."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.columns import (
    first_largest,
    length_without,
    lengths,
    orthonormal,
    squares_in,
    without,
)
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.family import NEW, SMALLEST, Family, agrees, chance
from accelcal.discovery.instance import Instance, left_out_around, own_columns, visible
from accelcal.discovery.parameters import settled

_ROUNDS = 3

CONTRADICTION = 0.3
"""Part of the false-alarm rate at which noise may contradict the true explanation."""

RIVALS = 10.0
"""Times the false-alarm rate up to which what explains the readings is a rival of what is named."""

_ALIKE = 1.0 - 1e-9
"""Cosine from which two values of a parameter look alike but for rounding."""

BENT = 0.01
"""Chance that noise bends a straight law, below which it is taken for another one."""


class Explanation(NamedTuple):
    """Some effects, fitted together."""

    instances: tuple[Instance, ...]  # the effects with their nonlinear parameters
    directions: Array  # their unit vectors, (n, h)
    squares: float  # sum of squares that they take up
    p_values: tuple[float, ...]
    """For each one, the chance that noise makes it look as needed beside the others."""
    passes: bool
    """Whether all are needed as those of a rival are, and nothing disagrees beside them."""
    bent: tuple[str, ...] = ()
    """Of effects that pass, the ids of those whose law is straighter than the readings have it."""

    def seen_in(self, comparison: Comparison) -> Explanation:
        """The same, which was found in another space, in that of a comparison."""
        directions = comparison.directions(*self.instances)
        squares = squares_in(orthonormal(directions), comparison.seen)
        return self._replace(directions=directions, squares=squares)

    @property
    def ids(self) -> frozenset[str]:
        """Ids of the effects."""
        return frozenset(item.effect.id for item in self.instances)


def best_instances(
    family: Family, effects: Sequence[int], best: Callable[[int, tuple[int, ...]], int]
) -> tuple[list[int], float]:
    """Find the best instance of each of some effects together, in turns.

    Effects are given by their indices; returned are those of the instances, and the sum of squares
    that they take up. The best of an effect beside others is that of `best_place`.
    """
    places: list[int] = []
    for effect in effects:
        places.append(best(effect, tuple(places)))
    for _ in range(_ROUNDS if len(effects) > 1 else 0):
        before = list(places)
        for i, effect in enumerate(effects):
            places[i] = best(effect, tuple(places[:i] + places[i + 1 :]))
        if places == before:
            break
    basis = orthonormal(family.candidates.directions[:, places])
    return places, squares_in(basis, family.comparison.seen)


def best_place(family: Family, effect: int, others: tuple[int, ...]) -> int:
    """Index of the instance of an effect that takes up most beside others."""
    found = family.candidates
    own = found.of(effect)
    taken, units = orthonormal(found.directions[:, list(others)]), found.directions[:, own]
    length = length_without(taken.T @ units)
    seen = units.T @ without(family.comparison.seen, taken)
    size = np.where(length > NEW, seen / np.maximum(length, NEW), 0.0)
    size = np.where(found.one_sided[own], np.maximum(size, 0.0), size)
    return int(own.start + first_largest(size**2))


def explanation(family: Family, places: Sequence[int], alpha: float) -> Explanation:
    """Fit some effects with all their parameters, from indices of instances on, off the grid."""
    comparison = family.comparison
    instances = [family.candidates.instances[place] for place in places]
    directions = family.candidates.directions[:, list(places)].copy()
    for index, place in enumerate(places):
        others = orthonormal(np.delete(directions, index, axis=1))
        if (refined := _refined(family, place, others)) is not instances[index]:
            instances[index] = refined
            directions[:, index] = comparison.directions(refined)[:, 0]
    for index, item in enumerate(settled(comparison, instances)):
        if item is not instances[index]:
            instances[index] = item
            directions[:, index] = comparison.directions(item)[:, 0]
    taken = orthonormal(directions)
    variance = family.space.variance(without(comparison.seen, taken))
    p_values = tuple(
        _p_value(family, item, directions[:, index], np.delete(directions, index, axis=1), variance)
        for index, item in enumerate(instances)
    )
    passes = max(p_values) < RIVALS * alpha and agrees(family, taken, CONTRADICTION * alpha)
    return Explanation(
        instances=tuple(instances),
        directions=directions,
        squares=squares_in(taken, comparison.seen),
        p_values=p_values,
        passes=passes,
        bent=tuple(
            item.effect.id for item in instances if passes and _is_bent(comparison, item, taken)
        ),
    )


def _is_bent(comparison: Comparison, item: Instance, taken: Array) -> bool:
    """Whether the readings bend the law of an effect that has none but a straight one."""
    if item.effect.bend is None:
        return False
    space = comparison.space
    columns = space.see(
        item.effect.bend(comparison.model.conditions).reshape(len(comparison.record), -1)
    )
    bends = without(columns, taken)
    new = lengths(bends) > NEW * lengths(columns)
    return chance_beside(comparison, bends[:, new], taken) < BENT


def _refined(family: Family, place: int, others: Array) -> Instance:
    """Move the nonlinear parameter off the grid, to where the squares are largest."""
    start = family.candidates.instances[place]
    if len(start.amplitudes) > 1:
        return _simpler(family, place, others) or _in_phase(family.comparison, start, others)
    smooth = [item.name for item in start.effect.shapes if not item.discrete]
    if len(smooth) != 1:
        return _among_all(family, place, others)
    from scipy.optimize import minimize_scalar  # type: ignore[import-untyped]

    (name,) = smooth
    if (middle := _without_trace(family, place, name, others)) is not None:
        return start.at(name, middle)

    def loss(value: float) -> float:
        unit = without(family.comparison.directions(start.at(name, value))[:, 0], others)
        return -float((unit @ family.comparison.seen) ** 2) / max(float(unit @ unit), NEW**2)

    found = minimize_scalar(loss, bounds=_neighbours(family, place, name), method="bounded")
    return start.at(name, float(found.x)) if found.fun < loss(start.shape[name]) else start


def _among_all(family: Family, place: int, others: Array) -> Instance:
    """Try the values of a discrete parameter that the first search left out around an instance."""
    start, comparison = family.candidates.instances[place], family.comparison
    c = comparison.model.conditions
    near = left_out_around(start, c)
    if not near:
        return start
    shown, units, _ = visible(near, comparison.space, c)
    left = without(units, others)
    squares = (left.T @ comparison.seen) ** 2 / np.maximum(lengths(left), NEW) ** 2
    return shown[first_largest(squares)]


def _simpler(family: Family, place: int, others: Array) -> Instance | None:
    """A law of fewer amplitudes of the same effect, beside which those of an instance are not due.

    More amplitudes always fit the noise better, and so they would nearly always be named.
    """
    found, comparison = family.candidates, family.comparison
    start = found.instances[place]
    fewer = len(start.amplitudes) - 1
    for other in found.instances[found.like(place)]:
        if len(other.amplitudes) <= fewer and other.shape == start.shape:
            beside = orthonormal(np.hstack([others, comparison.directions(other)]))
            if not is_needed(comparison, start, beside):
                return other
    return None


def explain_as_well(comparison: Comparison, others: Sequence[Instance], item: Instance) -> bool:
    """Whether an effect is not needed beside others, one of which is in its place."""
    return not is_needed(comparison, item, comparison.span(others))


def is_needed(comparison: Comparison, item: Instance, beside: Array) -> bool:
    """Whether noise alone would hardly leave as much of an effect beside some directions."""
    own = comparison.space.see(own_columns(item, comparison.model.conditions))
    return chance_beside(comparison, own, beside) < BENT


def chance_beside(comparison: Comparison, columns: Array, beside: Array) -> float:
    """Chance that noise alone makes as much of some columns beside an orthonormal basis.

    It is 1 where nothing of them is new. Both are in the space, shape (n, k) and (n, h).
    """
    space, seen = comparison.space, comparison.seen
    within = orthonormal(np.hstack([beside, columns]))
    degrees = within.shape[1] - beside.shape[1]
    if degrees < 1:
        return 1.0
    left = without(seen, within)
    squares = float((without(seen, beside) ** 2).sum() - (left**2).sum())
    ratio = squares / degrees / space.variance(left)
    return float(chance(np.array(ratio), space.dof, degrees))


def _in_phase(comparison: Comparison, start: Instance, others: Array) -> Instance:
    """Mix the amplitudes as the readings have it, in place of a phase of the grid."""
    own = np.flatnonzero(start.mixture)
    columns = own_columns(start, comparison.model.conditions)
    columns = without(comparison.space.see(columns), others)
    sizes = np.linalg.lstsq(columns, comparison.seen, rcond=NEW)[0]
    mixture = np.zeros(len(start.mixture))
    mixture[own] = sizes / max(float(np.linalg.norm(sizes)), SMALLEST)
    return start._replace(mixture=tuple(mixture.tolist()))


def _without_trace(family: Family, place: int, name: str, others: Array) -> float | None:
    """Value of a parameter that no reading shows, as all its values look alike, else None.

    It is the default, as the middle of a loop for the state at the first level, or the median.
    """
    found = family.candidates
    own = found.like(place)
    values = np.array([item.shape[name] for item in found.instances[own]])
    units = without(found.directions[:, own], others)
    size = lengths(units)
    units, values = units[:, size > NEW] / size[size > NEW], values[size > NEW]
    if values.size < 2 or np.abs(units.T @ units[:, 0]).min() < _ALIKE:
        return None
    default = next(p.default for p in found.instances[place].effect.shapes if p.name == name)
    lowest, highest = values.min(), values.max()
    inside = default is not None and lowest <= default <= highest
    return float(default if inside and default is not None else np.median(values))


def _neighbours(family: Family, place: int, name: str) -> tuple[float, float]:
    """Values of a parameter on the grid next to that of an instance."""
    found = family.candidates
    values = np.array([item.shape[name] for item in found.instances[found.like(place)]])
    here = found.instances[place].shape[name]
    return (
        float(values[values < here].max(initial=-np.inf if values.min() < here else here)),
        float(values[values > here].min(initial=np.inf if values.max() > here else here)),
    )


def _p_value(
    family: Family, item: Instance, direction: Array, others: Array, variance: float
) -> float:
    """Chance that noise of a variance makes one effect look as needed beside the others."""
    seen = family.comparison.seen
    unit = without(direction, orthonormal(others))
    if unit @ unit < NEW**2:
        return 1.0
    size = float(unit @ seen / np.sqrt(unit @ unit))
    if item.one_sided and size < 0.0:
        return 1.0
    single = float(chance(np.array(size**2 / variance), family.space.dof))
    ids = [effect.id for effect in family.candidates.effects]
    tries = family.tries[ids.index(item.effect.id)]
    return float(min(1.0, single * tries * family.tests))
