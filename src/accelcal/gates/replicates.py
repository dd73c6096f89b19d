"""Gates on replicates: closure of the turn, forward against back, an outlier."""

from __future__ import annotations

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.noise import FEW
from accelcal.gates.stack import TableStack
from accelcal.gates.trend import Cells, contracted, rank_and_inverse
from accelcal.gates.verdict import (
    SIGNIFICANT,
    GateStack,
    acceleration,
    gate_stack,
    reading_name,
)
from accelcal.grouping import grouped
from accelcal.probability import f_exceeds
from accelcal.record import TumbleRecord

__all__ = ["closure", "forward_against_back", "outlier", "place"]

Array = NDArray[np.float64]
Places = NDArray[np.intp]

_ROUNDING = 1e-9
_LEAST_FREE = 1e-6  # a reading that a mean and a trend follow wholly tells nothing of itself


def closure(stack: TableStack, level: float = SIGNIFICANT) -> GateStack:
    """Test Y9 - Y1 of the strokes, and the same as end minus start in the order of time.

    Parameters
    ----------
    stack : TableStack
        The tables.
    level : float, default 0.01
        False-alarm rate of each table.

    Returns
    -------
    GateStack
        A warning where either mean is significant.

    Notes
    -----
    Two tests of Student, each at half the false-alarm rate, on what a drift over the run leaves.
    """
    contrasts = _contrasts_of_returns(stack.table.record)
    scatter, dof = _clean_scatter(stack)
    known = dof > 0.0
    weights = stack.apart.blind(contrasts, stack.trend.columns)
    means = contracted(weights, stack.output)
    size = np.sqrt((weights**2).sum(axis=1)).T
    errors = np.where(known, np.fmax(scatter, stack.smallest), 1.0) * size
    t = (np.abs(means) / np.where(errors > 0.0, errors, 1.0)).max(axis=0)
    bad = f_exceeds(level / 2.0, t**2, 1.0, np.where(known, dof, 1.0))

    def said(index: int) -> str:
        told = np.append(means[:, index], errors[:, index].max()) / stack.scale[index]
        sizes = map(acceleration, told.tolist())
        return "Y(return) - Y1 {}, end - start of a stroke {}, standard error {}".format(*sizes)

    missing = (
        (not contrasts.any(), "no stroke holds both the first position and the return"),
        (~known, "nothing tells the reading noise; repeat the strokes"),
    )
    return gate_stack("closure", bad, said, missing)


def _contrasts_of_returns(record: TumbleRecord) -> Array:
    """Weights that make return minus start, and end minus start in time, shape (n, 2)."""
    start = record.angle.min()
    first, last = (np.abs(record.angle - at) < 1e-6 for at in (start, start + 360.0))
    strokes, stroke, _ = grouped(record.stroke)
    weight = np.zeros(len(record))
    for own, sign in ((first, -1.0), (last, 1.0)):
        readings = np.bincount(stroke[own], minlength=strokes.size)
        weight[own] = sign / readings[stroke[own]]
    whole = [np.bincount(stroke[own], minlength=strokes.size) > 0 for own in (first, last)]
    paired = whole[0] & whole[1]
    weight *= paired[stroke] / max(int(paired.sum()), 1)
    return np.column_stack([weight, np.where(record.stroke % 2 == 1, weight, -weight)])


def _clean_scatter(stack: TableStack) -> tuple[Array, Array]:
    """Scatter of the readings that a fault of closure does not enlarge, and its dof.

    Of shape (T,), or of one number for all tables.
    """
    found = stack.apart
    squares, dof = found.squares, found.dof
    if (found.dof < FEW).any():
        beside, of_beside = _beside_the_return(stack)
        squares, dof = (
            np.where(found.dof >= FEW, of_cells, of_fit)
            for of_cells, of_fit in ((squares, beside), (dof, of_beside))
        )
    scatter = np.sqrt(squares / np.where(dof > 0.0, dof, np.nan))
    if not stack.declared.any():
        return scatter, dof
    return (
        np.where(stack.declared, stack.noise * stack.scatter, scatter),
        np.where(stack.declared, stack.noise_dof, dof),
    )


