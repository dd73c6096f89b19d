"""Effects with everything but their size: what they do to readings, and those that are searched.

Each is a direction in which the readings may differ from the base model.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from typing import NamedTuple

import numpy as np

from accelcal.arguments.kinds import each_of
from accelcal.arrays import Array, Mask, Places
from accelcal.discovery.columns import lengths
from accelcal.discovery.space import Space
from accelcal.effects.catalogue import catalogue
from accelcal.effects.conditions import Conditions
from accelcal.effects.effect import Disturbance, Effect
from accelcal.effects.parameter import Parameter
from accelcal.errors import InputError


class Instance(NamedTuple):
    """An effect with everything but its size."""

    effect: Effect  # entry of the catalogue
    mixture: tuple[float, ...]  # amplitudes for the size 1
    shape: Mapping[str, float]  # parameters that enter nonlinearly
    near: float | None = None
    """Size near which the column of the first amplitude is taken; by default a small one."""

    @property
    def one_sided(self) -> bool:
        """Whether only a positive size makes sense: of a width, or of a temperature one way."""
        effect = self.effect
        return effect.amplitudes[0].minimum == 0.0 or effect.acts_on == "temperature"

    def at(self, name: str, value: float) -> Instance:
        """The same with another value of a nonlinear parameter."""
        return self._replace(shape={**self.shape, name: value})

    @property
    def amplitudes(self) -> tuple[Parameter, ...]:
        """Amplitudes that the mixture has."""
        own = zip(self.effect.amplitudes, self.mixture, strict=True)
        return tuple(parameter for parameter, part in own if part)


def replaced(instances: Sequence[Instance], place: int, *others: Instance) -> tuple[Instance, ...]:
    """Effects with others in the place of one, or without it."""
    return (*instances[:place], *others, *instances[place + 1 :])


def amplitude_columns(instance: Instance, c: Conditions) -> Array:
    """Change of the readings per unit of each amplitude [g per unit], shape (n, m).

    The signs of its mixture tell which way an effect acts.
    """
    if instance.mixture[0] < 0.0:
        c = replace(c, per_degree=c.per_degree_falling)
    return np.asarray(c.gain[:, None] * instance.effect.columns(c, instance.near, **instance.shape))


def own_columns(instance: Instance, c: Conditions) -> Array:
    """Those of `amplitude_columns` whose amplitudes the mixture has."""
    return amplitude_columns(instance, c)[:, np.flatnonzero(instance.mixture)]


def column_of(instance: Instance, c: Conditions) -> Array:
    """Change of the readings for an instance of size 1 [g], shape (n,)."""
    return np.asarray(amplitude_columns(instance, c) @ np.array(instance.mixture))


def columns_of(instances: Iterable[Instance], c: Conditions) -> Array:
    """Changes of the readings for instances of size 1 [g], shape (n, h)."""
    found = [np.empty((c.angle.size, 0))]
    # what instances share whose columns are mixed of the same
    for _, group in groupby(instances, lambda i: (i.effect, i.mixture[0] < 0.0, i.shape, i.near)):
        alike = list(group)
        mixtures = np.array([item.mixture for item in alike])
        found.append(amplitude_columns(alike[0], c) @ mixtures.T)
    return np.hstack(found)


def all_own_columns(instances: Iterable[Instance], c: Conditions) -> Array:
    """Those of `own_columns` of several effects side by side, shape (n, m)."""
    return np.hstack([np.empty((c.angle.size, 0)), *(own_columns(item, c) for item in instances)])


def instance_of(known: Disturbance) -> Instance:
    """Take the size out of an effect."""
    sizes = sizes_of(known)
    norm = float(np.sqrt(sizes @ sizes))
    mixture = sizes / norm if norm else np.eye(sizes.size)[0]
    shape = {item.name: known.values[item.name] for item in known.effect.shapes}
    near = float(sizes[0]) if known.effect.amplitudes[0].sizes and norm else None
    return Instance(known.effect, tuple(mixture.tolist()), shape, near)


def sizes_of(known: Disturbance) -> Array:
    """Amplitudes of an effect."""
    return np.array([known.values[item.name] for item in known.effect.amplitudes])


def contributions(known: Iterable[Disturbance], c: Conditions) -> Array:
    """What effects add to the readings together over K1 at T0 [g], shape (n,)."""
    return sum((contribution(item, c) for item in known), start=np.zeros(c.angle.size))


def contribution(known: Disturbance, c: Conditions) -> Array:
    """What an effect adds to the readings over K1 at T0 [g], shape (n,)."""
    return np.asarray(amplitude_columns(instance_of(known), c) @ sizes_of(known))


_PHASES = 12
"""Mixtures of two amplitudes that are tried, evenly over half a turn."""

_FINER = 3
"""The first search tries so many values of a parameter for each one that an effect lists."""


MOST_VALUES = 500
"""Values of a discrete parameter that the first search tries: of more, so many, evenly."""


class Candidates(NamedTuple):
    """All instances that can be seen, as unit vectors of the space."""

    instances: tuple[Instance, ...]  # N instances, those of one effect together
    directions: Array  # their unit vectors, (n, N)
    systematic: Array  # their parts that repeat in replicates, (b, N)
    length: Array  # length of an instance of size 1, in standard deviations of the noise, (N,)
    owner: Places  # index into `effects`, (N,)
    one_sided: Mask  # where only a positive size makes sense, (N,)
    effects: tuple[Effect, ...]  # effects that can be seen
    hidden: tuple[Effect, ...]  # effects of which the base model leaves nothing

    def of(self, effect: int) -> slice:
        """Places of the instances of an effect."""
        return slice(*np.searchsorted(self.owner, [effect, effect + 1]).tolist())

    def like(self, place: int) -> slice:
        """Places of the instances of the effect that one of them is of."""
        return self.of(int(self.owner[place]))


def searched_among(effects: Iterable[Effect] | None = None) -> tuple[Effect, ...]:
    """Effects that add to the readings in proportion to their size, by default the catalogue's."""
    asked = catalogue() if effects is None else each_of(effects, Effect)
    found = tuple(e for e in asked if e.acts_on != "readings" and e.amplitudes)
    if not found:
        ids = ", ".join(entry.id for entry in asked) or "none"
        raise InputError(
            f"effects are {ids}, of which none can be searched for; give one with an amplitude that"
            " does not act on the readings, or leave effects out to search the catalogue"
        )
    return found


