"""Gate on the order of positions: is there an order, sign or swap that would fit far better."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array, Mask, Places
from accelcal.estimate.noise import ReadingNoise
from accelcal.estimate.tables import PreparedTable
from accelcal.gates.plan import Cells, TablePlan, once_a_plan, rank_and_inverse
from accelcal.gates.stack import TableStack
from accelcal.gates.stroke_groups import Basis, Fit, Groups, LeftOut, differ_by_waves, odd_strokes
from accelcal.gates.verdict import GateStack, gate_stack, times
from accelcal.model import COEFFICIENTS
from accelcal.numerics.grouping import Grouped, distinct, few_at_a_time
from accelcal.plural import listed

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


_MUCH_BETTER = 9.0  # another order must leave a ninth of the squared residuals, a third of the rms
_NOTHING = 1e-24  # squared residuals below this share of the squared outputs are rounding errors


class _Order(NamedTuple):
    """Another order of the readings, for some of the strokes."""

    said: str
    angle: Array
    sign: float = 1.0


class OtherOrder(NamedTuple):
    """Another order of positions in some strokes, under which the fit would be better."""

    said: str  # which strokes, and what of them
    squares: float  # squared residuals that it would leave
    chosen: Mask  # readings of these strokes, shape (n,)
    angle: Array  # head angles of all readings in this order [deg], shape (n,)
    sign: float  # of the output of these strokes
    better: float  # the squared residuals over those


class _OrderPlan(NamedTuple):
    """What the other orders of tables of one plan are."""

    basis: Basis
    groups: Groups
    orders: list[_Order]
    left_out: LeftOut
    swaps: list[SwapBlock]


@once_a_plan
def _order_plan(plan: TablePlan) -> _OrderPlan:
    basis, groups = Basis.of(plan.design), Groups.of(plan.strokes)
    orders = list(_other_orders(plan.angle, plan.head))
    left_out, swaps = LeftOut.of(basis.columns, groups), swap_blocks(basis.columns, groups.strokes)
    return _OrderPlan(basis, groups, orders, left_out, swaps)


class _Found(NamedTuple):
    """Best other order of some strokes of each of T tables."""

    squares: Array  # shape (T,), infinite where none is found
    order: Places  # its place, shape (T,)
    strokes: Mask  # shape (S, T)

    def take(self, rows: Places, squares: Array, order: int, strokes: Mask) -> None:
        """Take an order of some tables, where it is better than what is found."""
        ahead = squares < self.squares[rows]
        own = rows[ahead]
        self.squares[own], self.order[own] = squares[ahead], order
        self.strokes[:, own] = strokes[:, None]


def order_of_positions(stack: TableStack) -> GateStack:
    """Look for another order of positions under which the fit would be far better.

    It warns where mirroring, shifting or negating strokes, or swapping two readings of one, would
    leave a third of the residuals or less.

    Notes
    -----
    What is wrong with all strokes alike leaves no residual: a shift shows as a misalignment out of
    proportion, a negative sign as a negative scale factor. A mirror turns the signs of M and M_ip
    and shows nowhere.
    """
    bad = ~_is_clear(stack) | differ_by_waves(stack.plan, stack.residual)
    rows, better = np.flatnonzero(bad), {}
    left = (stack.residual[:, rows] ** 2).sum(axis=0)
    rows = rows[left > _MUCH_BETTER * _least(stack.output[:, rows])]
    if stack.there is None:
        better = _better_orders(stack, rows) if rows.size else {}
        bad[:] = False
        bad[list(better)] = True

    def said(index: int) -> str:
        return better[index]() if bad[index] else "no other order of positions fits far better"

    none_left = len(stack.plan.design) <= stack.plan.design.shape[1]
    missing = [(none_left, "no residual to compare orders by")]
    return gate_stack("order of positions", bad, said, missing)


def _is_clear(stack: TableStack) -> Mask:
    """Tables of which no other order of a stroke, or of one direction, can fit far better, (T,).

    It leaves the strokes of one direction as they are. Whatever is fitted to these, the scatter of
    their readings at one angle is left.
    """
    directions, back = stack.plan.directions, stack.plan.stroke % 2 == 0
    cells = Cells.over(directions.readings, stack.plan.there)
    scatter = cells.centred(stack.known(stack.output)) ** 2
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
            who = _named(plan.groups.strokes.key, other.strokes[:, at])
            how = f"{who} {plan.orders[other.order[at]].said}"
        ratio = times(float(np.sqrt(fit.squares[at] / best[at])))
        return f"the residuals would be {ratio} times smaller with {how}"

    bad = np.flatnonzero(fit.squares > _MUCH_BETTER * best).tolist()
    return {int(rows[at]): partial(said, at) for at in bad}


def _least(output: Array) -> Array:
    """Squared residuals that rounding makes, shape (T,)."""
    return np.asarray(_NOTHING * (output**2).sum(axis=0))


def order_of_strokes(table: PreparedTable, delta0: float) -> OtherOrder | None:
    """Find the other order of one or more strokes under which the fit would be far better.

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
    order, wrong, strokes = plan.orders[found.order[0]], found.strokes[:, 0], plan.groups.strokes
    said, chosen = f"{_named(strokes.key, wrong)} {order.said}", wrong[strokes.cell]
    return OtherOrder(said, left, chosen, order.angle, order.sign, squares / least)


