"""One test over everything that is searched, with its false-alarm rate from simulated noise.

Each effect and each factor has a p-value of its own; an effect with nonlinear parameters has that
of its best instance, times the number of independent tries that its instances amount to. The
smallest p-value of all is judged by its own distribution. Both numbers come from noise drawn in
the same space, so that it does not matter how the candidates are correlated, nor that a parameter
exists only where there is an effect.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.columns import beyond, length_without, without
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.factors import Block, blocks
from accelcal.discovery.instance import Candidates, candidates
from accelcal.discovery.large_effects import silent_in
from accelcal.discovery.space import Space, whitener_of
from accelcal.effects.effect import Effect

DRAWS = 4000
SMALLEST = 1e-300
"""Smallest p-value told."""

NEW = 0.02
"""Part of an effect that must be new beside other effects."""

_TOGETHER = 250
"""Draws whose ratios are worked out at a time, so that they stay in the processor's cache."""

_DRAWN = 2**21
"""Numbers that are drawn at a time, 16 MB, or somewhat more for very many readings."""

_LEVELS = np.array([0.05, 0.02, 0.01, 0.005])

_STEPS = 5.0
"""Steps of a correlation within 1 in which what noise with such a memory does is shared."""


class Family(NamedTuple):
    """Everything that is tested at once."""

    comparison: Comparison  # record and model
    candidates: Candidates  # E effects with N instances
    blocks: tuple[Block, ...]
    tries: Array  # independent tries that the instances of each effect amount to, (E,)
    tests: float  # independent tests that the whole family amounts to
    factor_tries: Array
    """How many times as often as its p-value says noise makes each factor disagree: more than once
    where neighbouring readings may be correlated, (B,)."""

    def with_rates_of(self, other: Family) -> Family:
        """Return it with the false-alarm rates of another one, of a test like it."""
        return self._replace(tries=other.tries, tests=other.tests, factor_tries=other.factor_tries)

    @property
    def null(self) -> Hashable:
        """What the false-alarm rates of tests of one plan hang on: where it is alike, so are they.

        Of the correlations that the replicates leave possible the largest tells the others.
        """
        noise = self.comparison.noise
        weights = None if noise.relative is None else noise.relative.tobytes()
        silent = silent_in(self.comparison.model.conditions).tobytes()
        memory = bool(noise.rho), round(_STEPS * max(noise.possible, default=0.0))
        ids = tuple(effect.id for effect in self.candidates.effects)
        return ids, len(self.blocks), memory, noise.tails, weights, silent

    @property
    def space(self) -> Space:
        """The space that the base model leaves."""
        return self.comparison.space


class Judgement(NamedTuple):
    """What the family says about some coordinates."""

    p_value: float  # chance that noise alone gives as small a p-value anywhere in the family
    effects: Array  # p-value of each effect, (E,)
    blocks: Array  # p-value of each factor, (B,)


class _Left(NamedTuple):
    """Coordinates with what is taken out of them, for k draws at once."""

    seen: Array  # the coordinates, (n, k)
    shown: Array  # their systematic part, (b, k)
    pure: Array  # sum of squares of their pure error, (k,)

    def draws(self, some: slice) -> _Left:
        """Return that of some of the draws."""
        return _Left(self.seen[:, some], self.shown[:, some], self.pure[some])


def family_of(comparison: Comparison, effects: Sequence[Effect]) -> Family:
    """Set up the family of some effects, each with an amplitude, and of the factors of the test.

    Its false-alarm rates are not known yet: all count as one try.
    """
    space, c = comparison.space, comparison.model.conditions
    found = candidates(effects, space, c)
    factors = blocks(space, c)
    tries, factor_tries = np.ones(len(found.effects)), np.ones(len(factors))
    return Family(comparison, found, factors, tries, 1.0, factor_tries)


def with_rates(family: Family, seed: int = 0) -> Family:
    """Find the tries and tests of a family from noise that is simulated."""
    test = _p_values(family, None)
    draws = drawn(family.comparison, np.random.default_rng(seed), DRAWS)
    effects, factors = map(np.hstack, zip(*map(test, draws), strict=True))
    tries, factor_tries = _multiplicity(effects), _multiplicity(factors)
    honest = np.vstack([effects * tries[:, None], factors * factor_tries[:, None]])
    tests = float(_multiplicity(honest.min(axis=0, initial=1.0)))
    return family._replace(tries=tries, tests=tests, factor_tries=factor_tries)


