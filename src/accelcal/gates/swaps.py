"""Two readings of one stroke in each other's place: the swap that would fit best."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Places
from accelcal.numerics.grouping import Grouped, few_at_a_time

_BLOCK = 256  # readings whose swaps with all others are judged at a time, to bound the memory
_NUMBERS = 2**20  # numbers of such a block over all tables, for the same reason
_ROUNDING = 1e-6
_SHARE_ROUNDING = 1e-14  # of a share, which decides where the residuals are but rounding errors


class Swaps(NamedTuple):
    """The best swap of each table."""

    squares: Array  # squared residuals that it would leave; infinite where none is so good, (T,)
    pair: Places  # the two readings, shape (T, 2)


class SwapBlock(NamedTuple):
    """Strokes of equally many readings: one and the other of a pair, and the least share of any.

    The one is among some of the readings of a stroke, the other among all of them.

    The share of a pair is that of the square of the difference of their errors which is left in the
    residuals, P_ii + P_jj - 2 P_ij, where P is the projector on the residuals.
    """

    stroke: Places  # shape (c,)
    one: Places  # shape (c, s)
    other: Places  # shape (c, k)
    least: Array  # shape (c,)


def swap_blocks(basis: Array, strokes: Grouped) -> list[SwapBlock]:
    """Make ready for `best_swap` what depends on the plan alone: pairs of readings of one stroke.

    The basis of the design is orthonormal, shape (n, p).
    """
    found = []
    for stroke, other in strokes.alike:
        size = other.shape[1]
        for start in range(0, size if size > 1 else 0, _BLOCK):
            one = other[:, start : start + _BLOCK]
            parts = few_at_a_time(other, one.shape[1])
            least = [_least_shares(basis, one[few], other[few]) for few in parts]
            found.append(SwapBlock(stroke, one, other, np.concatenate(least)))
    return found


def _least_shares(basis: Array, one: Places, other: Places) -> Array:
    """Least share of two different readings of each stroke, shape (c,)."""
    same = one[:, :, None] == other[:, None]
    share = np.where(same, np.inf, _shares(basis, one, other))
    return np.asarray(np.maximum(share.reshape(len(other), -1).min(axis=1), 0.0))


def best_swap(
    output: Array, residual: Array, basis: Array, blocks: Sequence[SwapBlock], better: float
) -> Swaps:
    """Find the best swap of two readings of one stroke in each table.

    The readings, and what the fit leaves of them, are of shape (n, T) [output unit], the
    orthonormal basis of the design of shape (n, p). Swaps that do not make the squared residuals
    `better` times smaller are of no interest.

    Notes
    -----
    A swap changes the residuals r by d P (e_i - e_j) with d = y_j - y_i and P the projector on the
    residuals, so that no fit is needed. Whatever d, it takes at most (r_i - r_j)^2 / (P_ii + P_jj -
    2 P_ij) off the squares: most tables are done with that.
    """
    squares = (residual**2).sum(axis=0)
    found = Swaps(np.full(squares.size, np.inf), np.zeros((squares.size, 2), dtype=np.intp))
    least = (1.0 - 1.0 / better - _ROUNDING) * squares
    for _, one, other, tables in sorted(_hopes(residual, blocks, least), key=lambda hope: hope[0]):
        share = _shares(basis, one, other)
        for part in np.array_split(tables, 1 + tables.size * share.size // _NUMBERS):
            y, r = output.T[part], residual.T[part]
            d = y[:, None, other] - y[:, one, None]
            pull = r[:, one, None] - r[:, None, other]
            change = (2.0 * d * pull + d**2 * (share + _SHARE_ROUNDING)).reshape(
                part.size, share.size
            )
            at = change.argmin(axis=1)
            left = squares[part] + change[np.arange(part.size), at]
            ahead = left < found.squares[part]
            found.squares[part[ahead]] = left[ahead]
            first, second = np.divmod(at[ahead], other.size)
            found.pair[part[ahead]] = np.sort(np.column_stack([one[first], other[second]]), axis=1)
    return found


def _hopes(
    residual: Array, blocks: Sequence[SwapBlock], least: Array
) -> Iterator[tuple[int, Places, Places, Places]]:
    """Find where a swap may take so much off the squares; that is in few strokes of a table.

    Yields the stroke, one and the other of its pairs, and the tables.
    """
    for stroke, one, other, share in blocks:
        for few in few_at_a_time(other, least.size):
            span = np.ptp(residual.take(other[few], axis=0), axis=1) ** 2
            enough = span >= least * share[few, None]
            for at in np.flatnonzero(enough.any(axis=1)).tolist():
                place = few.start + at
                tables = np.flatnonzero(enough[at])
                yield int(stroke[place]), one[place], other[place], tables


def _shares(basis: Array, one: Places, other: Places) -> Array:
    """P_ii + P_jj - 2 P_ij of pairs of readings, shape (..., s, k)."""
    rows, columns = basis[one], basis[other]
    free_rows, free_columns = (1.0 - (each**2).sum(axis=-1) for each in (rows, columns))
    common = 2.0 * rows @ columns.mT
    return np.asarray(free_rows[..., :, None] + free_columns[..., None, :] + common)
