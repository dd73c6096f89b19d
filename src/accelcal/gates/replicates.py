"""Gates on replicates: closure of the turn, forward against back, an outlier."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.noise import FEW
from accelcal.gates.stack import TableStack
from accelcal.gates.trend import Cells, contracted
from accelcal.gates.verdict import (
    SIGNIFICANT,
    GateStack,
    acceleration,
    gate_stack,
    reading_name,
)
from accelcal.grouping import grouped
from accelcal.probability import f_survival
from accelcal.record import TumbleRecord

__all__ = ["closure", "forward_against_back", "outlier", "place"]

Array = NDArray[np.float64]
Places = NDArray[np.intp]

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
        A warning where either mean is significant; the statistic is the larger t of Student.

    Notes
    -----
    Two tests of Student, each at half the false-alarm rate, on what a drift over the run leaves.
    """
    contrasts = _contrasts_of_returns(stack.table.record)
    scatter, dof = _clean_scatter(stack)
    known = dof > 0.0
    weights = stack.apart.blind(contrasts, stack.trend.columns)
    means = contracted(weights, stack.output)
    size = np.sqrt((weights**2).sum(axis=1))
    errors = np.where(known, np.fmax(scatter, stack.smallest), 1.0)[:, None] * size
    t = (np.abs(means) / np.where(errors > 0.0, errors, 1.0)).max(axis=1)
    p = 2.0 * f_survival(t**2, 1.0, np.where(known, dof, 1.0))
    told = np.column_stack([means, errors.max(axis=1)]) / stack.scale[:, None]

    def said(index: int) -> str:
        sizes = map(acceleration, told[index].tolist())
        return "Y(return) - Y1 {}, end - start of a stroke {}, standard error {}".format(*sizes)

    missing = (
        (not contrasts.any(), "no stroke holds both the first position and the return"),
        (~known, "nothing tells the reading noise; repeat the strokes"),
    )
    return gate_stack("closure", p < level, said, t, p, missing)


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
    """Scatter of the readings that a fault of closure does not enlarge, and its dof, (T,)."""
    found = stack.apart
    squares, dof = found.squares, np.broadcast_to(found.dof, len(stack))
    if (found.dof < FEW).any():
        beside, of_beside = _beside_the_return(stack)
        squares, dof = (
            np.where(dof >= FEW, of_cells, of_fit)
            for of_cells, of_fit in ((squares, beside), (dof, of_beside))
        )
    scatter = np.sqrt(squares / np.where(dof > 0.0, dof, np.nan))
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
    residual = stack.output - (stack.output @ basis) @ basis.T
    return (residual**2).sum(axis=1), float(angle.size - design.shape[1])


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
        A warning where the differences are significant by Fisher's test; the statistic is F.

    Notes
    -----
    With two strokes or more in each direction, the differences are held against the scatter of
    the strokes, a drift over the run aside; with fewer, their part that follows 1, cos th and
    sin th, as that of backlash does, is held against the rest of them.
    """
    angles, difference, variance = _differences(stack)
    if not angles.size:
        nobody = np.zeros(len(stack), dtype=np.bool_)
        missing = [(True, "needs strokes in both directions")]
        return gate_stack("forward against back", nobody, str, np.zeros(len(stack)), None, missing)
    squares, part, rest, dof = _of_directions(stack, angles, difference / np.sqrt(variance))
    known = np.minimum(part, dof) >= 1.0
    dof1, dof2 = np.where(known, part, 1.0), np.where(known, dof, 1.0)
    ratio = squares / dof1 / np.maximum(rest / dof2, stack.smallest**2)
    p = f_survival(ratio, dof1, dof2)
    worst = np.abs(difference).argmax(axis=1)
    told = difference / stack.scale[:, None]

    def said(index: int) -> str:
        at = worst[index]
        mean, largest = acceleration(told[index].mean()), acceleration(told[index, at])
        return f"mean {mean}, largest {largest} at {angles[at]:g} deg"

    few = ~known, "needs more positions, or two strokes in each direction"
    return gate_stack("forward against back", p < level, said, ratio, p, [few])


def _differences(stack: TableStack) -> tuple[Array, Array, Array]:
    """Positions read in both directions, forward minus back, and its variance over a reading's."""
    output = stack.output - contracted(stack.trend.columns.swapaxes(1, 2), stack.apart.trend)
    angles, row, _ = grouped(stack.table.head)
    cells = Cells.of(2 * row + stack.table.record.stroke % 2)
    back = np.flatnonzero((cells.key[:-1] % 2 == 0) & (np.diff(cells.key) == 1))
    means = cells.sums(output) / cells.members
    variance = 1.0 / cells.members
    return (
        angles[cells.key[back] // 2],
        means[:, back + 1] - means[:, back],
        variance[back + 1] + variance[back],
    )


def _of_directions(
    stack: TableStack, angles: Array, standardised: Array
) -> tuple[Array, Array, Array, Array]:
    """Squares of the directions and their dof, and the same of what they are held against."""
    apart = stack.apart
    together = stack.replicates(grouped(np.round(stack.table.record.angle, 6))[1])
    rest, part = apart.squares, together.dof - apart.dof
    squares, dof = together.squares - rest, apart.dof
    if (dof >= FEW).all():
        return squares, part, rest, dof
    like, unlike = _backlash_like(standardised, angles)
    many = dof >= FEW
    return (
        np.where(many, squares, like),
        np.where(many, part, 3.0),
        np.where(many, rest, unlike),
        np.where(many, dof, angles.size - 3.0),
    )


def _backlash_like(difference: Array, angle: Array) -> tuple[Array, Array]:
    """Squares of the part of the differences that follows 1, cos and sin, and of the rest."""
    th = np.radians(angle)
    pattern = np.column_stack([np.ones_like(th), np.cos(th), np.sin(th)])
    basis, singular, _ = np.linalg.svd(pattern, full_matrices=False)
    least = max(pattern.shape) * np.finfo(float).eps * singular[0]
    basis = basis[:, singular > least]
    fitted = (difference @ basis) @ basis.T
    return (fitted**2).sum(axis=1), ((difference - fitted) ** 2).sum(axis=1)


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
        A warning where its deviation from the other strokes is significant; the statistic is t.

    Notes
    -----
    Student's test of the deleted deviation, a drift over the run aside, at the false-alarm rate
    over all readings (Bonferroni). Of two readings at a position nothing tells which one is wrong.
    """
    found = stack.replicates(grouped(stack.table.head)[1])
    dof, deviation = found.dof - 1.0, found.residual
    known = dof >= 1.0
    size = found.cells.members[found.cells.cell]
    free = np.where(size > 1, np.maximum(found.free, _LEAST_FREE), np.inf)
    rest = np.maximum(found.squares[:, None] - deviation**2 / free, stack.smallest[:, None] ** 2)
    each = np.abs(deviation) / np.sqrt(free * rest / np.where(known, dof, 1.0)[:, None])
    worst, row = each.argmax(axis=1), np.arange(len(stack))
    t = each[row, worst]
    p = f_survival(t**2, 1.0, np.where(known, dof, 1.0)) * size.size
    away = (deviation / free)[row, worst] / stack.scale

    def said(index: int) -> str:
        own = found.cells.cell == found.cells.cell[worst[index]]
        pair = own.sum() == 2
        alike = np.flatnonzero(own) if pair else worst[index : index + 1]
        names = " or ".join(stack.place(index, reading) for reading in alike.tolist())
        others = "stroke" if pair else "strokes"
        size = acceleration(away[index])
        return f"{names} is {size} from the other {others}, t = {t[index]:.3g}"

    few = ~known, "no position is read often enough; repeat the strokes"
    return gate_stack("outlier", p < level, said, t, p, [few])


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