def _named(numbers: NDArray[Any], wrong: Mask) -> str:
    """Say which strokes are wrong, as far as the fit tells them from the others."""
    own, others = numbers[wrong].tolist(), numbers[~wrong].tolist()
    if len(own) == len(others) == 1:
        return f"stroke {others[0]} or {own[0]}"
    if len(own) == 1:
        return f"stroke {own[0]}"
    if {number % 2 for number in own}.isdisjoint(number % 2 for number in others):
        return "the forward or the back strokes"
    named = f"strokes {listed(map(str, own), most=len(own))}"
    return named if len(own) < len(others) else f"{named}, or all the others,"


def _best_order(stack: TableStack, output: Array, fit: Fit) -> _Found:
    """The best of the other orders of strokes of each of some tables."""
    tables, strokes = fit.squares.size, stack.plan.strokes.key.size
    nothing = np.zeros(tables, dtype=np.intp), np.zeros((strokes, tables), dtype=np.bool_)
    found = _Found(np.full(tables, np.inf), *nothing)
    _look_at_groups(stack, output, fit, found)
    _look_at_sets(stack, output, fit, found)
    return found


def _look_at_groups(stack: TableStack, output: Array, fit: Fit, found: _Found) -> None:
    """Try the orders of single strokes, and of those of one direction."""
    plan = _order_plan(stack.plan)
    groups, orders = plan.groups, plan.orders
    if not len(groups.members):
        return
    # Leaving a group out fits at least as well as any order of it: where even that is not much
    # better, no order need be tried.
    rows = np.flatnonzero(plan.left_out.squares(fit) <= fit.squares / _MUCH_BETTER)
    if rows.size == 0:
        return
    some, part = output[:, rows], fit.of_tables(rows)
    each = [_squares_of_groups(stack, some, part, order, groups) for order in orders]
    best = np.stack(each, axis=1).reshape(rows.size, -1).argmin(axis=1)
    for place in distinct(best).tolist():
        order, group = divmod(place, len(groups.members))
        own, wrong = rows[best == place], groups.members[group]
        found.take(own, _squares(stack, output[:, own], orders[order], wrong), order, wrong)


def _look_at_sets(stack: TableStack, output: Array, fit: Fit, found: _Found) -> None:
    """Try the orders of several strokes at once, of those that hold another wave than most."""
    is_open = found.squares > fit.squares / _MUCH_BETTER
    rows = np.flatnonzero(is_open & differ_by_waves(stack.plan, fit.residual))
    if rows.size == 0:
        return
    for place, order in enumerate(_order_plan(stack.plan).orders):
        odd = odd_strokes(stack.plan, output[:, rows], order.angle, order.sign)
        sets, which = np.unique(odd, axis=1, return_inverse=True)
        for number, wrong in enumerate(sets.T):
            own = rows[which.ravel() == number]  # numpy 2.0.0 gives it two axes
            if wrong.any():
                found.take(own, _squares(stack, output[:, own], order, wrong), place, wrong)


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
    design = stack.table.design_at(order.angle, stack.delta0)
    return design[:, stack.table.estimability.columns]


def _squares_of_groups(
    stack: TableStack, output: Array, fit: Fit, order: _Order, groups: Groups
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


def _sums(groups: Groups, basis: Array, residual: Array) -> tuple[Array, Array, Array]:
    """What each group adds to the squares, to the right-hand side and to the normal matrix."""
    return (
        groups.sums(residual**2),
        groups.products(residual, basis),
        groups.products(basis, basis),
    )


def _squares(stack: TableStack, output: Array, order: _Order, wrong: Mask) -> Array:
    """Squared residuals of one order of some strokes, (T,), without rounding errors of updates."""
    chosen = wrong[stack.plan.strokes.cell]
    design = np.where(chosen[:, None], _design(stack, order), stack.table.kept_design)
    return Basis.of(design).fit(np.where(chosen, order.sign, 1.0)[:, None] * output).squares