def drawn(comparison: Comparison, rng: np.random.Generator, draws: int) -> Iterator[Array]:
    """Draw coordinates of noise alone, some at a time, shape (n, k).

    They are as many as asked for, or nearly; all covariances that are possible are as likely.
    """
    space, tails, n = comparison.space, comparison.noise.tails, comparison.seen.size
    possible = comparison.possible or (comparison.spread,)
    each = draws // len(possible)
    most = max(_DRAWN // n, 50)
    for covariance in possible:
        root = whitener_of(covariance)
        for start in range(0, each, most):
            white = independent(tails, rng, (n, min(most, each - start)))
            yield space.see(root.unwhitened(white)) if comparison.possible else space.left_of(white)


def independent(tails: float, rng: np.random.Generator, shape: tuple[int, int]) -> Array:
    """Draw independent numbers of variance 1, of a Student distribution with `tails`."""
    if np.isinf(tails):
        return rng.standard_normal(shape)
    return np.asarray(np.sqrt((tails - 2.0) / tails) * rng.standard_t(tails, shape))


def _multiplicity(p: Array) -> Array:
    """Factor that makes p-values honest, from k under noise alone each, shape (..., k)."""
    factors = _LEVELS / np.maximum(np.quantile(p, _LEVELS, axis=-1).T, SMALLEST)
    return np.asarray(np.maximum(factors.mean(axis=-1), 1.0))


def judge(family: Family, taken: Array | None = None) -> Judgement:
    """Test the whole family on the readings.

    Taken, shape (n, h), is an orthonormal basis of what has been explained already.
    """
    effects, factors = _p_values(family, taken)(family.comparison.seen[:, None])
    honest = np.minimum(effects[:, 0] * family.tries, 1.0)
    of_blocks = np.minimum(factors[:, 0] * family.factor_tries, 1.0)
    smallest = min(honest.min(initial=1.0), of_blocks.min(initial=1.0))
    return Judgement(min(1.0, float(smallest) * family.tests), honest, of_blocks)


def agrees(family: Family, taken: Array, alpha: float) -> bool:
    """Tell whether nothing in the family disagrees with what is left of the readings.

    It is as the p-value of `judge` has it at a false-alarm rate over the whole family, without more
    work than it takes to find that out.
    """
    left = _left(family.space, family.comparison.seen[:, None], taken)
    single = _of_effects(family, taken)(left)[:, 0] * family.tries
    smallest = alpha / family.tests
    if single.min(initial=1.0) < smallest:
        return False
    return all(
        float(_of_block(block.basis, family.space, taken)(left)[0]) * tries >= smallest
        for block, tries in zip(family.blocks, family.factor_tries.tolist(), strict=True)
    )


def chance(ratio: Array, dof: float, degrees: int = 1) -> Array:
    """Survival function of F with `degrees` and `dof` degrees of freedom, never zero."""
    from scipy.special import fdtrc  # type: ignore[import-untyped]

    return np.asarray(np.maximum(fdtrc(degrees, dof, ratio), SMALLEST))


def _p_values(family: Family, taken: Array | None) -> Callable[[Array], tuple[Array, Array]]:
    """p-values of the best instance of each effect, (E, k), and of each factor, (B, k)."""
    of_effects = _of_effects(family, taken)
    of_blocks = [_of_block(block.basis, family.space, taken) for block in family.blocks]

    def of(seen: Array) -> tuple[Array, Array]:
        left = _left(family.space, seen, taken)
        factors = [of_block(left) for of_block in of_blocks]
        return of_effects(left), np.array(factors).reshape(-1, seen.shape[1])

    return of


def _of_effects(family: Family, taken: Array | None) -> Callable[[_Left], Array]:
    """p-value of the best instance of each effect, (E, k)."""
    found = family.candidates
    starts = np.searchsorted(found.owner, np.arange(len(found.effects)))
    ratios = _ratios(family, taken)

    def of(left: _Left) -> Array:
        draws = left.pure.size
        best = np.zeros((starts.size, draws))
        for start in range(0, draws if starts.size else 0, _TOGETHER):
            some = slice(start, start + _TOGETHER)
            best[:, some] = np.maximum.reduceat(ratios(left.draws(some)), starts, axis=0)
        return chance(best, family.space.dof)

    return of


def _left(space: Space, seen: Array, taken: Array | None) -> _Left:
    rest = seen if taken is None else without(seen, taken)
    shown = space.systematic.T @ rest
    return _Left(rest, shown, (rest**2).sum(axis=0) - (shown**2).sum(axis=0))


def _ratios(family: Family, taken: Array | None) -> Callable[[_Left], Array]:
    """F of each of N instances against the pure error that is left beside it, shape (N, k)."""
    space, found = family.space, family.candidates
    scale, systematic = np.ones(found.owner.size), found.systematic
    if taken is not None:
        part = taken.T @ found.directions
        length = length_without(part)
        scale = np.where(length > NEW, 1.0 / np.maximum(length, NEW), 0.0)
        systematic = (systematic - (space.systematic.T @ taken) @ part) * scale
    pure_part = 1.0 - (systematic**2).sum(axis=0)[:, None]
    lowest = np.where(found.one_sided, 0.0, -np.inf)[:, None]

    def of(left: _Left) -> Array:
        size = scale[:, None] * (found.directions.T @ left.seen)
        in_pure_error = size - systematic.T @ left.shown
        np.maximum(size, lowest, out=size)
        beside = left.pure + size * (size * pure_part - 2.0 * in_pure_error)
        return np.asarray(size**2 * space.dof / np.maximum(beside, SMALLEST))

    return of


def _of_block(basis: Array, space: Space, taken: Array | None) -> Callable[[_Left], Array]:
    """Chance of a factor's F against the pure error beside it: part of it may not repeat."""
    if taken is not None:
        basis = beyond(basis, taken, NEW)
    degrees = basis.shape[1]
    own = beyond(basis, space.systematic, NEW)
    dof = space.dof - own.shape[1]

    def of(left: _Left) -> Array:
        if not degrees:
            return np.ones(left.pure.size)
        squares = ((basis.T @ left.seen) ** 2).sum(axis=0)
        beside = left.pure - ((own.T @ left.seen) ** 2).sum(axis=0)
        return chance(squares / degrees * dof / np.maximum(beside, SMALLEST), dof, degrees)

    return of
