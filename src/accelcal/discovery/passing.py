"""A disturbance that comes and goes, and passes for noise: of a memory, or with heavy tails.

It is looked for in the pure error, which no declared error and nothing that repeats is in. There
stands the noise of an AR(1) process beside the disturbance against such noise alone, each with the
correlation that suits it best.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from accelcal.arrays import Array, Ints
from accelcal.discovery.columns import coefficient_columns, dummies, saturated
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.family import NEW, independent
from accelcal.discovery.instance import Instance, column_of
from accelcal.discovery.noise import memory
from accelcal.discovery.spans import lengths, orthonormal, squares_in, without
from accelcal.discovery.where import structure
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

_TAILS = 9.0
"""Degrees of freedom of the Student distribution of the noise that is drawn, unless the tails of
the readings are heavier: a hundred readings do not tell that they are lighter."""

_MOST = 600
"""Degrees of freedom of pure error above which nothing is looked for, as it would take minutes."""

SMALL_UNITS = {"bias": "ug", "scale factor": "ppm", "misalignment": "urad"}

_FIRST, _DRAWS, _POSSIBLE = 99, 999, 0.04
"""First draws of noise; all of them, made where the first leave no larger a chance than that."""


class _Kind(NamedTuple):
    """Disturbances of one kind, s of them with k amplitudes each."""

    each: int  # amplitudes
    actions: Any  # sparse array, (s * k, n), as most act on a few readings [g per g]
    variances: tuple[float, ...]  # of the amplitudes that are tried, over that of the noise
    told: Callable[[int, float, Array], str]  # of which one, its variance, what it does [g]

    def columns(self, place: int) -> Array:
        """What the amplitudes of one of them do, shape (n, k)."""
        own = self.actions[place * self.each : (place + 1) * self.each]
        return np.asarray(own.toarray().T)


class _Noise(NamedTuple):
    """Noise of one correlation, in d dimensions of pure error."""

    whitener: Array  # (d, d)
    log_determinant: float
    kinds: tuple[_Seen, ...]


class _Seen(NamedTuple):
    """A kind in whitened pure error, v variances of s disturbances."""

    bases: Array  # (v * s, k, d): what is taken up is the sum of squares in these
    penalties: Array  # (v * s, 1): half of the logarithms of the variances


def passing(
    comparison: Comparison, instances: Sequence[Instance], alpha: float, seed: int = 0
) -> Unexplained | None:
    """Find what oscillates or is shifted for a time, or a stroke with larger noise.

    Beside the effects that were found, the comparison agrees but for that. There is none where
    noise of an AR(1) process often looks like it, at a false-alarm rate alpha, or where the
    readings have more than 600 degrees of freedom of pure error.
    """
    if comparison.space.dof > _MOST:
        return None
    c, labels = comparison.model.conditions, comparison.record.run_labels
    left = _left_by_what_repeats(comparison, instances)
    bias, *others = SMALL_UNITS
    kinds = [
        _oscillations(c, labels),
        _shifts(c, labels, [bias]),
        _shifts(c, labels, others),
        _strokes(c, labels),
    ]
    kinds = [kind for kind in kinds if kind.actions.size]
    if not kinds:
        return None
    relative = comparison.noise.relative
    noises = [_noise(c, left, kinds, rho, relative) for rho in _RHOS]
    error = left.T @ comparison.model.residual(comparison.parameters)
    gains, alone = _gains(noises, error[:, None])
    root = left.T @ np.linalg.cholesky(memory(c, _RHOS[int(alone[0])], relative))
    tails = min(comparison.noise.tails, _TAILS)
    rng = np.random.default_rng(seed)
    p_values, beyond = _chances(
        noises,
        gains[:, 0],
        lambda draws: root @ independent(tails, rng, (root.shape[1], draws)),
    )
    if p_values.min() >= alpha:
        return None
    best = int(np.argmax(np.where(p_values < alpha, beyond, -np.inf)))
    noise, which = _likeliest(noises, error, best)
    see = noise.whitener @ left.T
    told, columns = _described(kinds[best], which, see, noise.whitener @ error)
    seen = orthonormal(comparison.space.see(columns))
    share = squares_in(seen, comparison.seen) / float((comparison.seen**2).sum())
    return Unexplained(told, share, float(p_values[best]))


def shift_in_place_of_one(
    comparison: Comparison, instances: Sequence[Instance], p_value: float
) -> Unexplained | None:
    """Find a shift for a time that explains the readings much better than one of some effects.

    There is none where none explains better by more than the search for the best of many shifts
    gains, or where there are more than 600 degrees of freedom. The p-value is the chance that noise
    alone disagrees as much with the model.
    """
    space = comparison.space
    kind = _shifts(comparison.model.conditions, comparison.record.run_labels, [*SMALL_UNITS])
    columns = kind.actions.toarray().T
    if space.dof > _MOST or not columns.size:
        return None
    units, seen = comparison.directions(*instances), space.see(columns)
    for place in range(len(instances)):
        taken = orthonormal(np.delete(units, place, axis=1))
        left, own = without(comparison.seen, taken), orthonormal(without(units[:, [place]], taken))
        shifts = without(seen, taken)
        length = lengths(shifts)
        new = length > NEW * lengths(seen)
        sizes = np.where(new, shifts.T @ left / np.where(new, length, 1.0) ** 2, 0.0)
        squares = (sizes * length) ** 2
        best = int(np.argmax(squares))
        if squares[best] - squares_in(own, left) >= 2.0 * np.log(squares.size):
            told = kind.told(best, np.inf, sizes[best] * columns[:, best])
            return Unexplained(told, float(squares[best] / (comparison.seen**2).sum()), p_value)
    return None


def _left_by_what_repeats(comparison: Comparison, instances: Sequence[Instance]) -> Array:
    """Orthonormal basis of pure error that model and effects leave too, shape (n, d)."""
    c = comparison.model.conditions
    columns = [column_of(item, c)[:, None] for item in instances]
    saturation = saturated(c, comparison.record.mounting)
    jacobian = comparison.model.jacobian(comparison.parameters)
    taken = orthonormal(np.hstack([saturation, jacobian, *columns]))
    return np.asarray(np.linalg.qr(taken, mode="complete")[0][:, taken.shape[1] :])


def _described(kind: _Kind, which: int, see: Array, white: Array) -> tuple[str, Array]:
    """Words for a disturbance of a kind, in the size that suits an error, and its columns."""
    variance, place = divmod(which, kind.actions.shape[0] // kind.each)
    columns = kind.columns(place)
    sizes = np.linalg.lstsq(see @ columns, white)[0]
    return kind.told(place, kind.variances[variance], columns @ sizes), columns


# -- kinds of disturbances -------------------------------------------------------------------------


def _oscillations(c: Conditions, labels: Sequence[str]) -> _Kind:
    """A bias of one period in all runs, with a phase and a size in each."""
    from scipy.sparse import csr_array  # type: ignore[import-untyped]

    runs = dummies(c.run)
    longest, most = float(c.run_time.max()), float(runs.sum(axis=0).max())
    fastest = min(_FASTEST, most / 2.0) if longest > 0.0 else 0.0
    counts = np.arange(_SLOWEST, fastest, 0.5)
    phase = 2.0 * np.pi * c.run_time[:, None] * counts / (longest or 1.0)
    waves = np.stack([np.cos(phase), np.sin(phase)], axis=2)
    columns = waves[:, :, :, None] * runs[:, None, None, :]

    def told(place: int, _: float, bias: Array) -> str:
        period = longest / counts[place] / 60.0
        return structure(c, labels, f"the bias oscillates, period {period:.3g} min", bias)

    actions = c.gain * columns.reshape(c.gain.size, -1).T
    return _Kind(2 * runs.shape[1], csr_array(actions), (np.inf,), told)


def _shifts(c: Conditions, labels: Sequence[str], coefficients: Sequence[str]) -> _Kind:
    """A coefficient that is another in some readings that follow each other, of half a run.

    A shift of the bias takes four of them, one of the others a head that turns by a quarter.
    """
    columns = coefficient_columns(c)
    acting = {what: c.gain * columns[what] for what in coefficients}
    found = [
        (what, own)
        for own in _stretches(c)
        for what, column in acting.items()
        if what == "bias" or np.ptp(column[own]) > 1.0
    ]

    def told(place: int, _: float, change: Array) -> str:
        what, own = found[place]
        first, last = (f"{c.angle[i]:g} deg of stroke {c.stroke[i]}" for i in own[[0, -1]])
        clearest = own[np.argmax(np.abs(acting[what][own]))]
        size = change[clearest] / acting[what][clearest] * MICRO
        return (
            f"the {what} is shifted for a time, by {size:+.3g} {SMALL_UNITS[what]} in {own.size}"
            f" readings of run {labels[c.run[own[0]]]}, from {first} to {last}"
        )

    return _Kind(1, _acting([(own, acting[what][own]) for what, own in found], c), (np.inf,), told)


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


def _strokes(c: Conditions, labels: Sequence[str]) -> _Kind:
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
    return _Kind(most, actions, tuple(ratio**2 - 1.0 for ratio in _RATIOS), told)


def _acting(found: Sequence[tuple[Ints, Array]], c: Conditions) -> Any:
    """Rows that act on some readings, a sparse array of shape (rows, n)."""
    from scipy.sparse import csr_array

    ends = np.cumsum([0, *(own.size for own, _ in found)])
    readings = np.concatenate([np.zeros(0, dtype=np.intp), *(own for own, _ in found)])
    values = np.concatenate([np.zeros(0), *(action for _, action in found)])
    return csr_array((values, readings, ends), (len(found), c.number.size))


# -- how likely they are ---------------------------------------------------------------------------


def _noise(
    c: Conditions, left: Array, kinds: Sequence[_Kind], rho: float, relative: Array | None
) -> _Noise:
    covariance = left.T @ memory(c, rho, relative) @ left
    whitener = np.linalg.inv(np.linalg.cholesky(covariance))
    seen = tuple(_seen(whitener @ left.T, kind) for kind in kinds)
    return _Noise(whitener, -2.0 * float(np.log(np.diag(whitener)).sum()), seen)


def _seen(see: Array, kind: _Kind) -> _Seen:
    seen = (kind.actions @ see.T).reshape(-1, kind.each, len(see))
    values, vectors = np.linalg.eigh(seen @ seen.mT)
    kept = values > 1e-6 * values.max()
    values = np.where(kept, values, 1.0)
    bases, penalties = [], []
    for variance in kind.variances:
        bases.append((vectors * (kept / np.sqrt(values + 1.0 / variance))[:, None]).mT @ seen)
        grown = np.log1p(variance * values) if np.isfinite(variance) else np.zeros_like(values)
        penalties.append(0.5 * (kept * grown).sum(axis=1))
    return _Seen(np.concatenate(bases), np.concatenate(penalties)[:, None])


def _likelihoods(noise: _Noise, errors: Array) -> tuple[Array, list[Array]]:
    """Logarithms for K errors with noise of any size: alone, (K,), beside each kind, (v * s, K)."""
    white = noise.whitener @ errors
    squares = (white**2).sum(axis=0)
    start, half = -0.5 * noise.log_determinant, 0.5 * len(white)
    beside = []
    for bases, penalties in noise.kinds:
        taken = ((bases.reshape(-1, len(white)) @ white) ** 2).reshape(*bases.shape[:2], -1)
        rest = np.maximum(squares - taken.sum(axis=1), 1e-12 * squares)
        beside.append(start - penalties - half * np.log(rest))
    return start - half * np.log(squares), beside


def _gains(noises: Sequence[_Noise], errors: Array) -> tuple[Array, Ints]:
    """Gain in likelihood by the best of each kind, (kinds, K), and which noise is best alone."""
    found = [_likelihoods(noise, errors) for noise in noises]
    alone = np.array([own for own, _ in found])
    beside = np.array([[kind.max(axis=0) for kind in own] for _, own in found])
    return beside.max(axis=0) - alone.max(axis=0), alone.argmax(axis=0)


def _chances(
    noises: Sequence[_Noise], gains: Array, draw: Callable[[int], Array]
) -> tuple[Array, Array]:
    """Chance that noise gains as much by any kind, and what is gained beyond nearly all noise.

    The kinds are judged together by the smallest chance that a draw of noise has among them: many
    of them see the same, so that their number would count too much.
    """
    found = np.empty((gains.size, 0))
    for draws in (_FIRST, _DRAWS - _FIRST):
        found = np.hstack([found, _gains(noises, draw(draws))[0]])
        above = (found >= gains[:, None]).sum(axis=1)
        if above.min() > _POSSIBLE * found.shape[1]:
            break
    ranks = found.shape[1] - np.argsort(np.argsort(found, axis=1), axis=1)
    smallest = ranks.min(axis=0)  # of the largest gain it is 1
    as_rare = (smallest <= above[:, None]).sum(axis=1)
    return (1.0 + as_rare) / (1.0 + found.shape[1]), gains - np.quantile(found, 0.99, axis=1)


def _likeliest(noises: Sequence[_Noise], error: Array, kind: int) -> tuple[_Noise, int]:
    """The noise, and which disturbance of a kind, that suit an error best."""
    found = np.array([_likelihoods(noise, error[:, None])[1][kind][:, 0] for noise in noises])
    rho, which = np.unravel_index(found.argmax(), found.shape)
    return noises[int(rho)], int(which)