def candidates(effects: Sequence[Effect], space: Space, c: Conditions) -> Candidates:
    """Set up the search directions of some effects, each with an amplitude."""
    seen: list[tuple[Effect, list[Instance], Array, Array]] = []
    hidden = []
    for effect in effects:
        instances, unit, length = visible(list(instances_of(effect, c)), space, c)
        if instances:
            seen.append((effect, instances, unit, length))
        else:
            hidden.append(effect)
    sizes = [len(own) for _, own, _, _ in seen]
    kept = tuple(itertools.chain.from_iterable(own for _, own, _, _ in seen))
    directions = np.hstack([space.nothing(), *(unit for _, _, unit, _ in seen)])
    return Candidates(
        instances=kept,
        directions=directions,
        systematic=space.systematic.T @ directions,
        length=np.concatenate([np.empty(0), *(length for _, _, _, length in seen)]),
        owner=np.repeat(np.arange(len(seen)), sizes),
        one_sided=np.array([item.one_sided for item in kept], dtype=bool),
        effects=tuple(effect for effect, _, _, _ in seen),
        hidden=tuple(hidden),
    )


def visible(
    instances: Sequence[Instance], space: Space, c: Conditions
) -> tuple[list[Instance], Array, Array]:
    """Those of some instances that can be seen, with their unit vectors, (n, k), and lengths."""
    seen, shown = space.shown(columns_of(instances, c))
    places = np.flatnonzero(shown)
    length = lengths(seen)[places]
    return [instances[i] for i in places.tolist()], seen[:, places] / length, length


def instances_of(effect: Effect, c: Conditions) -> Iterator[Instance]:
    """All instances of an effect that are tried, for all values of its nonlinear parameters.

    Of several amplitudes, the first is tried alone, and the last two in all phases. One to which
    the readings are proportional within bounds alone is tried near the sizes that it lists.
    """
    listed = effect.amplitudes[0].sizes
    sizes = [None] if listed is None else listed(c).tolist()
    grids = [_grid(item.searched_at(c), discrete=item.discrete) for item in effect.shapes]
    names = [item.name for item in effect.shapes]
    for values in itertools.product(*grids):
        for mixture, near in itertools.product(_mixtures(effect), sizes):
            yield Instance(effect, mixture, dict(zip(names, values, strict=True)), near)


def left_out_around(item: Instance, c: Conditions) -> list[Instance]:
    """Instances at the values of a discrete parameter that the first search left out near one.

    They are none where it tried them all.
    """
    found = []
    for parameter in item.effect.shapes:
        values = parameter.searched_at(c) if parameter.discrete else np.empty(0)
        if values.size > MOST_VALUES:
            own = int(np.abs(values - item.shape[parameter.name]).argmin())
            step = -(-values.size // (MOST_VALUES - 1))
            near = values[max(own - step, 0) : own + step + 1]
            found += [item.at(parameter.name, value) for value in near.tolist()]
    return found


def _grid(values: Array, *, discrete: bool) -> list[float]:
    if discrete or values.size < 2:
        places = np.linspace(0, values.size - 1, min(values.size, MOST_VALUES))
        return [float(value) for value in values[np.rint(places).astype(np.intp)]]
    places = np.arange(0, values.size - 1 + 0.5 / _FINER, 1.0 / _FINER)
    if np.all(values > 0.0):
        return [float(v) for v in np.exp(np.interp(places, np.arange(values.size), np.log(values)))]
    return [float(v) for v in np.interp(places, np.arange(values.size), values)]


def _mixtures(effect: Effect) -> list[tuple[float, ...]]:
    amplitudes = len(effect.amplitudes)
    if amplitudes == 1:
        return [(1.0,), (-1.0,)] if effect.acts_on == "temperature" else [(1.0,)]
    first = [(1.0, *[0.0] * (amplitudes - 1))] if amplitudes > 2 else []
    phases = np.pi * (np.arange(_PHASES) + 0.5) / _PHASES  # between: none is one amplitude alone
    lead = (0.0,) * (amplitudes - 2)
    return first + [(*lead, float(np.cos(phi)), float(np.sin(phi))) for phi in phases]
