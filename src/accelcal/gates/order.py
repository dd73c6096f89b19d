"""Gate on the order of positions: is there an order or sign that would fit far better."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.tables import PreparedTable
from accelcal.gates.replicates import place
from accelcal.gates.verdict import not_assessed, times, warn_if
from accelcal.geometry import accelerations
from accelcal.grouping import distinct
from accelcal.model import design_matrix
from accelcal.results.quantity import Gate

__all__ = ["order_of_positions"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_MUCH_BETTER = 9.0  # another order must leave a ninth of the squared residuals, a third of the rms
_NOTHING = 1e-24  # squared residuals below this share of the squared outputs are rounding errors


class _Order(NamedTuple):
    """Another order of the readings."""

    said: str
    angle: Array
    sign: Array


def order_of_positions(table: PreparedTable, delta0: float = 0.0) -> Gate:
    """Look for another order of positions under which the fit would be far better.

    Parameters
    ----------
    table : PreparedTable
        The table.
    delta0 : float, default 0
        Fixture angle of the fit [rad].

    Returns
    -------
    Gate
        A warning where mirroring, shifting or negating a stroke, or swapping two readings of it,
        would leave a third of the residuals or less.

    Notes
    -----
    What is wrong with all strokes alike leaves no residual: a shift shows as a misalignment out of
    proportion, a negative sign as a negative scale factor, and a mirror turns the sign of M only.
    """
    name = "order of positions"
    output = table.record.output
    if len(output) <= len(table.estimability.kept):
        return not_assessed(name, "no residual to compare orders by")
    basis = np.linalg.qr(table.kept_design).Q
    residual = output - basis @ (basis.T @ output)
    given = float(residual @ residual)
    said, best = min(
        [_best_order(table, delta0), _best_swap(table, basis, residual)], key=lambda found: found[1]
    )
    best = max(best, _NOTHING * float(output @ output))
    if given <= _MUCH_BETTER * best:
        return warn_if(name, False, "no other order of positions fits far better")
    ratio = times(float(np.sqrt(given / best)))
    return warn_if(name, True, f"the residuals would be {ratio} times smaller with {said}")


def _best_order(table: PreparedTable, delta0: float) -> tuple[str, float]:
    """The best of the other orders of strokes, with its sum of squared residuals."""
    orders = list(_other_orders(table))
    if not orders:
        return "", np.inf
    mounting = str(table.record.mounting[0])
    angles = np.array([order.angle for order in orders])
    designs = design_matrix(accelerations(angles, delta0, mounting), mounting)
    outputs = np.array([order.sign for order in orders]) * table.record.output
    basis = np.linalg.qr(designs[..., table.estimability.columns]).Q
    fitted = (basis @ (basis.swapaxes(1, 2) @ outputs[..., None]))[..., 0]
    squares = ((outputs - fitted) ** 2).sum(axis=1)
    best = int(np.argmin(squares))
    return orders[best].said, float(squares[best])


def _other_orders(table: PreparedTable) -> Iterator[_Order]:
    angle, same = table.record.angle, np.ones(len(table.record))
    for who, chosen in _groups_of_strokes(table.record.stroke):
        for how, other in (("mirrored (J counted against the turn)", -angle), *_shifts(table)):
            yield _Order(f"{who} {how}", np.where(chosen, other, angle), same)
        yield _Order(f"{who} of the other sign", angle, np.where(chosen, -1.0, 1.0))


def _shifts(table: PreparedTable) -> Iterator[tuple[str, Array]]:
    """Angles after a shift by one position or two, either way, or by half a turn."""
    step = float(np.diff(distinct(table.head)).min())
    for count, word in ((1, "one position"), (2, "two positions")):
        if step * count < 180.0:
            yield f"shifted by {word}", table.record.angle + count * step
            yield f"shifted by {word} the other way", table.record.angle - count * step
    yield "shifted by half a turn", table.record.angle + 180.0


def _groups_of_strokes(stroke: NDArray[np.int64]) -> Iterator[tuple[str, Mask]]:
    """Strokes that may be wrong against the others."""
    numbers = distinct(stroke)
    back = stroke % 2 == 0
    if numbers.size == 2:
        yield f"stroke {numbers[0]} or {numbers[1]}", stroke == numbers[1]
    if numbers.size > 2:
        for number in numbers:
            yield f"stroke {number}", stroke == number
    if distinct(stroke[back]).size > 1:
        yield "the forward or the back strokes", back


def _best_swap(table: PreparedTable, basis: Array, residual: Array) -> tuple[str, float]:
    """The best swap of two readings of one stroke, with its sum of squared residuals.

    A swap changes the residuals by d P (e_i - e_j) with d = y_j - y_i and P the projector on the
    residuals, so that no fit is needed.
    """
    best = "", np.inf
    squares = float(residual @ residual)
    record = table.record
    for stroke in distinct(record.stroke):
        own = np.flatnonzero(record.stroke == stroke)
        d = record.output[own] - record.output[own, None]
        pull = residual[own, None] - residual[own]
        cross = basis[own] @ basis[own].T
        free = 1.0 - np.diagonal(cross)
        change = 2.0 * d * pull + d**2 * (free[:, None] + free + 2.0 * cross)
        i, j = np.unravel_index(np.argmin(change), change.shape)
        if squares + change[i, j] < best[1]:
            readings = place(record, int(own[i])), place(record, int(own[j]))
            best = f"{readings[0]} and {readings[1]} swapped", float(squares + change[i, j])
    return best
