"""Gate on drift: does the bias, the scale factor or the angle of the unit move over the run."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.noise import FEW
from accelcal.estimate.tables import PreparedTable
from accelcal.gates.trend import Replicates, Trend, directed, moments, smallest, trend_of
from accelcal.gates.verdict import SIGNIFICANT, acceleration, angle, not_assessed, warn_if
from accelcal.probability import f_survival
from accelcal.record import TumbleRecord
from accelcal.results.quantity import Gate

__all__ = ["drift"]

Array = NDArray[np.float64]

_WORDS = {  # what drifts -> its name, its mean over the run
    "bias": ("bias", "K0"),
    "scale_factor": ("scale factor", "K1"),
    "angle": ("angle of the unit in the head", "M"),
}
_HOUR = 3600.0  # s


class _Course(NamedTuple):
    """How one part of a trend moves from start to end of the run."""

    name: str
    moved: float  # bias [g], scale factor [1], angle [rad]
    p: float

    def said(self, hours: float | None) -> str:
        """Say by how much it moves, over the run and in an hour."""
        per_hour = f" ({self._size(self.moved / hours)} per hour)" if hours else ""
        return f"the {_WORDS[self.name][0]} moves by {self._size(self.moved)}{per_hour}"

    def _size(self, value: float) -> str:
        if self.name == "scale_factor":
            return f"{float(f'{1e6 * value:.3g}'):.12g} ppm"
        return (acceleration if self.name == "bias" else angle)(value)


def drift(table: PreparedTable, scale: float, level: float = SIGNIFICANT) -> Gate:
    """Test the trends of the readings at one angle and in one direction over the run.

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
        A warning where a trend of the bias, the scale factor or the angle is significant by
        Fisher's test against the pure error.

    Notes
    -----
    Only readings of one angle and one direction are compared, so that neither a difference of the
    directions nor an open turn counts as drift. Each trend is tested beside the others, so that
    each is named for what it is; they share the false-alarm rate.
    """
    trend = trend_of(table.record)
    if not trend.bias.shape[1]:
        return not_assessed("drift", "needs three strokes or more, of all positions")
    found = _courses(table, trend, scale)
    if not found:
        return not_assessed("drift", "no angle is read often enough in one direction")
    moving = [course for course in found if course.p < level / len(found)]
    hours = _hours(table.record)
    said = " and ".join(course.said(hours) for course in moving or found)
    p = len(found) * min(course.p for course in found)
    means = " and ".join(_WORDS[course.name][1] for course in moving)
    verb = "is the mean" if len(moving) == 1 else "are the means"
    more = f"; {means} {verb} over the run" if moving else ""
    finding = f"from start to end of the run {said}, p = {min(p, 1.0):.2g}{more}"
    return warn_if("drift", bool(moving), finding)


def _courses(table: PreparedTable, trend: Trend, scale: float) -> list[_Course]:
    """The parts of a trend that the readings tell, each tested beside the others."""
    output, cell = table.record.output, directed(table.record)
    found = Replicates.of(output, cell, trend.columns)
    if found.dof < FEW:
        return []
    variance = max(found.squares / found.dof, smallest(table) ** 2)
    courses = []
    for name in Trend._fields:
        others = [getattr(trend, other) for other in Trend._fields if other != name]
        without = Replicates.of(output, cell, np.column_stack(others))
        part = without.dof - found.dof
        if part >= 1.0:
            ratio = (without.squares - found.squares) / part / variance
            moved = _moved(table.record, trend, name, found.trend) / scale
            courses.append(_Course(name, moved, f_survival(ratio, part, found.dof)))
    return courses


def _moved(record: TumbleRecord, trend: Trend, name: str, coefficients: Array) -> float:
    """By how much a part of the trend moves from the first to the last reading."""
    powers = trend.bias.shape[1]
    if name == "bias":
        course = trend.bias @ coefficients[:powers]
        last, first = (course[pick(moments(record))] for pick in (np.argmax, np.argmin))
        return float(last - first)
    # the time goes from -1 to 1; a turn forward makes cos th less, by its sine
    return float(2.0 * coefficients[powers] if name == "scale_factor" else -2.0 * coefficients[-1])


def _hours(record: TumbleRecord) -> float | None:
    """Length of the run [h]; None without times."""
    return float(np.ptp(record.time)) / _HOUR if moments(record) is record.time else None
