"""Gates on replicates: closure of the turn, forward against back, an outlier."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.noise import FEW, ReadingNoise
from accelcal.estimate.tables import PreparedTable
from accelcal.gates.trend import Replicates, directed, smallest, trend_of
from accelcal.gates.verdict import SIGNIFICANT, acceleration, not_assessed, warn_if
from accelcal.grouping import grouped, median
from accelcal.probability import f_survival, student_survival
from accelcal.record import TumbleRecord
from accelcal.results.quantity import Gate

__all__ = ["closure", "forward_against_back", "outlier", "place"]

Array = NDArray[np.float64]

_LEAST_FREE = 1e-6  # a reading that a mean and a trend follow wholly tells nothing of itself


def closure(
    table: PreparedTable, noise: ReadingNoise, scale: float, level: float = SIGNIFICANT
) -> Gate:
    """Test Y9 - Y1 of the strokes, and the same as end minus start in the order of time.

    Parameters
    ----------
    table : PreparedTable
        The table.
    noise : ReadingNoise
        Its reading noise.
    scale : float
        Scale factor [output unit / g].
    level : float, default 0.01
        False-alarm rate.

    Returns
    -------
    Gate
        A warning where either mean is significant.

    Notes
    -----
    Two tests of Student, each at half the false-alarm rate, on what a drift over the run leaves.
    """
    contrasts = _contrasts_of_returns(table)
    if not contrasts.any():
        return not_assessed("closure", "no stroke holds both the first position and the return")
    scatter, dof = _clean_scatter(table, noise)
    if not dof > 0.0:
        return not_assessed("closure", "nothing tells the reading noise; repeat the strokes")
    columns = trend_of(table.record).columns
    found = Replicates.of(table.record.output, directed(table.record), columns)
    weights = [found.blind(contrast, columns) for contrast in contrasts]
    means = [float(weight @ table.record.output) for weight in weights]
    errors = [max(scatter, smallest(table)) * float(np.sqrt(w @ w)) for w in weights]
    p = 2.0 * min(
        2.0 * student_survival(abs(m) / e, dof) for m, e in zip(means, errors, strict=True)
    )
    sizes = (acceleration(value / scale) for value in (*means, max(errors)))
    return warn_if(
        "closure",
        p < level,
        "Y(return) - Y1 {}, end - start of a stroke {}, standard error {}".format(*sizes),
    )


def _contrasts_of_returns(table: PreparedTable) -> Array:
    """Weights that make return minus start, and end minus start in time, shape (2, n)."""
    record = table.record
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
    return np.array([weight, np.where(record.stroke % 2 == 1, weight, -weight)])


def _clean_scatter(table: PreparedTable, noise: ReadingNoise) -> tuple[float, float]:
    """Scatter of the readings that a fault of closure does not enlarge, and its dof."""
    if noise.source == "declared":
        return noise.factor * median(table.scatter), noise.dof
    record = table.record
    found = Replicates.of(record.output, directed(record), trend_of(record).columns)
    if found.dof >= FEW:
        return float(np.sqrt(found.squares / found.dof)), found.dof
    returned = record.angle > record.angle.min() + 360.0 - 1e-6
    design = np.column_stack([table.kept_design, returned])
    basis = np.linalg.qr(design).Q
    residual = record.output - basis @ (basis.T @ record.output)
    dof = float(len(residual) - design.shape[1])
    return (float(np.sqrt(residual @ residual / dof)), dof) if dof > 0.0 else (np.nan, 0.0)


def forward_against_back(table: PreparedTable, scale: float, level: float = SIGNIFICANT) -> Gate:
    """Compare the two directions at each position.

    Parameters
    ----------
    table : PreparedTable
        The table.
    scale : float
        Scale factor [output unit / g].
    level : float, default 0.01
        False-alarm rate.

    Returns
    -------
    Gate
        A warning where the differences are significant by Fisher's test.

    Notes
    -----
    With two strokes or more in each direction, the differences are held against the scatter of
    the strokes, a drift over the run aside; with fewer, their part that follows 1, cos th and
    sin th, as that of backlash does, is held against the rest of them.
    """
    name = "forward against back"
    record = table.record
    columns = trend_of(record).columns
    apart = Replicates.of(record.output, directed(record), columns)
    angles, difference, variance = _differences(table, record.output - columns @ apart.trend)
    if not angles.size:
        return not_assessed(name, "needs strokes in both directions")
    rest, dof = apart.squares, apart.dof
    if dof >= FEW:
        together = Replicates.of(record.output, grouped(np.round(record.angle, 6))[1], columns)
        squares, part = together.squares - rest, together.dof - dof
    else:
        squares, part, rest, dof = _backlash_like(difference / np.sqrt(variance), angles)
    if min(part, dof) < 1.0:
        return not_assessed(name, "needs more positions, or two strokes in each direction")
    ratio = squares / part / max(rest / dof, smallest(table) ** 2)
    worst = int(np.argmax(np.abs(difference)))
    return warn_if(
        name,
        f_survival(ratio, part, dof) < level,
        f"mean {acceleration(difference.mean() / scale)}, largest"
        f" {acceleration(difference[worst] / scale)} at {angles[worst]:g} deg",
    )


def _differences(table: PreparedTable, output: Array) -> tuple[Array, Array, Array]:
    """Positions read in both directions, forward minus back, and its variance over a reading's."""
    angles, row, _ = grouped(table.head)
    cell = 2 * row + table.record.stroke % 2
    counts = np.bincount(cell, minlength=2 * angles.size).reshape(-1, 2)
    sums = np.bincount(cell, output, minlength=2 * angles.size).reshape(-1, 2)
    both = (counts > 0).all(axis=1)
    means = sums[both] / counts[both]
    return angles[both], means[:, 1] - means[:, 0], (1.0 / counts[both]).sum(axis=1)


