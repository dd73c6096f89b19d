"""Effects beyond the law of small ones: a dead zone that silences readings, and any large one.

Within a dead zone readings indicate the bias alone, as if nothing accelerated the unit. In one
wider than the misalignment the positions across the input axis tell nothing of the misalignment,
which the others tell. Where these are so many that K1 and K3 do not take its width up, they tell
that as well.

The columns of the catalogue are those of small effects. A lag of some milliradians turns the
misalignment as well, and one of the output counts in the scale factor with it and not in that
without. The readings tell the sizes, the sizes what the exact law does beyond the columns, and the
readings less that tell the sizes anew: steps of Gauss and Newton with one matrix for all.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.discovery.base import BaseModel, base_model, over_scale_factor, tilt, turned
from accelcal.discovery.comparison import Comparison, compared
from accelcal.discovery.instance import Instance, instance_of, own_columns
from accelcal.discovery.noise.of_readings import ReadingNoise
from accelcal.discovery.solution import by_reading, solution
from accelcal.discovery.untold import fitted_sizes
from accelcal.effects.conditions import Conditions, conditions_of
from accelcal.effects.effect import Disturbance, Effect
from accelcal.effects.found import total
from accelcal.numerics.covariance import covariance_root
from accelcal.record import TumbleRecord

DEAD_ZONE = "dead-zone"

ALONG = 0.1
"""Acceleration along the input axis above which no dead zone of this kind is silent [g]."""

_LEFT = 0.1
"""Part of a disagreement that a dead zone may leave to be looked for in this way."""

_NOISE = 2.0
"""Sum of squares of a reading that it may leave in any case, over that of noise."""


def zone_among(effects: Iterable[Effect]) -> Instance | None:
    """The dead zone among some effects, if it is there."""
    return next((Instance(own, (1.0,), {}) for own in effects if own.id == DEAD_ZONE), None)


def across_the_axis(c: Conditions) -> Mask | None:
    """Readings across the input axis, shape (n,); None where that is all of them or none."""
    across = np.abs(c.input) < ALONG
    return across if across.any() and not across.all() else None


def silent_in(c: Conditions) -> Mask:
    """Readings that are taken as silent: those without any acceleration, shape (n,)."""
    return np.asarray((c.input == 0.0) & (c.cross == 0.0))


def silent_readings(
    record: TumbleRecord,
    reference: float,
    delta0: float,
    instances: Sequence[Instance],
    *,
    width: float | None = None,
    noise: ReadingNoise | None = None,
) -> Mask | None:
    """Find the readings that a dead zone silences, by what all others tell.

    It is one of the effects, with a given width [g], else with the one that the readings that are
    not silent tell. The noise is by default that of replicates. None where no reading is silent or
    the others do not tell the width, and without a given one where the effects leave much of the
    disagreement.
    """
    across = across_the_axis(conditions_of(record, reference, delta0))
    if across is None:
        return None
    beside = compared(record, reference, delta0, tuple(instances), noise=noise, silent=across)
    sizes = fitted_sizes(beside, instances)
    place = next(i for i, item in enumerate(instances) if item.effect.id == DEAD_ZONE)
    is_shown = bool(sizes.shown[sum(map(len, sizes.of_each[:place]))])
    if width is None:
        if not is_shown:
            return None
        left = beside.seen - sizes.linear @ sizes.whole
        if left @ left > max(_LEFT * float(beside.seen @ beside.seen), _NOISE * left.size):
            return None
        width = float(sizes.of_each[place][0])
    heard = _heard(beside)  # silent readings too have an acceleration along the true input axis
    found = solution(beside, instances).parameters[: len(heard.names)]
    silent = across & (np.abs(heard.conditions.input + tilt(heard, found)) < width)
    # a width that shows where nothing is silent at some levels alone
    return silent if silent.any() and (is_shown or (across & ~silent).any()) else None


def _heard(comparison: Comparison) -> BaseModel:
    """The base model of the record if no reading were silent."""
    model = comparison.model
    return base_model(comparison.record, model.T0, model.delta0, apart=model.apart)


def silent_by(
    record: TumbleRecord,
    reference: float,
    delta0: float,
    known: Sequence[Disturbance],
    *,
    own: bool = True,
) -> Mask | None:
    """Find the readings that a dead zone among known effects silences, see `silent_readings`.

    Its threshold is the known one if that is of the `own` unit, else as the readings tell it.
    """
    widths = [item.values["threshold"] for item in known if item.effect.id == DEAD_ZONE]
    if not widths or not widths[0]:
        return None
    return silent_readings(
        record,
        reference,
        delta0,
        [instance_of(item) for item in known],
        width=widths[0] if own else None,
    )


def unheard(comparison: Comparison, instances: Sequence[Instance]) -> tuple[Array, Array]:
    """Find what silent readings would indicate beside their bias, as all others tell it.

    Returns
    -------
    ndarray, shape (n,)
        What they lack, zero for all others [g].
    ndarray, shape (n, k)
        Its change by one standard uncertainty of each of k combinations of coefficients [g].
    """
    model = comparison.model
    silent = silent_in(model.conditions).astype(np.float64)
    if not silent.any():
        return silent, np.empty((silent.size, 0))
    whole, fit = _heard(comparison), solution(comparison, instances)
    parameters = fit.parameters[: len(model.names)]
    lacking = np.multiply(*whole.split(parameters)) - np.multiply(*model.split(parameters))
    slopes = silent[:, None] * (whole.jacobian(parameters) - model.jacobian(parameters))
    own = np.flatnonzero(slopes.any(axis=0))
    by_readings = by_reading(comparison, fit)[own]
    return silent * lacking, slopes[:, own] @ covariance_root(by_readings @ by_readings.T)


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
        found, straight = _beyond(comparison, instances, sizes, parameters)
        before, moved = moved, float(np.linalg.norm(space.whiten(found - beyond)))
        if not moved < 0.5 * before:
            return None
        beyond = found
    if np.linalg.norm(space.whiten(beyond)) < _SEEN:
        return None
    larger = [(1.0 + _STEP) * size for size in sizes]
    further, longer = _beyond(comparison, instances, larger, parameters)
    bend, step = space.see(further - beyond), space.see(longer - straight)
    if bend @ bend > _BEND**2 * (step @ step):
        return None
    # the sizes are told over the scale factor of readings that are without this, which is another
    nominal = over_scale_factor(now.model).nominal
    change = (nominal - model.nominal) * straight - model.nominal * beyond
    return replace(record, output=record.output + change)


def _beyond(
    comparison: Comparison,
    instances: Sequence[Instance],
    sizes: Sequence[Array],
    parameters: Array,
) -> tuple[Array, Array]:
    """What effects of some sizes do beyond their columns, and by their columns [g].

    An effect on the temperature does nothing, as the laws of the model are straight on either side.
    """
    model = comparison.model
    acting = [
        (item, size)
        for item, size in zip(instances, sizes, strict=True)
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
