"""An effect with everything but its size, and what it does to readings for each size."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.effects.conditions import Conditions
from accelcal.effects.effect import Disturbance, Effect
from accelcal.effects.parameter import Parameter


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
    for _, group in groupby(instances, _but_for_mixture):
        alike = list(group)
        mixtures = np.array([item.mixture for item in alike])
        found.append(amplitude_columns(alike[0], c) @ mixtures.T)
    return np.hstack(found)


def _but_for_mixture(item: Instance) -> tuple[object, ...]:
    """What instances share whose columns are mixed of the same."""
    return item.effect, item.mixture[0] < 0.0, item.shape, item.near


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