def _beside_the_return(stack: TableStack) -> tuple[Array, float]:
    """Squared residuals of a fit in which the return has a mean of its own, and their dof."""
    angle = stack.table.record.angle
    returned = angle > angle.min() + 360.0 - 1e-6
    design = np.column_stack([stack.table.kept_design, returned])
    basis = np.linalg.qr(design).Q
    residual = stack.output - basis @ (basis.T @ stack.output)
    return (residual**2).sum(axis=0), float(angle.size - design.shape[1])


def forward_against_back(stack: TableStack, level: float = SIGNIFICANT) -> GateStack:
    """Compare the two directions at each position.

    Parameters
    ----------
    stack : TableStack
        The tables.
    level : float, default 0.01
        False-alarm rate of each table.

    Returns
    -------
    GateStack
        A warning where the differences are significant by Fisher's test.

    Notes
    -----
    With two strokes or more in each direction, the differences are held against the scatter of
    the strokes, a drift over the run aside; with fewer, their part that follows 1, cos th and
    sin th, as that of backlash does, is held against the rest of them.
    """
    record, (angles, place, _) = stack.table.record, grouped(stack.table.head)
    by_head = Cells.of(2 * place + record.stroke % 2)
    squares, part, rest, dof = _of_directions(stack, by_head, angles)
    known = np.minimum(part, dof) >= 1.0
    dof1, dof2 = np.where(known, part, 1.0), np.where(known, dof, 1.0)
    ratio = squares / dof1 / np.maximum(rest / dof2, stack.smallest**2)
    bad = f_exceeds(level, ratio, dof1, dof2)
    found = cache(lambda: _Directions.of(stack, by_head, by_head.means(stack.output)))

    def said(index: int) -> str:
        told = found().difference[:, index] / stack.scale[index]
        at = np.abs(told).argmax()
        mean, largest = acceleration(told.mean()), acceleration(told[at])
        return f"mean {mean}, largest {largest} at {angles[found().place[at]]:g} deg"

    missing = (
        (not _backs(by_head).size, "needs strokes in both directions"),
        (~known, "needs more positions, or two strokes in each direction"),
    )
    return gate_stack("forward against back", bad, said, missing)


def _backs(cells: Cells) -> Places:
    """Cells of the strokes back at places that are read in both directions; the next is forward."""
    return np.flatnonzero((cells.key[:-1] % 2 == 0) & (np.diff(cells.key) == 1))


