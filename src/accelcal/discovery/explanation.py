"""Some effects fitted together: their nonlinear parameters, what they take up, what they leave."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.candidates import Instance, amplitude_columns, direction
from accelcal.discovery.family import NEW, SMALLEST, Family, agrees, chance
from accelcal.discovery.spans import lengths, orthonormal, squares_in, without
from accelcal.effects.conditions import Conditions

_ROUNDS = 3

CONTRADICTION = 0.3
"""Part of the false-alarm rate at which noise may contradict the true explanation."""

RIVALS = 10.0
"""Times the false-alarm rate up to which what explains the readings is a rival of what is named."""

BENT = 0.01
"""Chance that noise bends a straight law, below which it is taken for another one."""


class Explanation(NamedTuple):
    """Some effects, fitted together.

    Attributes
    ----------
    instances : tuple of Instance
        The effects with their nonlinear parameters.
    directions : ndarray, shape (m, h)
        Their unit vectors.
    squares : float
        Sum of squares that they take up.
    p_values : tuple of float
        For each one, the chance that noise makes it look as needed beside the others.
    passes : bool
        Whether all are needed as those of a rival are, and nothing disagrees with what they leave.
    bent : tuple of str
        Of effects that pass, the ids of those whose law is straighter than the readings have it.
    """

    instances: tuple[Instance, ...]
    directions: Array
    squares: float
    p_values: tuple[float, ...]
    passes: bool
    bent: tuple[str, ...] = ()

    @property
    def ids(self) -> frozenset[str]:
        """Ids of the effects."""
        return frozenset(item.effect.id for item in self.instances)


def best_instances(family: Family, seen: Array, effects: Sequence[int]) -> tuple[list[int], float]:
    """Find the best instances of some effects together, in turns.

    Parameters
    ----------
    family : Family
        The family.
    seen : ndarray, shape (m,)
        Coordinates of the readings.
    effects : sequence of int
        Indices of the effects.

    Returns
    -------
    places : list of int
        Index of an instance for each effect.
    squares : float
        Sum of squares that they take up together.
    """
    places: list[int] = []
    for effect in effects:
        places.append(_best_place(family, seen, effect, places))
    for _ in range(_ROUNDS if len(effects) > 1 else 0):
        before = list(places)
        for i, effect in enumerate(effects):
            places[i] = _best_place(family, seen, effect, places[:i] + places[i + 1 :])
        if places == before:
            break
    return places, squares_in(orthonormal(family.candidates.directions[:, places]), seen)


def _best_place(family: Family, seen: Array, effect: int, others: list[int]) -> int:
    found = family.candidates
    own = np.flatnonzero(found.owner == effect)
    taken = orthonormal(found.directions[:, others])
    columns = without(found.directions[:, own], taken)
    length = lengths(columns)
    size = np.where(length > NEW, columns.T @ seen / np.maximum(length, NEW), 0.0)
    size = np.where(found.one_sided[own], np.maximum(size, 0.0), size)
    return int(own[np.argmax(size**2)])


def explanation(
    family: Family, seen: Array, c: Conditions, places: Sequence[int], alpha: float
) -> Explanation:
    """Fit some effects with all their parameters.

    Parameters
    ----------
    family : Family
        The family.
    seen : ndarray, shape (m,)
        Coordinates of the readings.
    c : Conditions
        Of the readings.
    places : sequence of int
        Instances to start from.
    alpha : float
        False-alarm rate over the whole family.

    Returns
    -------
    Explanation
        The effects, off the grid of their parameters.
    """
    instances = [family.candidates.instances[place] for place in places]
    directions = family.candidates.directions[:, list(places)].copy()
    for index, place in enumerate(places):
        others = orthonormal(np.delete(directions, index, axis=1))
        better = _refined(family, seen, c, place, others)
        instances[index] = better
        directions[:, index] = direction(better, family.space, c)[0]
    p_values = tuple(
        _p_value(family, seen, instances, directions, index) for index in range(len(places))
    )
    taken = orthonormal(directions)
    passes = max(p_values) < RIVALS * alpha and agrees(family, seen, taken, CONTRADICTION * alpha)
    return Explanation(
        instances=tuple(instances),
        directions=directions,
        squares=squares_in(taken, seen),
        p_values=p_values,
        passes=passes,
        bent=tuple(
            e.effect.id for e in instances if passes and _is_bent(family, seen, c, e, taken)
        ),
    )


def _is_bent(family: Family, seen: Array, c: Conditions, item: Instance, taken: Array) -> bool:
    """Whether the readings bend the law of an effect that has none but a straight one."""
    if item.effect.bend is None:
        return False
    column = family.space.see(item.effect.bend(c))
    unit = without(column, taken)
    length = float(np.sqrt(unit @ unit))
    if length <= NEW * float(np.sqrt(column @ column)):
        return False
    left = without(seen, taken)
    variance = float(family.space.pure_error(left)) / family.space.dof
    ratio = float(unit @ left / length) ** 2 / variance
    return float(chance(np.array(ratio), family.space.dof)) < BENT


def _refined(family: Family, seen: Array, c: Conditions, place: int, others: Array) -> Instance:
    """Move the nonlinear parameter off the grid, to where the squares are largest."""
    start = family.candidates.instances[place]
    if sum(part != 0.0 for part in start.mixture) > 1:
        return _in_phase(family, seen, c, start, others)
    smooth = [item.name for item in start.effect.shapes if not item.discrete]
    if len(smooth) != 1:
        return start
    from scipy.optimize import minimize_scalar  # type: ignore[import-untyped]

    def at(value: float) -> Instance:
        return start._replace(shape={**start.shape, smooth[0]: float(value)})

    def loss(value: float) -> float:
        unit = without(direction(at(value), family.space, c)[0], others)
        return -float((unit @ seen) ** 2) / max(float(unit @ unit), NEW**2)

    low, high = _neighbours(family, place, smooth[0])
    found = minimize_scalar(loss, bounds=(low, high), method="bounded")
    return at(found.x) if found.fun < loss(start.shape[smooth[0]]) else start


def _in_phase(
    family: Family, seen: Array, c: Conditions, start: Instance, others: Array
) -> Instance:
    """Mix the amplitudes as the readings have it, in place of a phase of the grid."""
    own = np.array(start.mixture) != 0.0
    columns = without(family.space.see(amplitude_columns(start, c)[:, own]), others)
    sizes = np.linalg.lstsq(columns, seen, rcond=NEW)[0]
    mixture = np.zeros(own.size)
    mixture[own] = sizes / max(float(np.linalg.norm(sizes)), SMALLEST)
    return start._replace(mixture=tuple(mixture.tolist()))


def _neighbours(family: Family, place: int, name: str) -> tuple[float, float]:
    """Values of a parameter on the grid next to that of an instance."""
    found = family.candidates
    own = np.flatnonzero(found.owner == found.owner[place])
    values = np.array([found.instances[i].shape[name] for i in own])
    here = found.instances[place].shape[name]
    return (
        float(values[values < here].max(initial=-np.inf if values.min() < here else here)),
        float(values[values > here].min(initial=np.inf if values.max() > here else here)),
    )


def _p_value(
    family: Family, seen: Array, instances: Sequence[Instance], directions: Array, index: int
) -> float:
    """Chance that noise makes one effect look as needed beside the others."""
    left = without(seen, orthonormal(directions))
    variance = float(family.space.pure_error(left)) / family.space.dof
    unit = without(directions[:, index], orthonormal(np.delete(directions, index, axis=1)))
    if unit @ unit < NEW**2:
        return 1.0
    size = float(unit @ seen / np.sqrt(unit @ unit))
    if instances[index].one_sided and size < 0.0:
        return 1.0
    single = float(chance(np.array(size**2 / variance), family.space.dof))
    tries = family.tries[
        [other.id for other in family.candidates.effects].index(instances[index].effect.id)
    ]
    return float(min(1.0, single * tries * family.tests))
