"""Effects as documents tell them: with the sizes that were found, ready to be used again."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from accelcal.arrays import Array
from accelcal.effects.conditions import Conditions
from accelcal.effects.effect import ActsOn, Disturbance
from accelcal.effects.empirical import effect_of
from accelcal.results.findings import FoundEffect


def disturbances(found: Iterable[FoundEffect]) -> tuple[Disturbance, ...]:
    """Give effects of the catalogue, or empirical ones, the sizes that were found.

    Raises
    ------
    InputError
        If an effect is not in the catalogue, or a parameter breaks a rule.
    """
    return tuple(map(_disturbance, found))


def total(acts_on: ActsOn, effects: Iterable[Disturbance], c: Conditions) -> Array:
    """Sum of the effects that act on one thing, by their exact laws [rad, degC or g]."""
    acting = (item.change(c) for item in effects if item.effect.acts_on == acts_on)
    return sum(acting, start=np.zeros(c.angle.size))


def _disturbance(found: FoundEffect) -> Disturbance:
    entry = effect_of(found.id, found.parameters)
    values = {name: quantity.value or 0.0 for name, quantity in found.parameters.items()}
    first = values.pop(entry.parameters[0].name, 0.0)
    return entry.of(first, **values)
