"""Disturbances beside noise with a memory: how likely, and how often noise looks like them.

The noise is that of an AR(1) process, of any size and one of some correlations, and of one size in
all runs or not. It stands beside a disturbance against such noise alone, each as it suits best.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from accelcal.arrays import Array, Ints
from accelcal.discovery.columns import orthonormal
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.family import independent
from accelcal.discovery.noise.of_readings import memory, relative_noise

MOST = 600
"""Degrees of freedom above which nothing is looked for, as it would take minutes."""

_TAILS = 9.0
"""Degrees of freedom of the Student distribution of the noise that is drawn, unless the tails of
the readings are heavier: a hundred readings do not tell that they are lighter."""

_ALIKE = 1e-8
"""Sums of squares that differ by no more than this part are the same but for rounding."""

_DRAWS = ((99, 0.04), (900, 0.005), (1000, 0.0))
"""Draws of noise, and the chance below which more are made."""


class Kind(NamedTuple):
    """Disturbances of one kind, s of them with k amplitudes each."""

    each: int  # amplitudes
    actions: Any  # sparse array, (s * k, n), as most act on a few readings [g per g]
    variances: tuple[float, ...]  # of the amplitudes that are tried, over that of the noise
    told: Callable[[int, float, Array], str]  # of which one, its variance, what it does [g]

    def columns(self, place: int) -> Array:
        """What the amplitudes of one of them do, shape (n, k)."""
        own = self.actions[place * self.each : (place + 1) * self.each]
        return np.asarray(own.toarray().T)


class Noise(NamedTuple):
    """Noise of one correlation, in d dimensions of pure error."""

    whitener: Array  # (d, d)
    log_determinant: float
    kinds: tuple[_Seen, ...]


class _Seen(NamedTuple):
    """A kind in whitened pure error, v variances of s disturbances."""

    bases: Array  # (s, k, d): what is taken up is the weighted sum of squares in these
    weights: Array  # (s, v, k)
    penalties: Array
    """By how much each of v variances makes the sum of squares that is left count more, (s, v, 1):
    its logarithm is that of the determinant over the degrees of freedom."""


class Trial(NamedTuple):
    """Kinds of disturbances beside noise, for the readings that something leaves."""

    left: Array  # orthonormal basis of what is left of the readings, (n, d)
    error: Array  # the readings in it, (d,) [g]
    noises: tuple[Noise, ...]  # noise of each correlation that is tried
    p_values: Array
    """Chance that noise gains as much by any kind as the readings by this one, over the share that
    the kinds have of the false-alarm rate, (kinds,)."""
    beyond: Array  # gain in likelihood by each kind beyond that of nearly all noise, (kinds,)

    def best(self, alpha: float) -> int | None:
        """Which kind gains most beyond noise, of those with a chance below a rate, if any has."""
        if self.p_values.min() >= alpha:
            return None
        return int(np.argmax(np.where(self.p_values < alpha, self.beyond, -np.inf)))

    def likeliest(self, kind: int) -> tuple[Array, Array, list[int]]:
        """Whitener (d, n) and whitened error of the likeliest noise, and which of a kind it is.

        These are several where the error cannot tell them apart.
        """
        each = (list(_left(noise, self.error[:, None])) for noise in self.noises)
        found = np.array([left[1 + kind][:, 0] for left in each])
        rho = found.min(axis=1).argmin()
        alike = np.flatnonzero(found[rho] <= found[rho].min() * (1.0 + _ALIKE))
        whitener = self.noises[int(rho)].whitener
        return whitener @ self.left.T, whitener @ self.error, alike.tolist()


def tried(
    comparison: Comparison,
    taken: Array,
    kinds: Sequence[tuple[Kind, float]],
    rhos: Sequence[float],
    share: float,
    seed: int,
) -> Trial:
    """Try kinds of disturbances in what some columns leave of the readings.

    The columns, shape (n, k), are of whatever rank. Kinds come with weights: in noise alone, one of
    twice the weight seems to be there twice as often. The noise may have any of some correlations
    of neighbours, and a share of the false-alarm rate is for these kinds.
    """
    own = orthonormal(taken)
    left = np.asarray(np.linalg.qr(own, mode="complete")[0][:, own.shape[1] :])
    covariances = _covariances(comparison, rhos)
    noises = tuple(_noise(each, left, [kind for kind, _ in kinds]) for each in covariances)
    error = left.T @ comparison.residual
    gains, alone = _gains(noises, error[:, None])
    root = left.T @ np.linalg.cholesky(covariances[int(alone[0])])
    tails, rng = min(comparison.noise.tails, _TAILS), np.random.default_rng(seed)

    def draw(draws: int) -> Array:
        return np.asarray(root @ independent(tails, rng, (root.shape[1], draws)))

    weights = np.array([weight for _, weight in kinds])
    p_values, beyond = _chances(noises, gains[:, 0], weights, draw)
    return Trial(left, error, noises, np.minimum(p_values / share, 1.0), beyond)


def _covariances(comparison: Comparison, rhos: Sequence[float]) -> list[Array]:
    """Covariances of the noise that is tried, (n, n), to some factor.

    Where it is thought to differ from run to run, a disturbance of one run may have made it so:
    noise that does not is tried too.
    """
    own, by_std = comparison.noise.relative, relative_noise(comparison.record)
    declared = own is None or (by_std is not None and np.array_equal(own, by_std))
    sizes = [own] if declared else [own, by_std]
    c = comparison.model.conditions
    return [memory(c, rho, size) for size in sizes for rho in rhos]


def _noise(covariance: Array, left: Array, kinds: Sequence[Kind]) -> Noise:
    whitener = np.linalg.inv(np.linalg.cholesky(left.T @ covariance @ left))
    seen = tuple(_seen(whitener @ left.T, kind) for kind in kinds)
    return Noise(whitener, -2.0 * float(np.log(np.diag(whitener)).sum()), seen)


def _seen(see: Array, kind: Kind) -> _Seen:
    seen = (kind.actions @ see.T).reshape(-1, kind.each, len(see))
    values, vectors = np.linalg.eigh(seen @ seen.mT)
    kept = values > 1e-6 * values.max()
    values = np.where(kept, values, 1.0)
    variances, values, kept = np.array(kind.variances)[:, None], values[:, None], kept[:, None]
    grown = np.log1p(np.where(np.isfinite(variances), variances, 0.0) * values)
    return _Seen(
        bases=vectors.mT @ seen,
        weights=kept / (values + 1.0 / variances),
        penalties=np.exp((kept * grown).sum(axis=2, keepdims=True) / len(see)),
    )


def _left(noise: Noise, errors: Array) -> Iterator[Array]:
    """Sums of squares that count of K errors: alone, (1, K), and beside each kind, (s * v, K).

    The likelihood with noise of any size hangs on them alone.
    """
    white = noise.whitener @ errors
    squares, own = (white**2).sum(axis=0), np.exp(noise.log_determinant / len(white))
    yield own * squares[None]
    for bases, weights, penalties in noise.kinds:
        each = ((bases.reshape(-1, len(white)) @ white) ** 2).reshape(*bases.shape[:2], -1)
        left = np.maximum(squares - weights @ each, 1e-12 * squares)
        yield own * (penalties * left).reshape(-1, squares.size)


def _gains(noises: Sequence[Noise], errors: Array) -> tuple[Array, Ints]:
    """Gain in likelihood by the best of each kind, (kinds, K), and which noise is best alone."""
    left = np.array([[own.min(axis=0) for own in _left(noise, errors)] for noise in noises])
    least = np.log(left.min(axis=0))
    return 0.5 * len(errors) * (least[0] - least[1:]), left[:, 0].argmin(axis=0)


def _chances(
    noises: Sequence[Noise], gains: Array, weights: Array, draw: Callable[[int], Array]
) -> tuple[Array, Array]:
    """Chance that noise gains as much by any kind, and what is gained beyond nearly all noise.

    The kinds are judged together by the smallest weighted chance that a draw of noise has among
    them: many of them see the same, so that their number would count too much.
    """
    found = np.empty((gains.size, 0))
    for draws, possible in _DRAWS:
        found = np.hstack([found, _gains(noises, draw(draws))[0]])
        above = (found >= gains[:, None]).sum(axis=1)
        if above.min() > possible * found.shape[1]:
            break
    ranks = found.shape[1] - np.argsort(np.argsort(found, axis=1), axis=1)
    smallest = (ranks / weights[:, None]).min(axis=0)  # the rank of the largest gain is 1
    as_rare = (smallest <= (above / weights)[:, None]).sum(axis=1)
    return (1.0 + as_rare) / (1.0 + found.shape[1]), gains - np.quantile(found, 0.99, axis=1)
