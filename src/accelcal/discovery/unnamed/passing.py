"""A disturbance that comes and goes, and passes for noise: of a memory, or with heavy tails.

It is looked for in the pure error, which no declared error and nothing that repeats is in. There
stands the noise of an AR(1) process beside the disturbance against such noise alone, each with the
correlation that suits it best.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from accelcal.arrays import Array, Ints
from accelcal.discovery.columns import (
    SMALL_UNITS,
    coefficient_columns,
    dummies,
    first_largest,
    orthonormal,
    saturated,
    squares_in,
)
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.factors import structure
from accelcal.discovery.instance import Instance, columns_of
from accelcal.discovery.unnamed.beside_noise import MOST, Kind, tried
from accelcal.effects.conditions import Conditions
from accelcal.numerics.grouping import grouped
from accelcal.results.findings import Unexplained
from accelcal.units import MICRO

_RHOS = (0.0, 0.2, 0.4, 0.6, 0.75, 0.87, 0.95)
"""Correlations of neighbouring readings that are tried."""

_SLOWEST, _FASTEST = 1.5, 30.0
"""Periods in the longest run between which oscillations are looked for."""

_FEWEST, _GROWTH = 4, 1.5
"""Readings of the shortest shift, as fewer are outliers, and the ratio of the lengths tried."""

_RATIOS = (2.0, 3.0, 4.0, 6.0, 9.0, 14.0)
"""Noise of a stroke over that of the others that is tried."""

_DECAYS = (0.1, 0.2, 0.4, np.inf)
"""Time constants of a bias that settles in one run, over the longest; of no end, it drifts."""

_WEIGHTS = {
    "oscillations": 0.3,
    "decays": 1.0,
    "shifts of the bias": 1.0,
    "other shifts": 0.5,
    "strokes": 1.0,
}
"""Weights of the kinds: least where those of a size that matters stand out most."""


def passing(
    comparison: Comparison, instances: Sequence[Instance], alpha: float, seed: int = 0
) -> Unexplained | None:
    """Find what oscillates, settles or is shifted for a time, or a stroke with larger noise.

    Beside the effects that were found, the comparison agrees but for that. There is none where
    noise of an AR(1) process often looks like it, at a false-alarm rate alpha, or where the
    readings have more than 600 degrees of freedom of pure error.
    """
    if comparison.space.dof > MOST:
        return None
    c, labels = comparison.model.conditions, comparison.record.run_labels
    bias, *others = SMALL_UNITS
    found = {
        "oscillations": oscillations(c, labels),
        "decays": _decays(c, labels),
        "shifts of the bias": _shifts(c, labels, [bias]),
        "other shifts": _shifts(c, labels, others),
        "strokes": _strokes(c, labels),
    }
    kinds = [(kind, _WEIGHTS[what]) for what, kind in found.items() if kind.actions.size]
    if not kinds:
        return None
    saturation = saturated(c, comparison.record.mounting)
    jacobian = comparison.model.jacobian(comparison.parameters)
    repeats = np.hstack([saturation, jacobian, columns_of(instances, c)])
    trial = tried(comparison, repeats, kinds, _RHOS, 1.0, seed)
    best = trial.best(alpha)
    if best is None:
        return None
    see, white, alike = trial.likeliest(best)

    def explained(which: int) -> tuple[float, str]:
        kind = kinds[best][0]
        place, variance = divmod(which, len(kind.variances))
        columns = kind.columns(place)
        sizes = np.linalg.lstsq(see @ columns, white)[0]
        told = kind.told(place, kind.variances[variance], columns @ sizes)
        seen = orthonormal(comparison.space.see(columns))
        return squares_in(seen, comparison.seen) / float((comparison.seen**2).sum()), told

    # of two strokes alike, pure error tells the difference alone: the model tells which is shifted
    each = [explained(which) for which in alike]
    share, told = each[first_largest(np.array([own for own, _ in each]))]
    return Unexplained(told, share, float(trial.p_values[best]))


# -- kinds of disturbances -------------------------------------------------------------------------


def oscillations(
    c: Conditions,
    labels: Sequence[str],
    slowest: float = _SLOWEST,
    quickest: float = _FASTEST,
) -> Kind:
    """A bias of one period in all runs, with a phase and a size in each.

    The slowest and the quickest have so many periods in the longest run.
    """
    from scipy.sparse import csr_array  # type: ignore[import-untyped]

    runs = dummies(c.run)
    longest, most = float(c.run_time.max()), float(runs.sum(axis=0).max())
    fastest = min(quickest, most / 2.0) if longest > 0.0 else 0.0
    counts = np.arange(slowest, fastest, 0.5)
    phase = 2.0 * np.pi * c.run_time[:, None] * counts / (longest or 1.0)
    waves = np.stack([np.cos(phase), np.sin(phase)], axis=2)
    columns = waves[:, :, :, None] * runs[:, None, None, :]

    def told(place: int, _: float, bias: Array) -> str:
        period = longest / counts[place] / 60.0
        more = " or more" if place == 0 else ""
        return structure(c, labels, f"the bias oscillates, period {period:.3g} min{more}", bias)

    actions = c.gain * columns.reshape(c.gain.size, -1).T
    return Kind(2 * runs.shape[1], csr_array(actions), (np.inf,), told)


def once(c: Conditions, labels: Sequence[str]) -> Kind:
    """All that is shifted for a time, steps, or settles in one run, as one kind."""
    from scipy.sparse import vstack

    bias, *others = SMALL_UNITS
    kinds = (_shifts(c, labels, [bias, *others]), _steps(c, labels, others), _decays(c, labels))
    tellers = [(kind.told, i) for kind in kinds for i in range(kind.actions.shape[0])]

    def told(place: int, variance: float, change: Array) -> str:
        teller, which = tellers[place]
        return teller(which, variance, change)

    return Kind(1, vstack([kind.actions for kind in kinds]), (np.inf,), told)


def _decays(c: Conditions, labels: Sequence[str]) -> Kind:
    """A bias that settles, or drifts, from the start of one run alone: in each, it is a warm-up."""
    runs = [np.flatnonzero(own) for own in dummies(c.run).T]
    longest = float(c.run_time.max())
    found = [(own, part) for own in runs for part in _DECAYS if longest and len(runs) > 1]

    def acting(own: Ints, part: float) -> Array:
        time = c.run_time[own] / longest
        return np.exp(-time / part) if np.isfinite(part) else time

    def told(place: int, _: float, bias: Array) -> str:
        own, part = found[place]
        first, last = own[[np.argmin(c.run_time[own]), np.argmax(c.run_time[own])]]
        where = f"in run {labels[c.run[first]]} alone"
        if np.isinf(part):
            rate = bias[last] * MICRO / c.run_time[last] * 3600.0
            return f"the bias drifts {where}, by {rate:+.3g} ug/h; repeat that run"
        return (
            f"the bias settles {where}, from {bias[first] * MICRO:+.3g} ug at its start with a time"
            f" constant of about {part * longest / 60.0:.2g} min; repeat that run"
        )

    rows = [(own, c.gain[own] * acting(own, part)) for own, part in found]
    return Kind(1, _acting(rows, c), (np.inf,), told)


def _shifts(c: Conditions, labels: Sequence[str], coefficients: Sequence[str]) -> Kind:
    """A coefficient that is another in some readings that follow each other, of half a run.

    A shift of the bias takes four of them, one of the others a head that turns by a quarter.
    """

    def told(own: Ints, by: str) -> str:
        first, last = (f"{c.angle[i]:g} deg of stroke {c.stroke[i]}" for i in own[[0, -1]])
        return (
            f"is shifted for a time, by {by} in {own.size} readings of run"
            f" {labels[c.run[own[0]]]}, from {first} to {last}"
        )

    return _changed(c, coefficients, [(own, told) for own in _stretches(c)])


def _steps(c: Conditions, labels: Sequence[str], coefficients: Sequence[str]) -> Kind:
    """A coefficient that is another from some reading on, to the end of its run or of the record.

    A step of the bias is in the catalogue.
    """

    def told(until: str, own: Ints, by: str) -> str:
        return (
            f"steps by {by} at {c.angle[own[0]]:g} deg of stroke {c.stroke[own[0]]} in run"
            f" {labels[c.run[own[0]]]}, to the end of the {until}"
        )

    return _changed(c, coefficients, [(own, partial(told, until)) for own, until in _ends(c)])


def _changed(
    c: Conditions,
    coefficients: Sequence[str],
    readings: Sequence[tuple[Ints, Callable[[Ints, str], str]]],
) -> Kind:
    """Coefficients that are others in some readings, and how each is told, by how much it is."""
    columns = coefficient_columns(c)
    acting = {what: c.gain * columns[what] for what in coefficients}
    found = [
        (what, own, told)
        for own, told in readings
        for what, column in acting.items()
        if what == "bias" or np.ptp(column[own]) > 1.0
    ]

    def said(place: int, _: float, change: Array) -> str:
        what, own, told = found[place]
        clearest = own[np.argmax(np.abs(acting[what][own]))]
        size = change[clearest] / acting[what][clearest] * MICRO
        return f"the {what} {told(own, f'{size:+.3g} {SMALL_UNITS[what]}')}"

    rows = [(own, acting[what][own]) for what, own, _ in found]
    return Kind(1, _acting(rows, c), (np.inf,), said)


def _ends(c: Conditions) -> Iterator[tuple[Ints, str]]:
    """Readings from one on to the end of its run, where they are most of it, or of the record."""
    last = c.order.size - 1
    for first, reading in enumerate(c.order):
        run = np.flatnonzero(c.run[c.order] == c.run[reading])
        if run[-1] < last and first > 0:
            yield c.order[first:], "record"
        if run[0] < first and run[-1] + 1 - first > run.size // 2:
            yield c.order[first : run[-1] + 1], "run"


def _stretches(c: Conditions) -> Iterator[Ints]:
    """Readings that follow each other, of each stroke and of other lengths and places."""
    for run in grouped(c.run)[0]:
        own = c.order[c.run[c.order] == run]
        for stroke in grouped(c.stroke[own])[0]:
            of_stroke = own[c.stroke[own] == stroke]
            if _FEWEST <= of_stroke.size <= own.size // 2:
                yield of_stroke
        length = _FEWEST
        while length <= own.size // 2:
            for start in range(0, own.size - length + 1, max(1, length // _FEWEST)):
                yield own[start : start + length]
            length = int(_GROWTH * length)


def _strokes(c: Conditions, labels: Sequence[str]) -> Kind:
    """Readings of one stroke of a run that have larger noise."""
    strokes = map(np.flatnonzero, dummies(c.run, c.stroke).T)
    found = [own for own in strokes if own.size >= _FEWEST]
    most = max((own.size for own in found), default=0)
    singly = [own[i : i + 1] for own in found for i in range(most)]  # none beyond the end

    def told(place: int, variance: float, _: Array) -> str:
        first = found[place][0]
        return (
            f"the noise of stroke {c.stroke[first]} in run {labels[c.run[first]]} is about"
            f" {np.sqrt(1.0 + variance):.0f} times that of the other readings"
        )

    actions = _acting([(own, np.ones(own.size)) for own in singly], c)
    return Kind(most, actions, tuple(ratio**2 - 1.0 for ratio in _RATIOS), told)


def _acting(found: Sequence[tuple[Ints, Array]], c: Conditions) -> Any:
    """Rows that act on some readings, a sparse array of shape (rows, n)."""
    from scipy.sparse import csr_array

    ends = np.cumsum([0, *(own.size for own, _ in found)])
    readings = np.concatenate([np.zeros(0, dtype=np.intp), *(own for own, _ in found)])
    values = np.concatenate([np.zeros(0), *(action for _, action in found)])
    return csr_array((values, readings, ends), (len(found), c.number.size))
