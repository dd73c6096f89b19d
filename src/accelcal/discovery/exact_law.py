"""Readings of large effects, as they would be if the law of small ones held at any size.

The columns of the catalogue are those of small effects. A lag of some milliradians turns the
misalignment as well, and one of the output counts in the scale factor with it and not in that
without. The readings tell the sizes, the sizes what the exact law does beyond the columns, and the
readings less that tell the sizes anew: steps of Gauss and Newton with one matrix for all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.base import over_scale_factor, tilt, turned
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.instance import Instance, own_columns
from accelcal.discovery.solution import solution
from accelcal.discovery.untold import fitted_sizes
from accelcal.effects.effect import Disturbance
from accelcal.effects.found import total
from accelcal.record import TumbleRecord

_SEEN = 0.1
"""Change of all readings together, in standard deviations of the noise, that no test notices."""

_STEP, _BEND = 1e-3, 0.1
"""Part by which sizes are changed, and part of what their columns then tell that must be so."""


def straightened(comparison: Comparison, instances: Sequence[Instance]) -> TumbleRecord | None:
    """Take out of the readings what effects do beyond the law of small ones.

    There is nothing to take out where that is too little to notice, and where the readings do not
    tell the sizes by the columns of small ones, as of a dead zone in which some are silent.
    """
    if not instances:
        return None
    record, model, space = comparison.record, comparison.model, comparison.space
    beyond, moved = np.zeros(model.reading.size), np.inf
    while moved > _SEEN:
        now = comparison.less(beyond)
        sizes = fitted_sizes(now, instances).of_each
        parameters = solution(now, instances).parameters[: len(model.names)]
        found, straight = _beyond(comparison, _times(1.0, instances, sizes), parameters)
        before, moved = moved, float(np.linalg.norm(space.whiten(found - beyond)))
        if not moved < 0.5 * before:
            return None
        beyond = found
    if np.linalg.norm(space.whiten(beyond)) < _SEEN:
        return None
    larger = _times(1.0 + _STEP, instances, sizes)
    further, longer = _beyond(comparison, larger, parameters)
    bend, step = space.see(further - beyond), space.see(longer - straight)
    if bend @ bend > _BEND**2 * (step @ step):
        return None
    # the sizes are told over the scale factor of readings that are without this, which is another
    nominal = over_scale_factor(now.model).nominal
    change = (nominal - model.nominal) * straight - model.nominal * beyond
    return replace(record, output=record.output + change)


def _times(
    factor: float, instances: Sequence[Instance], sizes: Sequence[Array]
) -> list[tuple[Instance, Array]]:
    return [(item, factor * size) for item, size in zip(instances, sizes, strict=True)]


def _beyond(
    comparison: Comparison,
    sized: Sequence[tuple[Instance, Array]],
    parameters: Array,
) -> tuple[Array, Array]:
    """What effects of some sizes do beyond their columns, and by their columns [g].

    An effect on the temperature does nothing, as the laws of the model are straight on either side.
    """
    model = comparison.model
    acting = [
        (item, size)
        for item, size in sized
        if item.effect.acts_on != "temperature" and is_possible(item, size)
    ]
    straight = np.zeros(model.reading.size)
    for item, size in acting:
        straight += own_columns(item, model.conditions) @ size
    effects = [_of_size(item, size) for item, size in acting]
    moved = turned(model, comparison.record, total("angle", effects, model.conditions))
    gain, inside = moved.split(parameters)
    axial = moved.conditions.input + tilt(moved, parameters)
    now = replace(moved.conditions, axial=axial, indicated=inside, gain=gain)
    whole = gain * (inside + total("output", effects, now))
    return whole - np.multiply(*model.split(parameters)) - straight, straight


def is_possible(instance: Instance, size: Array) -> bool:
    """Whether no amplitude is below what it can be, as a width below zero is."""
    return all(
        value >= p.minimum for p, value in zip(instance.amplitudes, size.tolist(), strict=True)
    )


def _of_size(instance: Instance, size: Array) -> Disturbance:
    own = zip(instance.amplitudes, size.tolist(), strict=True)
    none = dict.fromkeys((p.name for p in instance.effect.amplitudes), 0.0)
    return Disturbance(instance.effect, {**none, **instance.shape, **{p.name: v for p, v in own}})
