"""Gates on replicates: closure of the turn, forward against back, an outlier."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask, Places
from accelcal.estimate.trend import FEW, directed
from accelcal.gates.plan import Cells, TablePlan, beside, contracted, once_a_plan, rank_and_inverse
from accelcal.gates.stack import TableStack
from accelcal.gates.stroke_groups import Basis
from accelcal.gates.verdict import GateStack, acceleration, gate_stack
from accelcal.numerics.grouping import distinct
from accelcal.numerics.probability import f_exceeds

_LEAST_FREE = 1e-6
"""Share of a reading that mean and trend leave free; below it, the residual says nothing of it."""


def closure(stack: TableStack, level: float) -> GateStack:
    """Test Y9 - Y1 of the strokes, and the same as end minus start in the order of time.

    It warns where either mean is significant.

    Notes
    -----
    Two tests of Student, each at half the false-alarm rate, on what a drift over the run leaves.
    """
    returns, (scatter, dof) = _returns(stack.plan), _clean_scatter(stack)
    known = dof > 0.0
    means = contracted(returns.weights, stack.alike)
    errors = np.where(known, np.fmax(scatter, stack.smallest), 1.0) * returns.size
    t = (np.abs(means) / np.where(errors > 0.0, errors, 1.0)).max(axis=0)
    bad = f_exceeds(level / 2.0, t**2, 1.0, np.where(known, dof, 1.0))

    def said(index: int) -> str:
        told = np.append(means[:, index], errors[:, index].max()) / stack.scale[index]
        sizes = map(acceleration, told.tolist())
        return "Y(return) - Y1 {}, end - start of a stroke {}, standard error {}".format(*sizes)

    missing = (
        (~returns.any, "no stroke holds both the first position and the return"),
        (~known, "the reading noise is unknown; repeat the strokes"),
    )
    return gate_stack("closure", bad, said, missing)


class _Returns(NamedTuple):
    """Where there are any, (D,), weights that make both contrasts, (D, n, 2), and sizes, (2, D).

    A drift over the run does not move the contrasts, see `_contrasts_of_returns`.
    """

    any: Mask
    weights: Array
    size: Array


@once_a_plan
def _returns(plan: TablePlan) -> _Returns:
    contrasts = plan.size[:, None] * _contrasts_of_returns(plan)
    weights = plan.apart.blind(contrasts, plan.columns)
    return _Returns(
        np.asarray(contrasts.any(axis=(1, 2))), weights, np.sqrt((weights**2).sum(axis=1)).T
    )


def _contrasts_of_returns(plan: TablePlan) -> Array:
    """Weights that make return minus start, and end minus start in time, shape (D, n, 2)."""
    start = plan.angle.min()
    ends = 1.0 * (np.abs(plan.angle[:, None] - [start, start + 360.0]) < 1e-6)
    ends = ends[None] if plan.there is None else plan.there[..., None] * ends
    weights = ends / plan.size[:, None] ** 2
    readings, total = plan.strokes.sums(ends), plan.strokes.sums(weights)
    total[readings == 0.0] = 1.0
    variance = (np.where(readings > 0.0, readings, np.inf) / total).sum(axis=-1)
    share = 1.0 / variance  # 0 where the stroke lacks its first or its last reading
    whole = share.sum(axis=-1, keepdims=True)
    share /= np.where(whole > 0.0, whole, 1.0)
    weights *= (share[..., None] / total)[:, plan.strokes.cell]
    weight = weights[..., 1] - weights[..., 0]
    return np.stack([weight, np.where(plan.stroke % 2 == 1, weight, -weight)], axis=-1)


def _clean_scatter(stack: TableStack) -> tuple[Array, Array]:
    """Scatter of the readings that a fault of closure does not enlarge, and its dof.

    Of shape (T,), or of one number for all tables.
    """
    squares, dof = stack.apart.squares, stack.plan.apart.dof
    if (dof < FEW).any():
        many, (beside, of_beside) = dof >= FEW, _beside_the_return(stack)
        squares, dof = np.where(many, squares, beside), np.where(many, dof, of_beside)
    scatter = np.sqrt(squares / np.where(dof > 0.0, dof, np.nan))
    if not stack.declared.any():
        return scatter, dof
    return (
        np.where(stack.declared, stack.noise * stack.scatter, scatter),
        np.where(stack.declared, stack.noise_dof, dof),
    )


def _beside_the_return(stack: TableStack) -> tuple[Array, float]:
    """Squared residuals of a fit in which the return has a mean of its own, and their dof."""
    basis = _basis_with_return(stack.plan)
    return basis.fit(stack.alike).squares, float(np.subtract(*basis.columns.shape))


@once_a_plan
def _basis_with_return(plan: TablePlan) -> Basis:
    returned = plan.angle > plan.angle.min() + 360.0 - 1e-6
    return Basis.of(plan.alike(np.column_stack([plan.design, returned])))


def forward_against_back(stack: TableStack, level: float) -> GateStack:
    """Compare the two directions at each position.

    It warns where the differences are significant by Fisher's test.

    Notes
    -----
    With two strokes or more in each direction, the differences are held against the scatter of
    the strokes, a drift over the run aside; with fewer, their part that follows 1, cos th and
    sin th, as that of backlash does, is held against the rest of them.
    """
    plan = stack.plan
    squares, part, rest, dof = _of_directions(stack)
    known = np.minimum(part, dof) >= 1.0
    dof1, dof2 = np.where(known, part, 1.0), np.where(known, dof, 1.0)
    ratio = squares / dof1 / np.maximum(rest / dof2, stack.smallest**2)
    bad = f_exceeds(level, ratio, dof1, dof2)

    def said(index: int) -> str:
        told = _difference_at_head(stack, [index])[:, 0] / stack.scale[index]
        at = np.abs(told).argmax()
        mean, largest = acceleration(told.mean()), acceleration(told[at])
        return f"mean {mean}, largest {largest} at {_at_head(plan).angle[at]:g} deg"

    missing = (
        (not _both_ways(plan), "needs strokes in both directions"),
        (~known, "needs more positions, or two strokes in each direction"),
    )
    return gate_stack("forward against back", bad, said, missing)


class _Pairs(NamedTuple):
    """Places that are read in both directions."""

    cells: Cells  # readings of one place and one direction
    back: Places  # cells of the strokes back at these places; the next is forward
    angle: Array  # where they are [deg], shape (pairs,)
    of_trend: Array  # forward minus back of the columns of the trend, shape (D, pairs, q)
    variance: Array  # of forward minus back over that of a reading, shape (pairs,) or (T, pairs)

    @classmethod
    def of(cls, angle: Array, cells: Cells, plan: TablePlan) -> _Pairs:
        key = cells.readings.key
        back = np.flatnonzero((key[:-1] % 2 == 0) & (np.diff(key) == 1))
        means = cells.means(plan.columns)
        variance = 1.0 / cells.weight[..., back + 1] + 1.0 / cells.weight[..., back]
        where = distinct(np.round(angle, 6))[key[back] // 2]
        return cls(cells, back, where, means[:, back + 1] - means[:, back], variance)

    def differences(self, means: Array, trend: Array) -> Array:
        """Forward minus back, a drift set aside, shape (pairs, T)."""
        drift = contracted(self.of_trend.mT, trend)
        return np.asarray(means[self.back + 1] - means[self.back] - drift)


@once_a_plan
def _at_head(plan: TablePlan) -> _Pairs:
    return _Pairs.of(plan.head, plan.cells(directed(plan.head, plan.stroke)), plan)


def _both_ways(plan: TablePlan) -> bool:
    """Whether any place is read in both directions."""
    at_head = plan.at_head.cells.readings
    forward = np.bincount(at_head.cell, plan.stroke % 2)
    return bool(((forward > 0.0) & (forward < at_head.members)).any())


def _difference_at_head(stack: TableStack, tables: Sequence[int] | slice = slice(None)) -> Array:
    """Forward minus back at each head position of some tables, a drift set aside."""
    pairs, trend = _at_head(stack.plan), stack.apart.trend[:, tables]
    if len(pairs.of_trend) > 1:
        pairs = pairs._replace(of_trend=pairs.of_trend[tables])
    return pairs.differences(pairs.cells.means(stack.alike[:, tables]), trend)


def _of_directions(stack: TableStack) -> tuple[Array, Array, Array, Array]:
    """Squares of the directions and their dof, and the same of what they are held against."""
    squares, part = _added_by_directions(stack)
    rest, dof = stack.apart.squares, stack.plan.apart.dof
    if (dof >= FEW).all() or not _both_ways(stack.plan):
        return squares, part, rest, dof
    pairs = _at_head(stack.plan)
    standardised = _difference_at_head(stack) / np.sqrt(pairs.variance)[:, None]
    like, unlike = _backlash_like(standardised, pairs.angle)
    many = dof >= FEW
    return (
        np.where(many, squares, like),
        np.where(many, part, 3.0),
        np.where(many, rest, unlike),
        np.where(many, dof, pairs.angle.size - 3.0),
    )


def _added_by_directions(stack: TableStack) -> tuple[Array, Array]:
    """By how much both directions together leave more squares than apart, and the dof of that.

    With the directions together the drift has to follow their differences d too, of which its
    columns have X. Where N is the normal matrix of the drift within the directions, this leaves
    d d - d X (N + X X)^-1 X d more squares.
    """
    added = _directions(stack.plan)
    difference = added.pairs.differences(stack.apart.means, stack.apart.trend)
    difference /= np.sqrt(beside(added.pairs.variance, difference))
    pull = contracted(added.of_trend, difference)
    squares = (difference**2).sum(axis=0) - (pull * contracted(added.inverse, pull)).sum(axis=0)
    return squares, added.dof


class _Directions(NamedTuple):
    """Angles read in both directions, the X and (N + X X)^-1 of their trend, and their dof."""

    pairs: _Pairs
    of_trend: Array
    inverse: Array
    dof: Array


@once_a_plan
def _directions(plan: TablePlan) -> _Directions:
    pairs = _Pairs.of(plan.angle, plan.directions, plan)
    own = pairs.of_trend / np.sqrt(pairs.variance)[..., None]
    rank, inverse = rank_and_inverse(plan.apart.normal + own.mT @ own)
    return _Directions(pairs, own, inverse, pairs.back.size - (rank - plan.apart.rank))


def _backlash_like(difference: Array, angle: Array) -> tuple[Array, Array]:
    """Squares of the part of the differences that follows 1, cos and sin, and of the rest."""
    th = np.radians(angle)
    fit = Basis.of(np.column_stack([np.ones_like(th), np.cos(th), np.sin(th)])).fit(difference)
    return (fit.values**2).sum(axis=0), fit.squares


def outlier(stack: TableStack, level: float) -> GateStack:
    """Test the reading that its replicates contradict most.

    It warns where its deviation from the other strokes is significant.

    Notes
    -----
    Student's test of the deleted deviation, a drift over the run aside, at the false-alarm rate
    over all readings (Bonferroni): t^2 = u / ((s - u) / dof), where s are the squared deviations
    and u = d^2 / free what leaving the reading out takes off them. Of two readings at a position
    nothing tells which one is wrong.
    """
    plan = stack.plan.at_head
    found, dof = plan.fit(stack.alike), plan.dof - 1.0
    cell = plan.cells.readings.cell
    known, size = dof >= 1.0, plan.cells.members[..., cell]
    free = np.where(size > 1, np.maximum(plan.free, _LEAST_FREE), np.inf).T
    squares = found.residual**2
    taken = squares / free
    most = taken.max(axis=0)
    variance = (found.squares - most) / np.where(known, dof, 1.0)
    ratio = most / np.maximum(variance, stack.smallest**2)
    spread = stack.plan.spread
    doubt = 0.0 if spread is None else spread.doubt[taken.argmax(axis=0)]
    sure = 1.0 / (1.0 / np.where(known, dof, 1.0) + 0.5 * doubt)
    bad = f_exceeds(level / plan.cells.number, ratio * (1.0 + doubt), 1.0, sure)

    def said(index: int) -> str:
        worst = taken[:, index].argmax()
        own = cell == cell[worst]
        pair = own.sum() == 2
        alike = np.flatnonzero(own) if pair else [worst]
        names = " or ".join(stack.place(index, int(reading)) for reading in alike)
        others = "stroke" if pair else "strokes"
        own_unit = stack.plan.size[worst] / stack.scale[index]
        away = (found.residual[worst] / free[worst])[index] * own_unit
        t = math.sqrt(ratio[index])
        return f"{names} is {acceleration(away)} from the other {others}, t = {t:.3g}"

    few = ~known, "no position is read often enough; repeat the strokes"
    return gate_stack("outlier", bad, said, [few])
