"""What wanders, as of flicker noise or a random walk, in place of an effect that was named.

A walk looks like a step, a drift or a warm-up, and no test of fit tells it from a small one. The
likelihoods do: in place of the effect stands a bias, scale factor or misalignment of each run of
which the power falls with the frequency (IEEE 1293: bias instability, random walk), of whatever
size suits the readings best.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.columns import SMALL_UNITS, coefficient_columns, dummies
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.instance import Instance
from accelcal.discovery.spans import orthonormal, without
from accelcal.effects.conditions import Conditions
from accelcal.numerics.grouping import distinct
from accelcal.units import MICRO

LIKELY, POSSIBLE = 0.1, 0.001
"""Likelihood of what wanders, over that with an effect: from the first on the effect gets no
name, from the second on its name is not sure."""

_POWERS = (1.0, 2.0)
"""Power of flicker noise and of a random walk falls with so much of the frequency."""

_FASTEST = 24
"""Half waves in a run beyond which no slow noise is told from that of single readings."""

_SIZES = np.geomspace(0.01, 1000.0, 51)
"""Sizes of the wandering that are tried, in standard deviations of a reading."""

_ABSURD = 1e-3
"""Wandering in a run of which no accelerometer and no stand is capable [g, 1 or rad]."""


class Wandering(NamedTuple):
    """A coefficient that wanders in place of an effect."""

    instead_of: Instance
    log_likelihood: float  # natural logarithm of its likelihood over that with the effect
    what: str  # what would wander: bias, scale factor or misalignment
    rms: float  # by how much it would wander in a run [g, 1 or rad]

    def is_as_likely(self, bound: float) -> bool:
        """Tell whether its likelihood is more than so much of that with the effect."""
        return self.log_likelihood > float(np.log(bound))


def size_in_a_run(what: str, rms: float) -> str:
    """Tell by how much something wanders, and whether nothing wanders by so much.

    Examples
    --------
    >>> size_in_a_run("bias", 3.41e-5)
    '34 ug rms in a run'
    """
    told = f"{float(f'{rms * MICRO:.2g}'):g} {SMALL_UNITS[what]} rms in a run"
    if rms > _ABSURD:
        told += " (absurdly much: look for a fault of the test)"
    return told


def wandering(comparison: Comparison, instances: Sequence[Instance]) -> Iterator[Wandering]:
    """Find what would wander likeliest in all runs, in place of each of some effects."""
    yield from _wandering(comparison, instances, [slice(None)] * len(instances))


def wandering_in_its_run(comparison: Comparison, instances: Sequence[Instance]) -> list[Wandering]:
    """Find what would wander likeliest in the run of each step alone, in place of it."""
    c = comparison.model.conditions
    runs = distinct(c.run)
    own: list[slice | None] = [None] * len(instances)
    for place, item in enumerate(instances):
        if item.effect.id == "bias-step":
            run = c.run[c.order[int(item.shape["reading"]) - 1]]
            own[place] = slice(int(np.searchsorted(runs, run)), None, runs.size)
    return list(_wandering(comparison, instances, own)) if any(own) else []


def _wandering(
    comparison: Comparison, instances: Sequence[Instance], own: Sequence[slice | None]
) -> Iterator[Wandering]:
    """Try some of the waves in place of each effect that has any of its own."""
    space, c, sigma = comparison.space, comparison.model.conditions, comparison.noise.sigma
    units = comparison.directions(*instances)
    with_all = _log_likelihood(without(comparison.seen, orthonormal(units)))
    waves, frequency = half_waves(c)
    seen = {
        what: space.see((c.gain * column)[:, None] * waves * sigma)
        for what, column in coefficient_columns(c).items()
    }
    for place, item in enumerate(instances):
        if (kept := own[place]) is None:
            continue
        others = orthonormal(np.delete(units, place, axis=1))
        rest = without(comparison.seen, others)
        log, rms, what = max(
            (*_likeliest(rest, without(columns[:, kept], others), frequency[kept] ** -power), what)
            for what, columns in seen.items()
            for power in _POWERS
        )
        yield Wandering(item, log - with_all, what, rms * sigma)


def _log_likelihood(white: Array) -> float:
    return -0.5 * float(white @ white)


def half_waves(c: Conditions) -> tuple[Array, Array]:
    """Cosines of mean square 1 along each run, and how many half waves each has."""
    runs = dummies(c.run)
    place = np.zeros(c.number.size)
    for run in runs.T > 0.0:
        place[run] = (np.argsort(np.argsort(c.number[run])) + 0.5) / run.sum()
    count = min(_FASTEST, int(runs.sum(axis=0).max()) // 2)
    frequency = np.repeat(np.arange(1.0, count + 1.0), runs.shape[1])
    waves = np.sqrt(2.0) * np.cos(np.pi * frequency * place[:, None])
    return np.tile(runs, count) * waves, frequency


def _likeliest(rest: Array, columns: Array, power: Array) -> tuple[float, float]:
    """Largest likelihood of a random part with such a spectrum, and its rms over that of noise."""
    acting = columns * np.sqrt(power)
    values, vectors = np.linalg.eigh(acting.T @ acting)
    good = values > 1e-9 * values[-1]
    values, shown = values[good], (vectors[:, good].T @ (acting.T @ rest)) ** 2 / values[good]
    variance = 1.0 + _SIZES[:, None] ** 2 * values
    gain = 0.5 * (shown * (1.0 - 1.0 / variance) - np.log(variance)).sum(axis=1)
    best = int(np.argmax(gain))
    in_a_run = float(np.sqrt(power.sum() / (power == 1.0).sum()))
    return _log_likelihood(rest) + float(gain[best]), float(_SIZES[best]) * in_a_run