def _backlash_like(difference: Array, angle: Array) -> tuple[float, float, float, float]:
    """Squares of the part that follows 1, cos and sin, its dof, and the same of the rest."""
    th = np.radians(angle)
    pattern = np.column_stack([np.ones_like(th), np.cos(th), np.sin(th)])
    fitted = pattern @ np.linalg.lstsq(pattern, difference, rcond=None)[0]
    rest = difference - fitted
    return float(fitted @ fitted), 3.0, float(rest @ rest), float(difference.size - 3)


def outlier(table: PreparedTable, scale: float, level: float = SIGNIFICANT) -> Gate:
    """Test the reading that its replicates contradict most.

    Parameters
    ----------
    table : PreparedTable
        The table.
    scale : float
        Scale factor [output unit / g].
    level : float, default 0.01
        False-alarm rate.

    Returns
    -------
    Gate
        A warning where its deviation from the other strokes is significant.

    Notes
    -----
    Student's test of the deleted deviation, a drift over the run aside, at the false-alarm rate
    over all readings (Bonferroni). Of two readings at a position nothing tells which one is wrong.
    """
    record = table.record
    _, cell, members = grouped(table.head)
    found = Replicates.of(record.output, cell, trend_of(record).columns)
    dof = found.dof - 1.0
    if dof < 1.0:
        return not_assessed("outlier", "no position is read often enough; repeat the strokes")
    size, deviation = members[cell], found.residual
    free = np.where(size > 1, np.maximum(found.free, _LEAST_FREE), np.inf)
    rest = np.maximum(found.squares - deviation**2 / free, smallest(table) ** 2)
    t = np.abs(deviation) / np.sqrt(free * rest / dof)
    worst = int(np.argmax(t))
    p = 2.0 * len(record) * student_survival(float(t[worst]), dof)
    away = acceleration(deviation[worst] / free[worst] / scale)
    alike = np.flatnonzero(cell == cell[worst]) if size[worst] == 2 else np.array([worst])
    return warn_if(
        "outlier",
        p < level,
        f"{' or '.join(place(record, int(i)) for i in alike)} is {away} from the other"
        f" {'stroke' if size[worst] == 2 else 'strokes'}, t = {t[worst]:.3g}",
    )


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
    line = "" if record.line is None else f" (line {record.line[index]})"
    return f"stroke {record.stroke[index]} at {record.angle[index]:g} deg{line}"
