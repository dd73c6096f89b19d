"""The chance that noise alone makes a factor disagree, whatever few degrees of freedom leave open.

An error of a size s that was estimated with v degrees of freedom may have the size s sqrt(v / x), x
of a chi-square distribution of v. The chance under each of these sizes, averaged over them, is that
of Student's distribution (of one direction) or of Fisher's (of several) where no other error is
there, and lies between theirs and that of known errors where there are others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.factors import Block
from accelcal.discovery.family import chance
from accelcal.discovery.noise.of_readings import FEWEST_REPLICATES
from accelcal.discovery.space import Space
from accelcal.discovery.spans import lengths, orthonormal, squares_in, without

_ENDLESS = 10**6
_LOGITS = np.linspace(-14.0, 14.0, 41)
"""Logits of the probabilities at which sizes are tried; the trapezoidal rule is exact enough."""

_NEW = 1e-6
"""Part of a column beyond others above which it is not rounding."""


class Estimated(NamedTuple):
    """Errors of which some sizes were estimated."""

    acting: Array  # change of the n readings by each error, (n, k) [g per unit]
    counted: Array  # covariance of the errors that the space is whitened by, (k, k)
    sized: Callable[[Callable[[float], float]], Array]
    """The covariance, were the sizes other than estimated: of a function that gives the size over
    its estimate, of the degrees of freedom of that."""


def chances(
    space: Space,
    seen: Array,
    blocks: Sequence[Block],
    known_dof: float = np.inf,
    errors: Estimated | None = None,
) -> list[float]:
    """Chance that noise makes each factor disagree as much, not yet honest for their number.

    Each of the blocks is orthogonal to those before it. Of the noise that the space is whitened by,
    the degrees of freedom are known, where no replicates tell it anew. Without errors whose sizes
    were estimated, all that the space is whitened by is known.
    """
    repeated = space.dof >= FEWEST_REPLICATES
    dof = space.dof if repeated else min(known_dof, _ENDLESS)
    variance = float(space.pure_error(seen)) / dof if repeated else 1.0
    sizes = [block.basis.shape[1] for block in blocks]
    tried = [(1.0, [squares_in(block.basis, seen) for block in blocks])]
    if errors is not None:
        tried = list(_under_all_sizes(space, seen, blocks, errors))
    return [
        float(
            sum(
                weight * chance(np.array(each[i] / size / variance), dof, size)
                for weight, each in tried
            )
        )
        for i, size in enumerate(sizes)
    ]


def _under_all_sizes(
    space: Space, seen: Array, blocks: Sequence[Block], errors: Estimated
) -> Iterator[tuple[float, list[float]]]:
    """Weight of each size that is tried, and the sums of squares of the blocks under it.

    Under another covariance, what a factor has beyond those before it are innovations: Cholesky's
    factor forms them, of the factors in the reverse of their order.
    """
    from scipy.linalg import solve_triangular  # type: ignore[import-untyped]

    acting = space.see(errors.acting)
    bases = np.hstack([block.basis for block in reversed(blocks)])
    coordinates = np.hstack([_beyond(acting, bases), bases]).T
    shown, acted = coordinates @ seen, coordinates @ acting
    ends = np.cumsum([block.basis.shape[1] for block in blocks])
    for weight, factor in sizes_left_open():
        change = acted @ (errors.sized(factor) - errors.counted) @ acted.T
        lower = np.linalg.cholesky(np.eye(shown.size) + change)
        squares = np.cumsum(solve_triangular(lower, shown, lower=True)[::-1] ** 2)[ends - 1]
        yield weight, np.diff(squares, prepend=0.0).tolist()


def _beyond(columns: Array, taken: Array) -> Array:
    """Orthonormal basis of what columns have beyond a basis."""
    left = without(columns, taken)
    return orthonormal(left[:, lengths(left) > _NEW * lengths(columns)])


def sizes_left_open() -> Iterator[tuple[float, Callable[[float], float]]]:
    """Weights, and the sizes over their estimates, all large together or all small.

    A size is given by a function of the degrees of freedom of its estimate.
    """
    from scipy.special import expit, gammaincinv  # type: ignore[import-untyped]

    levels = expit(_LOGITS)
    weights = levels * expit(-_LOGITS)
    for level, weight in zip(levels.tolist(), (weights / weights.sum()).tolist(), strict=True):

        def factor(dof: float, level: float = level) -> float:
            return (
                1.0 if np.isinf(dof) else float(np.sqrt(0.5 * dof / gammaincinv(0.5 * dof, level)))
            )

        yield weight, factor
