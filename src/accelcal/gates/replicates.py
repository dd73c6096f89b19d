"""Gates on replicates: closure of the turn, forward against back, an outlier."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.noise import ReadingNoise
from accelcal.estimate.tables import PreparedTable
from accelcal.gates.verdict import SIGNIFICANT, acceleration, not_assessed, warn_if
from accelcal.grouping import distinct, grouped, median
from accelcal.probability import f_survival, student_survival
from accelcal.record import TumbleRecord
from accelcal.results.quantity import Gate

__all__ = ["closure", "forward_against_back", "outlier", "place"]

Array = NDArray[np.float64]

_FEW = 3  # degrees of freedom below which a scatter of its own says too little


def closure(table: PreparedTable, noise: ReadingNoise, scale: float) -> Gate:
    """Test Y9 - Y1 of the strokes, and the same as end minus start in the order of time.

    Parameters
    ----------
    table : PreparedTable
        The table.
    noise : ReadingNoise
        Its reading noise.
    scale : float
        Scale factor [output unit / g].

    Returns
    -------
    Gate
        A warning where either mean is significant.

    Notes
    -----
    Two tests of Student, each at half the false-alarm rate.
    """
    pairs = list(_returns(table))
    if not pairs:
        return not_assessed("closure", "no stroke holds both the first position and the return")
    scatter, dof = _clean_scatter(table, noise)
    if not dof > 0.0:
        return not_assessed("closure", "nothing tells the reading noise; repeat the strokes")
    difference = np.array([after - before for after, before, _ in pairs])
    forward = np.array([1.0 if odd else -1.0 for _, _, odd in pairs])
    error = max(scatter, _smallest(table)) * np.sqrt(2.0 / len(pairs))
    means = float(difference.mean()), float((forward * difference).mean())
    p = 2.0 * min(2.0 * student_survival(abs(m) / error, dof) for m in means)
    sizes = (acceleration(value / scale) for value in (*means, error))
    return warn_if(
        "closure",
        p < SIGNIFICANT,
        "Y(return) - Y1 {}, end - start of a stroke {}, standard error {}".format(*sizes),
    )


def _returns(table: PreparedTable) -> Iterator[tuple[float, float, bool]]:
    """Output at the return, output at the start, whether the stroke goes forward."""
    record = table.record
    start = record.angle.min()
    first, last = (np.abs(record.angle - at) < 1e-6 for at in (start, start + 360.0))
    for stroke in distinct(record.stroke):
        own = record.stroke == stroke
        if (own & first).any() and (own & last).any():
            yield (
                float(record.output[own & last].mean()),
                float(record.output[own & first].mean()),
                bool(stroke % 2),
            )


class _Directions(NamedTuple):
    """The readings sorted into cells of one angle and one direction."""

    counts: Array  # shape (angles, 2)
    means: Array  # shape (angles, 2)
    angles: Array  # shape (angles,)
    within: Array  # squared deviations from the mean of the cell, shape (angles, 2)

    @classmethod
    def of(cls, angle: Array, record: TumbleRecord) -> _Directions:
        angles, row, _ = grouped(np.round(angle, 6))
        cell = row * 2 + record.stroke % 2

        def sums(values: Array) -> Array:
            whole = np.bincount(cell, values, minlength=2 * angles.size)
            return whole.reshape(-1, 2).astype(np.float64)

        counts = sums(np.ones(len(record)))
        means = sums(record.output) / np.maximum(counts, 1.0)
        within = sums((record.output - means.ravel()[cell]) ** 2)
        return cls(counts, means, angles, within)


def _clean_scatter(table: PreparedTable, noise: ReadingNoise) -> tuple[float, float]:
    """Scatter of the readings that a fault of closure does not enlarge, and its dof."""
    if noise.source == "declared":
        return noise.factor * median(table.scatter), noise.dof
    found = _Directions.of(table.record.angle, table.record)
    dof = float(np.maximum(found.counts - 1.0, 0.0).sum())
    if dof >= _FEW:
        return float(np.sqrt(found.within.sum() / dof)), dof
    returned = table.record.angle > table.record.angle.min() + 360.0 - 1e-6
    design = np.column_stack([table.kept_design, returned])
    basis = np.linalg.qr(design).Q
    residual = table.record.output - basis @ (basis.T @ table.record.output)
    dof = float(len(residual) - design.shape[1])
    return (float(np.sqrt(residual @ residual / dof)), dof) if dof > 0.0 else (np.nan, 0.0)


def forward_against_back(table: PreparedTable, scale: float) -> Gate:
    """Compare the two directions at each position.

    Parameters
    ----------
    table : PreparedTable
        The table.
    scale : float
        Scale factor [output unit / g].

    Returns
    -------
    Gate
        A warning where the differences are significant by Fisher's test.

    Notes
    -----
    With two strokes or more in each direction, the differences are held against the scatter of
    the strokes; with fewer, their part that follows 1, cos th and sin th, as that of backlash
    does, is held against the rest of them.
    """
    name = "forward against back"
    found = _Directions.of(table.head, table.record)
    both = (found.counts > 0).all(axis=1)
    if both.sum() < 1:
        return not_assessed(name, "needs strokes in both directions")
    counts = found.counts[both]
    difference = found.means[both, 1] - found.means[both, 0]
    standard = difference / np.sqrt((1.0 / counts).sum(axis=1))
    dof = float((counts - 1.0).sum())
    squares, part = float(standard @ standard), difference.size
    rest = float(found.within[both].sum())
    if dof < _FEW:
        squares, part, rest, dof = _backlash_like(standard, found.angles[both])
    if dof < 1.0:
        return not_assessed(name, "needs more positions, or two strokes in each direction")
    variance = max(rest / dof, _smallest(table) ** 2)
    worst = int(np.argmax(np.abs(difference)))
    return warn_if(
        name,
        f_survival(squares / part / variance, part, dof) < SIGNIFICANT,
        f"mean {acceleration(difference.mean() / scale)}, largest"
        f" {acceleration(difference[worst] / scale)} at {found.angles[both][worst]:g} deg",
    )


def _backlash_like(difference: Array, angle: Array) -> tuple[float, int, float, float]:
    """Squares of the part that follows 1, cos and sin, its dof, and the same of the rest."""
    th = np.radians(angle)
    pattern = np.column_stack([np.ones_like(th), np.cos(th), np.sin(th)])
    fitted = pattern @ np.linalg.lstsq(pattern, difference, rcond=None)[0]
    rest = difference - fitted
    return float(fitted @ fitted), 3, float(rest @ rest), float(difference.size - 3)


def _smallest(table: PreparedTable) -> float:
    """Rounding error of a reading: readings alike to the last digit still have it."""
    return float(4.0 * np.finfo(float).eps * np.abs(table.record.output).max())


def outlier(table: PreparedTable, scale: float) -> Gate:
    """Test the reading that its replicates contradict most.

    Parameters
    ----------
    table : PreparedTable
        The table.
    scale : float
        Scale factor [output unit / g].

    Returns
    -------
    Gate
        A warning where its deviation from the other strokes is significant.

    Notes
    -----
    Student's test of the deleted deviation, at the false-alarm rate over all readings
    (Bonferroni). Of two readings at a position nothing tells which one is wrong.
    """
    record = table.record
    _, cell, members = grouped(table.head)
    deviation = record.output - (np.bincount(cell, record.output) / members)[cell]
    dof = len(record) - members.size - 1
    if dof < 1:
        return not_assessed("outlier", "no position is read often enough; repeat the strokes")
    size = members[cell]
    free = np.where(size > 1, 1.0 - 1.0 / size, np.inf)
    rest = np.maximum((deviation**2).sum() - deviation**2 / free, _smallest(table) ** 2)
    t = np.abs(deviation) / np.sqrt(free * rest / dof)
    worst = int(np.argmax(t))
    p = 2.0 * len(record) * student_survival(float(t[worst]), dof)
    away = acceleration(deviation[worst] / free[worst] / scale)
    alike = np.flatnonzero(cell == cell[worst]) if size[worst] == 2 else np.array([worst])
    return warn_if(
        "outlier",
        p < SIGNIFICANT,
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
