"""Readings within a dead zone: they indicate the bias alone, as if nothing accelerated the unit.

In a dead zone wider than the misalignment the positions across the input axis tell nothing of the
misalignment, which the others tell. Where these are so many that K1 and K3 do not take its width
up, they tell that as well.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.discovery.base import BaseModel, base_model, tilt
from accelcal.discovery.comparison import Comparison, compared
from accelcal.discovery.instance import Instance, instance_of
from accelcal.discovery.noise.of_readings import ReadingNoise
from accelcal.discovery.solution import by_reading, solution
from accelcal.discovery.untold import fitted_sizes
from accelcal.effects.conditions import Conditions, conditions_of
from accelcal.effects.effect import Disturbance, Effect
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
