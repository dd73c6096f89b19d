"""What is slow and follows no law of the catalogue: it wanders, or drifts anew in each run.

A walk looks like a step, a drift or a warm-up, and no test of fit tells it from a small one. The
likelihoods do: in place of the effect stands a bias, scale factor or misalignment of each run of
which the power falls with the frequency (IEEE 1293: bias instability, random walk), of whatever
size suits the readings best.

It may pass for noise where nothing disagrees. Noise of the readings may have a memory, of up to
half from one to the next. What is slower is none of theirs. The means of the cycles show it best,
so that nothing but what is the same in all strokes is taken out before.

In a chamber that has not settled scale factor and bias drift anew in each run. Without a second
temperature nobody knows what a degree does to them, so that no entry of the catalogue says what a
drift of the chamber looks like: it is told as what it does.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.columns import (
    SMALL_UNITS,
    coefficient_columns,
    dummies,
    orthonormal,
    repeated,
    squares_in,
    without,
)
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.explanation import CONTRADICTION, chance_beside
from accelcal.discovery.family import Family, agrees
from accelcal.discovery.instance import Instance, columns_of
from accelcal.discovery.unnamed.beside_noise import MOST, Kind, tried
from accelcal.effects.conditions import Conditions
from accelcal.numerics.grouping import distinct
from accelcal.results.findings import Unexplained
from accelcal.units import HOUR, MICRO

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


_MEMORY = (0.0, 0.5)
"""Correlations of neighbouring readings that their noise may have."""

_TRIED = np.geomspace(0.2, 2000.0, 14)
"""Sizes of the wandering that are tried, in standard deviations of a reading."""

_SHARE = 0.2
"""Part of the false-alarm rate that is for something slow."""

_WEIGHTS = {"bias": 1.0, "scale factor": 0.5, "misalignment": 0.5}


def slow(
    comparison: Comparison, instances: Sequence[Instance], alpha: float, seed: int = 0
) -> Unexplained | None:
    """Find a bias, a scale factor or a misalignment that wanders beside some effects.

    There is none where noise with a memory of half often looks like it, at a false-alarm rate
    alpha, or where there are more than 600 degrees of freedom.
    """
    c, jacobian = comparison.model.conditions, comparison.model.jacobian(comparison.parameters)
    repeats = repeated(c, comparison.record.mounting)
    if comparison.space.size - repeats.shape[1] > MOST:
        return None
    taken = np.hstack([repeats, jacobian, columns_of(instances, c)])
    kinds = _kinds(comparison)
    trial = tried(comparison, taken, list(kinds.values()), _MEMORY, _SHARE, seed)
    best = trial.best(alpha)
    if best is None:
        return None
    what, (kind, _) = list(kinds.items())[best]
    see, white, (which, *_) = trial.likeliest(best)
    columns = kind.columns(0)
    acting = see @ columns
    normal = acting.T @ acting + np.eye(kind.each) / kind.variances[which]
    change = columns @ np.linalg.solve(normal, acting.T @ white)
    lost = comparison.seen - comparison.space.see(change)
    share = 1.0 - float(lost @ lost) / float(comparison.seen @ comparison.seen)
    acts = c.gain * coefficient_columns(c)[what]
    rms = float(np.sqrt((change @ change) / (acts @ acts)))
    size = size_in_a_run(what, rms)
    told = f"something slow: most like a {what} that wanders, as a random walk, by {size}"
    return Unexplained(told, min(max(share, 0.0), 1.0), float(trial.p_values[best]))


def _kinds(comparison: Comparison) -> dict[str, tuple[Kind, float]]:
    """One disturbance of each kind, of all half waves in each run, with its weight."""
    from scipy.sparse import csr_array  # type: ignore[import-untyped]

    c = comparison.model.conditions
    waves, frequency = half_waves(c)

    def acting(column: Array) -> Kind:
        rows = ((c.gain * column)[:, None] * waves / frequency).T
        return Kind(len(rows), csr_array(rows), tuple((_TRIED**2).tolist()), lambda *_: "")

    return {
        what: (acting(column), _WEIGHTS[what]) for what, column in coefficient_columns(c).items()
    }


_SCALE, _BIAS = "the scale factor", "the bias"
_UNITS = {_SCALE: "ppm/h", _BIAS: "ug/h"}


def drift_anew(family: Family, alpha: float) -> Unexplained | None:
    """Find drifts of them from the start of each run that leave nothing but noise, if needed.

    They have one rate in all runs, else one in each, which takes both of them. There is none in a
    record of one run, where entries of the catalogue say as much, nor where the temperature slopes
    are known, which the chamber's has.
    """
    c, labels = family.comparison.model.conditions, family.comparison.record.run_labels
    if len(labels) < 2 or c.per_degree.any():
        return None
    time = (c.gain * c.run_time / HOUR)[:, None]
    bias, scale = time, time * c.indicated[:, None]
    runs = dummies(c.run)
    for columns in (
        {_SCALE: scale},
        {_SCALE: scale, _BIAS: bias},
        {_SCALE: runs * scale, _BIAS: runs * bias},
    ):
        p_value = _chance(family, list(columns.values()), alpha)
        if p_value is not None:
            return _told(family, columns, p_value)
    return None


def _chance(family: Family, columns: Sequence[Array], alpha: float) -> float | None:
    """Largest chance of noise of one beside the others; None where they do not explain all."""
    space = family.space
    shown = [space.see(each) for each in columns]
    if not agrees(family, orthonormal(np.hstack(shown)), CONTRADICTION * alpha):
        return None
    largest = 0.0
    for place, own in enumerate(shown):
        others = orthonormal(np.hstack([space.nothing(), *shown[:place], *shown[place + 1 :]]))
        largest = max(largest, chance_beside(family.comparison, own, others) * family.tests)
    return largest if largest < alpha else None


def _told(family: Family, columns: Mapping[str, Array], p_value: float) -> Unexplained:
    space, seen = family.space, family.comparison.seen
    shown = space.see(np.hstack(list(columns.values())))
    sizes = np.linalg.lstsq(shown, seen, rcond=None)[0] * MICRO
    rates = " and ".join(
        f"{what} drifts by {', '.join(f'{size:.3g}' for size in own)} {_UNITS[what]}"
        for what, own in zip(columns, np.split(sizes, len(columns)), strict=True)
    )
    runs = "" if sizes.size == len(columns) else ", in the order of the runs"
    return Unexplained(
        f"{rates}, anew from the start of each run{runs}, as in a chamber that has not settled or a"
        " unit that warms up; runs at another temperature, or the actual temperature of each"
        " reading, would tell",
        squares_in(orthonormal(shown), seen) / float(seen @ seen),
        p_value,
    )
