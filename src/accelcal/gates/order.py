"""Gate on the order of positions: is there an order or sign that would fit far better."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask, Places
from accelcal.estimate.noise import ReadingNoise
from accelcal.estimate.tables import PreparedTable
from accelcal.gates.cells import Cells
from accelcal.gates.plan import TablePlan, once_a_plan
from accelcal.gates.replicate_plan import rank_and_inverse
from accelcal.gates.stack import TableStack
from accelcal.gates.swaps import SwapBlock, best_swap, swap_blocks
from accelcal.gates.verdict import GateStack, gate_stack, times
from accelcal.geometry import accelerations
from accelcal.model import COEFFICIENTS, design_matrix
from accelcal.numerics.grouping import products_of_groups
from accelcal.numerics.sorting import distinct

_MUCH_BETTER = 9.0  # another order must leave a ninth of the squared residuals, a third of the rms
_NOTHING = 1e-24  # squared residuals below this share of the squared outputs are rounding errors


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


class _Basis(NamedTuple):
    """A basis of the columns of a design in which their normal matrix is one."""

    columns: Array  # shape (n, p)
    of_design: Array  # from the columns of the design, shape (p, p)

    @classmethod
    def of(cls, design: Array) -> _Basis:
        columns, triangle = np.linalg.qr(design)
        return cls(columns, np.linalg.inv(triangle))

    def fit(self, output: Array) -> _Fit:
        """Fit readings of shape (n, T)."""
        values = self.columns.T @ output
        residual = output - self.columns @ values
        return _Fit(self, values, residual, (residual**2).sum(axis=0))


class _Fit(NamedTuple):
    """The fits in the order given."""

    basis: _Basis
    values: Array  # the coefficients in this basis, shape (p, T)
    residual: Array  # shape (n, T)
    squares: Array  # of the residuals, shape (T,)

    def of_tables(self, rows: Places) -> _Fit:
        arrays = (each[..., rows] for each in (self.values, self.residual, self.squares))
        return _Fit(self.basis, *arrays)


class _Groups(NamedTuple):
    """Groups of strokes that may be wrong against the others: single ones, and those back."""

    names: list[str]
    single: slice  # strokes
    back: Places  # strokes of one more group, none where there is no such group
    strokes: Cells

    @classmethod
    def of(cls, strokes: Cells) -> _Groups:
        numbers = strokes.key
        if numbers.size < 2:
            return cls([], slice(0, 0), np.zeros(0, dtype=np.intp), strokes)
        names, single = [f"stroke {number}" for number in numbers.tolist()], slice(0, numbers.size)
        if numbers.size == 2:
            names, single = [f"stroke {numbers[0]} or {numbers[1]}"], slice(1, 2)
        back = np.flatnonzero(numbers % 2 == 0)
        if back.size < 2:
            return cls(names, single, back[:0], strokes)
        return cls([*names, "the forward or the back strokes"], single, back, strokes)

    def sums(self, values: Array) -> Array:
        """Sum over the readings of each group, from shape (n, T) to shape (groups, T)."""
        return self._of_groups(self.strokes.sums(values))

    def products(self, values: Array, columns: Array) -> Array:
        """Sum values times columns over the readings of each group, shape (groups, T, k)."""
        strokes = self.strokes
        each = products_of_groups(values, columns, strokes.cell, strokes.members)
        return self._of_groups(each)

    def _of_groups(self, of_strokes: Array) -> Array:
        single = of_strokes[self.single]
        if not self.back.size:
            return single
        return np.concatenate([single, of_strokes[self.back].sum(axis=0, keepdims=True)])

    def readings(self, group: int) -> Mask:
        """Tell the readings of a group, shape (n,)."""
        place = self.single.start + group
        chosen = np.zeros(self.strokes.key.size, dtype=np.bool_)
        chosen[place if place < self.single.stop else self.back] = True
        return np.asarray(chosen[self.strokes.cell])


class _LeftOut(NamedTuple):
    """What fits without each group need."""

    groups: _Groups
    inverse: Array  # (1 - B' B)^-1 of the rows B of the basis of each group, shape (groups, p, p)

    @classmethod
    def of(cls, basis: Array, groups: _Groups) -> _LeftOut:
        normal = np.eye(basis.shape[1]) - groups.products(basis, basis)
        return cls(groups, rank_and_inverse(normal)[1])

    def squares(self, fit: _Fit) -> Array:
        """Least squared residuals of the fits without one of the groups, shape (T,).

        Where r are those of a group in the whole fit, they are less by r (1 - B B')^-1 r, which is
        r r + r B (1 - B' B)^-1 B' r.
        """
        pull = self.groups.products(fit.residual, fit.basis.columns)
        taken = self.groups.sums(fit.residual**2) + (pull @ self.inverse * pull).sum(axis=2)
        return np.asarray(fit.squares - taken.max(axis=0))


class _OrderPlan(NamedTuple):
    """What the other orders of tables of one plan are."""

    basis: _Basis
    groups: _Groups
    orders: list[_Order]
    left_out: _LeftOut
    swaps: list[SwapBlock]


@once_a_plan
def _order_plan(plan: TablePlan) -> _OrderPlan:
    basis, groups = _Basis.of(plan.design), _Groups.of(plan.strokes)
    orders = list(_other_orders(plan.angle, plan.head))
    left_out, swaps = _LeftOut.of(basis.columns, groups), swap_blocks(basis.columns, groups.strokes)
    return _OrderPlan(basis, groups, orders, left_out, swaps)


class _Found(NamedTuple):
    """Best other order of strokes of each table: its squares, infinite for none, and its place."""

    squares: Array
    order: Places
    group: Places


def order_of_positions(stack: TableStack) -> GateStack:
    """Look for another order of positions under which the fit would be far better.

    Parameters
    ----------
    stack : TableStack
        The tables.

    Returns
    -------
    GateStack
        A warning where mirroring, shifting or negating a stroke, or swapping two readings of it,
        would leave a third of the residuals or less.

    Notes
    -----
    What is wrong with all strokes alike leaves no residual: a shift shows as a misalignment out of
    proportion, a negative sign as a negative scale factor. A mirror turns the signs of M and M_ip
    and shows nowhere.
    """
    rows = np.flatnonzero(~_is_clear(stack))
    better = _better_orders(stack, rows) if rows.size else {}
    bad = np.zeros(len(stack), dtype=np.bool_)
    bad[list(better)] = True

    def said(index: int) -> str:
        return better[index]() if bad[index] else "no other order of positions fits far better"

    none_left = len(stack.plan.design) <= stack.plan.design.shape[1]
    missing = [(none_left, "no residual to compare orders by")]
    return gate_stack("order of positions", bad, said, missing)


def _is_clear(stack: TableStack) -> Mask:
    """Tables of which no other order can fit far better, shape (T,).

    It leaves the strokes of one direction as they are. Whatever is fitted to these, the scatter of
    their readings at one angle is left.
    """
    directions, back = stack.plan.directions, stack.plan.stroke % 2 == 0
    cells = directions._replace(weight=directions.members, precision=None)
    scatter = cells.centred(stack.output) ** 2
    left = np.minimum(scatter[back].sum(axis=0), scatter[~back].sum(axis=0))
    return np.asarray((stack.residual**2).sum(axis=0) <= _MUCH_BETTER * left)


def _better_orders(stack: TableStack, rows: Places) -> dict[int, Callable[[], str]]:
    """Tables among some that another order would fit far better, and what tells which."""
    plan, output = _order_plan(stack.plan), stack.output[:, rows]
    fit = plan.basis.fit(output)
    other = _best_order(stack, output, fit)
    swap = best_swap(output, fit.residual, plan.basis.columns, plan.swaps, _MUCH_BETTER)
    best = np.maximum(np.minimum(other.squares, swap.squares), _least(output))

    def said(at: int) -> str:
        pair = [stack.place(int(rows[at]), reading) for reading in swap.pair[at].tolist()]
        how = f"{' and '.join(pair)} swapped"
        if other.squares[at] <= swap.squares[at]:
            how = f"{plan.groups.names[other.group[at]]} {plan.orders[other.order[at]].said}"
        ratio = times(float(np.sqrt(fit.squares[at] / best[at])))
        return f"the residuals would be {ratio} times smaller with {how}"

    bad = np.flatnonzero(fit.squares > _MUCH_BETTER * best).tolist()
    return {int(rows[at]): partial(said, at) for at in bad}


def _least(output: Array) -> Array:
    """Squared residuals that rounding makes, shape (T,)."""
    return np.asarray(_NOTHING * (output**2).sum(axis=0))


def order_of_strokes(table: PreparedTable, delta0: float) -> OtherOrder | None:
    """Find the other order of one or more strokes under which the fit would be far better.

    Parameters
    ----------
    table : PreparedTable
        The table.
    delta0 : float
        Fixture angle of the fit [rad].

    Returns
    -------
    OtherOrder or None
        None where none leaves a third of the residuals or less.
    """
    if len(table.record) <= len(table.estimability.kept):
        return None
    nothing = np.zeros(len(COEFFICIENTS))
    stack = TableStack.of([table], [nothing], [ReadingNoise(np.nan, 0.0, "none")], delta0)
    plan = _order_plan(stack.plan)
    fit = plan.basis.fit(stack.output)
    found = _best_order(stack, stack.output, fit)
    squares, left = float(fit.squares[0]), float(found.squares[0])
    least = max(left, float(_least(stack.output)[0]))
    if squares <= _MUCH_BETTER * least:
        return None
    order, group = plan.orders[found.order[0]], int(found.group[0])
    said = f"{plan.groups.names[group]} {order.said}"
    chosen = plan.groups.readings(group)
    return OtherOrder(said, left, chosen, order.angle, order.sign, squares / least)


def _best_order(stack: TableStack, output: Array, fit: _Fit) -> _Found:
    """The best of the other orders of strokes of each of some tables."""
    plan = _order_plan(stack.plan)
    groups, orders = plan.groups, plan.orders
    nothing = np.zeros(fit.squares.size, dtype=np.intp)
    found = _Found(np.full(fit.squares.size, np.inf), nothing, nothing.copy())
    if not groups.names:
        return found
    # Leaving a group out fits at least as well as any order of it: where even that is not much
    # better, no order need be tried.
    without = plan.left_out.squares(fit)
    rows = np.flatnonzero(without <= fit.squares / _MUCH_BETTER)
    if rows.size == 0:
        return found
    output, part = output[:, rows], fit.of_tables(rows)
    each = [_squares_of_groups(stack, output, part, order, groups) for order in orders]
    best = np.stack(each, axis=1).reshape(rows.size, -1).argmin(axis=1)
    found.order[rows], found.group[rows] = np.divmod(best, len(groups.names))
    for place in distinct(best).tolist():
        order, group = divmod(place, len(groups.names))
        own = best == place
        chosen = groups.readings(group)
        found.squares[rows[own]] = _squares(stack, output[:, own], orders[order], chosen)
    return found


def _other_orders(angle: Array, head: Array) -> Iterator[_Order]:
    """Mirror, shifts by one position or two, either way, or by half a turn, and other sign."""
    yield _Order("mirrored (J counted against the turn)", -angle)
    step = float(np.diff(distinct(head)).min(initial=360.0))
    for count, word in ((1, "one position"), (2, "two positions")):
        if step * count < 180.0:
            yield _Order(f"shifted by {word}", angle + count * step)
            yield _Order(f"shifted by {word} the other way", angle - count * step)
    yield _Order("shifted by half a turn", angle + 180.0)
    yield _Order("of the other sign", angle, -1.0)


def _design(stack: TableStack, order: _Order) -> Array:
    mounting = stack.table.mounting
    design = design_matrix(accelerations(order.angle, stack.delta0, mounting), mounting)
    return design[:, stack.table.estimability.columns]


def _squares_of_groups(
    stack: TableStack, output: Array, fit: _Fit, order: _Order, groups: _Groups
) -> Array:
    """Squared residuals after refitting with each group in another order, shape (T, groups).

    Other rows change the normal matrix 1 by D, the right-hand side by d and the squares by q, each
    a sum over the readings concerned; refitting leaves squares + q - d (1 + D)^-1 d. So no design
    of a whole table is needed for each group, and D is the same for all tables.
    """
    basis = _design(stack, order) @ fit.basis.of_design
    residual = order.sign * output - basis @ fit.values
    given = _sums(groups, fit.basis.columns, fit.residual)
    pairs = zip(_sums(groups, basis, residual), given, strict=True)
    squares, right, normal = (other - own for other, own in pairs)
    _, inverse = rank_and_inverse(np.eye(normal.shape[1]) + normal)
    return np.asarray(fit.squares[:, None] + (squares - (right @ inverse * right).sum(axis=2)).T)


def _sums(groups: _Groups, basis: Array, residual: Array) -> tuple[Array, Array, Array]:
    """What each group adds to the squares, to the right-hand side and to the normal matrix."""
    return (
        groups.sums(residual**2),
        groups.products(residual, basis),
        groups.products(basis, basis),
    )


def _squares(stack: TableStack, output: Array, order: _Order, chosen: Mask) -> Array:
    """Squared residuals of one order, (T,), without the rounding errors of the update."""
    design = np.where(chosen[:, None], _design(stack, order), stack.table.kept_design)
    return _Basis.of(design).fit(np.where(chosen, order.sign, 1.0)[:, None] * output).squares
