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
from accelcal.grouping import distinct, grouped
from accelcal.model import design_matrix
from accelcal.results.quantity import Gate

__all__ = ["OtherOrder", "order_of_positions", "order_of_strokes"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Places = NDArray[np.intp]

_MUCH_BETTER = 9.0  # another order must leave a ninth of the squared residuals, a third of the rms
_NOTHING = 1e-24  # squared residuals below this share of the squared outputs are rounding errors
_BLOCK = 256  # readings whose swaps with all others are judged at a time, to bound the memory


class _Order(NamedTuple):
    """Another order of the readings, for some of the strokes."""

    said: str
    angle: Array
    sign: float = 1.0


class OtherOrder(NamedTuple):
    """Another order of positions in some strokes, under which the fit would be better.

    Attributes
    ----------
    said : str
        Which strokes, and what of them.
    squares : float
        Squared residuals that it would leave, infinite where no other order is better.
    chosen : ndarray of bool, shape (n,)
        Readings of these strokes.
    angle : ndarray, shape (n,)
        Head angles of all readings in this order [deg].
    sign : float
        Sign of the output of these strokes.
    better : float
        The squared residuals over those.
    """

    said: str
    squares: float
    chosen: Mask
    angle: Array
    sign: float
    better: float


class _Fit(NamedTuple):
    """The fit in the order given, in a basis in which its normal matrix is one."""

    basis: Array  # shape (n, p)
    to_basis: Array  # from the columns of the design, shape (p, p)
    values: Array  # the coefficients in this basis, shape (p,)
    residual: Array  # shape (n,)

    @classmethod
    def of(cls, design: Array, output: Array) -> _Fit:
        basis, triangle = np.linalg.qr(design)
        values = basis.T @ output
        return cls(basis, np.linalg.inv(triangle), values, output - basis @ values)

    @property
    def squares(self) -> float:
        return float(self.residual @ self.residual)


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
    proportion, a negative sign as a negative scale factor. A mirror turns the signs of M and M_ip
    and shows nowhere.
    """
    name = "order of positions"
    output = table.record.output
    if len(output) <= len(table.estimability.kept):
        return not_assessed(name, "no residual to compare orders by")
    fit = _Fit.of(table.kept_design, output)
    said, best = min(
        [_best_order(table, fit, delta0)[:2], _best_swap(table, fit)], key=lambda found: found[1]
    )
    best = max(best, _NOTHING * float(output @ output))
    if fit.squares <= _MUCH_BETTER * best:
        return warn_if(name, False, "no other order of positions fits far better")
    ratio = times(float(np.sqrt(fit.squares / best)))
    return warn_if(name, True, f"the residuals would be {ratio} times smaller with {said}")


def order_of_strokes(table: PreparedTable, delta0: float = 0.0) -> OtherOrder | None:
    """Find the other order of one or more strokes under which the fit would be far better.

    Parameters
    ----------
    table : PreparedTable
        The table.
    delta0 : float, default 0
        Fixture angle of the fit [rad].

    Returns
    -------
    OtherOrder or None
        None where none leaves a third of the residuals or less.
    """
    output = table.record.output
    if len(output) <= len(table.estimability.kept):
        return None
    fit = _Fit.of(table.kept_design, output)
    found = _best_order(table, fit, delta0)
    least = max(found.squares, _NOTHING * float(output @ output))
    return found if fit.squares > _MUCH_BETTER * least else None


def _best_order(table: PreparedTable, fit: _Fit, delta0: float) -> OtherOrder:
    """The best of the other orders of strokes."""
    names, members = _groups_of_strokes(table.record.stroke)
    if not names or _squares_without(table, fit, members).min() > fit.squares / _MUCH_BETTER:
        # no order of a group fits better than leaving the group out
        nothing = np.zeros(len(table.record), dtype=np.bool_)
        return OtherOrder("", np.inf, nothing, table.record.angle, 1.0, 0.0)
    found = []
    for order in _other_orders(table):
        squares = _squares_of_groups(table, fit, order, members, delta0)
        found.append((float(squares.min()), order, int(np.argmin(squares))))
    _, order, group = min(found, key=lambda one: one[0])
    chosen = members[group, _stroke_index(table)]
    left = _squares(table, order, chosen, delta0)
    better = fit.squares / max(left, _NOTHING * float(table.record.output @ table.record.output))
    said = f"{names[group]} {order.said}"
    return OtherOrder(said, left, chosen, order.angle, order.sign, better)


def _other_orders(table: PreparedTable) -> Iterator[_Order]:
    """Mirror, shifts by one position or two, either way, or by half a turn, and other sign."""
    angle = table.record.angle
    yield _Order("mirrored (J counted against the turn)", -angle)
    step = float(np.diff(distinct(table.head)).min())
    for count, word in ((1, "one position"), (2, "two positions")):
        if step * count < 180.0:
            yield _Order(f"shifted by {word}", angle + count * step)
            yield _Order(f"shifted by {word} the other way", angle - count * step)
    yield _Order("shifted by half a turn", angle + 180.0)
    yield _Order("of the other sign", angle, -1.0)


def _stroke_index(table: PreparedTable) -> NDArray[np.intp]:
    return grouped(table.record.stroke)[1]


def _groups_of_strokes(stroke: NDArray[np.int64]) -> tuple[list[str], Mask]:
    """Groups of strokes that may be wrong against the others, shape (groups, strokes)."""
    numbers = distinct(stroke)
    back = numbers % 2 == 0
    each = np.eye(numbers.size, dtype=np.bool_)
    if numbers.size < 2:
        return [], each
    if numbers.size == 2:
        names, members = [f"stroke {numbers[0]} or {numbers[1]}"], each[1:]
    else:
        names, members = [f"stroke {number}" for number in numbers], each
    if back.sum() > 1:
        return [*names, "the forward or the back strokes"], np.vstack([members, back])
    return names, members


def _design(table: PreparedTable, order: _Order, delta0: float) -> Array:
    mounting = str(table.record.mounting[0])
    design = design_matrix(accelerations(order.angle, delta0, mounting), mounting)
    return design[:, table.estimability.columns]


def _squares_without(table: PreparedTable, fit: _Fit, members: Mask) -> Array:
    """Squared residuals after refitting without each group, shape (groups,)."""
    nothing = np.zeros_like(fit.residual)
    return _refitted(table, fit, np.zeros_like(fit.basis), nothing, members)


def _squares_of_groups(
    table: PreparedTable, fit: _Fit, order: _Order, members: Mask, delta0: float
) -> Array:
    """Squared residuals after refitting with each group in another order, shape (groups,)."""
    basis = _design(table, order, delta0) @ fit.to_basis
    residual = order.sign * table.record.output - basis @ fit.values
    return _refitted(table, fit, basis, residual, members)


def _refitted(
    table: PreparedTable, fit: _Fit, basis: Array, residual: Array, members: Mask
) -> Array:
    """Squared residuals after refitting with the rows of each group changed, shape (groups,).

    Other rows change the normal matrix 1 by D, the right-hand side by d and the squares by q, each
    a sum over the readings concerned; refitting leaves squares + q - d (1 + D)^-1 d. So no design
    of a whole table is needed for each group.
    """

    def of_groups(change: Array) -> Array:
        strokes = np.zeros((members.shape[1], *change.shape[1:]))
        np.add.at(strokes, _stroke_index(table), change)
        return np.tensordot(members.astype(np.float64), strokes, 1)

    q = of_groups(residual**2 - fit.residual**2)
    d = of_groups(basis * residual[:, None] - fit.basis * fit.residual[:, None])
    outer = basis[:, :, None] * basis[:, None] - fit.basis[:, :, None] * fit.basis[:, None]
    normal = np.eye(basis.shape[1]) + of_groups(outer)
    solved = np.linalg.pinv(normal, rcond=1e-9, hermitian=True) @ d[..., None]
    return np.asarray(fit.squares + q - (d * solved[..., 0]).sum(axis=1))


def _squares(table: PreparedTable, order: _Order, chosen: Mask, delta0: float) -> float:
    """Squared residuals of one order, without the rounding errors of the update."""
    design = np.where(chosen[:, None], _design(table, order, delta0), table.kept_design)
    sign = np.where(chosen, order.sign, 1.0)
    return _Fit.of(design, sign * table.record.output).squares


def _best_swap(table: PreparedTable, fit: _Fit) -> tuple[str, float]:
    """The best swap of two readings of one stroke, with its sum of squared residuals.

    A swap changes the residuals by d P (e_i - e_j) with d = y_j - y_i and P the projector on the
    residuals, so that no fit is needed.
    """
    best, pair = np.inf, (0, 0)
    for stroke in distinct(table.record.stroke):
        own = np.flatnonzero(table.record.stroke == stroke)
        for start in range(0, own.size, _BLOCK):
            some = own[start : start + _BLOCK]
            change = _changes_by_swaps(table.record.output, fit, some, own)
            i, j = np.unravel_index(np.argmin(change), change.shape)
            if change[i, j] < best:
                best, pair = float(change[i, j]), (int(some[i]), int(own[j]))
    first, second = (place(table.record, index) for index in sorted(pair))
    return f"{first} and {second} swapped", fit.squares + best


def _changes_by_swaps(output: Array, fit: _Fit, some: Places, own: Places) -> Array:
    """Change of the squared residuals by each swap of one of some readings with any of all."""
    d = output[own] - output[some, None]
    pull = fit.residual[some, None] - fit.residual[own]
    cross = fit.basis[some] @ fit.basis[own].T
    free_some, free_own = (1.0 - (fit.basis[at] ** 2).sum(axis=1) for at in (some, own))
    return np.asarray(2.0 * d * pull + d**2 * (free_some[:, None] + free_own + 2.0 * cross))