class _Directions(NamedTuple):
    """Forward minus back, a drift set aside, at each place that is read in both directions.

    The differences of the readings have the shape (pairs, T), those of the columns of the drift
    (D, pairs, q); the variance, (pairs, 1), is that of a difference over that of a reading.
    """

    place: Places
    difference: Array
    of_trend: Array
    variance: Array

    @classmethod
    def of(cls, stack: TableStack, cells: Cells, means: Array) -> _Directions:
        back = _backs(cells)
        of_means, of_trend = (
            each[..., back + 1, :] - each[..., back, :]
            for each in (means, cells.means(stack.trend.columns))
        )
        drift = contracted(of_trend.swapaxes(1, 2), stack.apart.trend)
        variance = 1.0 / cells.members[back + 1] + 1.0 / cells.members[back]
        return cls(cells.key[back] // 2, of_means - drift, of_trend, variance[:, None])


def _of_directions(
    stack: TableStack, by_head: Cells, angles: Array
) -> tuple[Array, Array, Array, Array]:
    """Squares of the directions and their dof, and the same of what they are held against."""
    squares, part = _added_by_directions(stack)
    rest, dof = stack.apart.squares, stack.apart.dof
    if (dof >= FEW).all() or not _backs(by_head).size:
        return squares, part, rest, dof
    found = _Directions.of(stack, by_head, by_head.means(stack.output))
    like, unlike = _backlash_like(found.difference / np.sqrt(found.variance), angles[found.place])
    many = dof >= FEW
    return (
        np.where(many, squares, like),
        np.where(many, part, 3.0),
        np.where(many, rest, unlike),
        np.where(many, dof, found.place.size - 3.0),
    )


def _added_by_directions(stack: TableStack) -> tuple[Array, Array]:
    """By how much both directions together leave more squares than apart, and the dof of that.

    Together the drift has to follow the differences too: of their squares d d and the normal matrix
    N within the directions it takes d X (N + X X)^-1 X d, where X are its own differences.
    """
    apart, record = stack.apart, stack.table.record
    found = _Directions.of(stack, apart.cells, apart.means)
    difference, of_trend = (
        each / np.sqrt(found.variance) for each in (found.difference, found.of_trend)
    )
    together = Cells.of(grouped(np.round(record.angle, 6))[1])
    rank, inverse, _ = rank_and_inverse(together.centred(stack.trend.columns))
    pull = contracted(of_trend, difference)
    squares = (difference**2).sum(axis=0) - (pull * contracted(inverse, pull)).sum(axis=0)
    return squares, found.place.size + apart.rank - rank


def _backlash_like(difference: Array, angle: Array) -> tuple[Array, Array]:
    """Squares of the part of the differences that follows 1, cos and sin, and of the rest."""
    th = np.radians(angle)
    pattern = np.column_stack([np.ones_like(th), np.cos(th), np.sin(th)])
    basis, singular, _ = np.linalg.svd(pattern, full_matrices=False)
    least = max(pattern.shape) * np.finfo(float).eps * singular[0]
    basis = basis[:, singular > least]
    fitted = basis @ (basis.T @ difference)
    return (fitted**2).sum(axis=0), ((difference - fitted) ** 2).sum(axis=0)


def outlier(stack: TableStack, level: float = SIGNIFICANT) -> GateStack:
    """Test the reading that its replicates contradict most.

    Parameters
    ----------
    stack : TableStack
        The tables.
    level : float, default 0.01
        False-alarm rate of each table.

    Returns
    -------
    GateStack
        A warning where its deviation from the other strokes is significant.

    Notes
    -----
    Student's test of the deleted deviation, a drift over the run aside, at the false-alarm rate
    over all readings (Bonferroni): t^2 = u / ((s - u) / dof), where s are the squared deviations
    and u = d^2 / free what leaving the reading out takes off them. Of two readings at a position
    nothing tells which one is wrong.
    """
    found = stack.replicates(grouped(stack.table.head)[1])
    dof, size = found.dof - 1.0, found.cells.members[found.cells.cell]
    known = dof >= 1.0
    free = np.where(size > 1, np.maximum(found.free, _LEAST_FREE), np.inf).T
    squares = found.residual**2
    taken = squares / free
    most = taken.max(axis=0)
    rest = np.maximum(squares.sum(axis=0) - most, stack.smallest**2)
    ratio = most / (rest / np.where(known, dof, 1.0))
    bad = f_exceeds(level / size.size, ratio, 1.0, np.where(known, dof, 1.0))

    def said(index: int) -> str:
        # of readings as far away but for rounding errors the first
        worst = (taken[:, index] > (1.0 - _ROUNDING) * most[index]).argmax()
        own = found.cells.cell == found.cells.cell[worst]
        pair = own.sum() == 2
        alike = np.flatnonzero(own) if pair else [worst]
        names = " or ".join(stack.place(index, int(reading)) for reading in alike)
        others = "stroke" if pair else "strokes"
        away = (found.residual / free)[worst, index] / stack.scale[index]
        t = math.sqrt(ratio[index])
        return f"{names} is {acceleration(away)} from the other {others}, t = {t:.3g}"

    few = ~known, "no position is read often enough; repeat the strokes"
    return gate_stack("outlier", bad, said, [few])


def place(record: TumbleRecord, index: int) -> str:
    """Say which reading it is.

    Parameters
    ----------
    record : TumbleRecord
        The readings.
    index : int
        The reading.

    Returns
    -------
    str
        Stroke, angle and line.
    """
    return reading_name(record, index, record.line)
