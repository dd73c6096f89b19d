"""Gate on drift: does the bias, the scale factor or the angle of the unit move over the run."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.noise import FEW
from accelcal.gates.stack import TableStack
from accelcal.gates.trend import Trend, contracted, rank_and_inverse
from accelcal.gates.verdict import SIGNIFICANT, GateStack, acceleration, angle, gate_stack
from accelcal.probability import f_survival

__all__ = ["drift"]

Array = NDArray[np.float64]

_WORDS = {  # what drifts -> its name, its mean over the run
    "bias": ("bias", "K0"),
    "scale_factor": ("scale factor", "K1"),
    "angle": ("angle of the unit in the head", "M"),
}


class _Courses(NamedTuple):
    """How the parts of the trends of T tables move from start to end of the run.

    `moved` and `p` have the shape (parts, T): bias [g], scale factor [1], angle [rad]; a part that
    the readings do not tell has no p. `level` is that of all of a table's parts together.
    """

    moved: Array
    p: Array
    hours: Array
    level: float

    @property
    def told(self) -> NDArray[np.intp]:
        """Number of parts that the readings tell, shape (T,)."""
        return np.asarray(np.isfinite(self.p).sum(axis=0))

    @property
    def whole_p(self) -> Array:
        """Probability of the most significant part among those told, shape (T,)."""
        least = np.where(np.isfinite(self.p), self.p, 1.0).min(axis=0)
        return np.asarray(np.minimum(self.told * least, 1.0))

    @property
    def moving(self) -> NDArray[np.bool_]:
        """Parts that move significantly, shape (parts, T)."""
        return np.asarray(self.p < self.level / np.maximum(self.told, 1))

    def said(self, index: int) -> str:
        """Say what moves in one table, by how much over the run and in an hour."""
        names = np.array(Trend._fields)
        told = names[np.isfinite(self.p[:, index])].tolist()
        moving = names[self.moving[:, index]].tolist()
        courses = " and ".join(self._course(name, index) for name in moving or told)
        means = " and ".join(_WORDS[name][1] for name in moving)
        verb = "is the mean" if len(moving) == 1 else "are the means"
        more = f"; {means} {verb} over the run" if moving else ""
        p = self.whole_p[index]
        return f"from start to end of the run {courses}, p = {p:.2g}{more}"

    def _course(self, name: str, index: int) -> str:
        moved = float(self.moved[Trend._fields.index(name), index])
        hours = float(self.hours[index if self.hours.size > 1 else 0])
        per_hour = f" ({_size(name, moved / hours)} per hour)" if hours > 0.0 else ""
        return f"the {_WORDS[name][0]} moves by {_size(name, moved)}{per_hour}"


def _size(name: str, value: float) -> str:
    if name == "scale_factor":
        return f"{float(f'{1e6 * value:.3g}'):.12g} ppm"
    return (acceleration if name == "bias" else angle)(value)


def drift(stack: TableStack, level: float = SIGNIFICANT) -> GateStack:
    """Test the trends of the readings at one angle and in one direction over the run.

    Parameters
    ----------
    stack : TableStack
        The tables.
    level : float, default 0.01
        False-alarm rate of each table.

    Returns
    -------
    GateStack
        A warning where a trend of the bias, the scale factor or the angle is significant by
        Fisher's test against the pure error; the statistic is the probability of the most
        significant of them alone.

    Notes
    -----
    Only readings of one angle and one direction are compared, so that neither a difference of the
    directions nor an open turn counts as drift. Each trend is tested beside the others, so that
    each is named for what it is; they share the false-alarm rate.
    """
    courses = _courses(stack, level)
    few = not stack.trend.bias.shape[2], "needs three strokes or more, of all positions"
    untold = courses.told == 0, "no angle is read often enough in one direction"
    p = courses.whole_p
    statistic = p / np.maximum(courses.told, 1)
    bad = np.asarray(courses.moving.any(axis=0))
    return gate_stack("drift", bad, courses.said, statistic, p, (few, untold))


def _courses(stack: TableStack, level: float) -> _Courses:
    """The parts of the trends, each tested beside the others."""
    found = stack.apart
    rank = stack.output.shape[1] - found.cells.members.size - found.dof
    each = [_beside_others(found.within, rank, own) for own in _places(stack.trend)]
    parts = np.broadcast_to(np.stack([part for part, _ in each]), (len(each), len(stack)))
    told = (parts >= 1.0) & (found.dof >= FEW)
    explained = np.array([(contracted(basis, stack.output) ** 2).sum(axis=1) for _, basis in each])
    variance = np.maximum(found.squares / np.maximum(found.dof, 1.0), stack.smallest**2)
    dof1, dof2 = np.where(told, parts, 1.0), np.where(told, found.dof, 1.0)
    p = np.where(told, f_survival(explained / dof1 / variance, dof1, dof2), np.nan)
    return _Courses(_moved(stack), p, stack.hours, level)


def _places(trend: Trend) -> list[slice]:
    """Columns of each part among those of all."""
    edges = np.cumsum([0, *(part.shape[2] for part in trend)]).tolist()
    return [slice(*edge) for edge in pairwise(edges)]


def _beside_others(within: Array, rank: Array, own: slice) -> tuple[Array, Array]:
    """Rank that a part adds to the other columns, (D,), and a basis of what it adds, (D, n, s)."""
    others = np.delete(within, own, axis=2)
    of_others, inverse, _ = rank_and_inverse(others)
    part, columns = rank - of_others, within[..., own]
    added = columns - others @ (inverse @ (others.swapaxes(1, 2) @ columns))
    basis = np.linalg.svd(added, full_matrices=False)[0]
    return part, basis * (np.arange(basis.shape[2]) < part[:, None])[:, None]


def _moved(stack: TableStack) -> Array:
    """By how much each part moves from the first to the last reading, shape (3, T)."""
    trend, coefficients = stack.trend, stack.apart.trend
    row = np.arange(len(stack.moment))
    last, first = (pick(stack.moment, axis=1) for pick in (np.argmax, np.argmin))
    change = trend.bias[row, last] - trend.bias[row, first]
    bias = (change * coefficients[:, : change.shape[1]]).sum(axis=1)
    # the time goes from -1 to 1; a turn forward makes cos th less, by its sine
    of_time = [2.0 * coefficients[:, own].sum(axis=1) for own in _places(trend)[1:]]
    return np.array([bias, of_time[0], -of_time[1]]) / stack.scale
