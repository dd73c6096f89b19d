"""Gate on drift: does the bias, the scale factor or the angle of the unit move over the run."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.noise import FEW
from accelcal.gates.stack import TableStack
from accelcal.gates.trend import Trend, contracted, rank_and_inverse
from accelcal.gates.verdict import SIGNIFICANT, GateStack, acceleration, angle, gate_stack
from accelcal.probability import f_exceeds, f_survival

__all__ = ["drift"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_WORDS = {  # what drifts -> its name, its mean over the run
    "bias": ("bias", "K0"),
    "scale_factor": ("scale factor", "K1"),
    "angle": ("angle of the unit in the head", "M"),
}


class _Parts(NamedTuple):
    """What the readings of T tables say of the parts of their trends, each beside the others.

    The parts are bias, scale factor and angle. `told` says which the readings tell, (3, D); `ratio`
    is Fisher's F of each, (3, T), of the degrees of freedom `dof1`, (3, D), and `dof2`, (D,).
    `level` is that of all of a table's parts together.
    """

    told: Mask
    ratio: Array
    dof1: Array
    dof2: Array
    level: float

    @property
    def known(self) -> NDArray[np.intp]:
        """Number of parts that the readings tell, shape (D,)."""
        return np.asarray(self.told.sum(axis=0))

    @property
    def moving(self) -> Mask:
        """Parts that move significantly, shape (3, T)."""
        level = self.level / np.maximum(self.known, 1)
        return np.asarray(self.told & f_exceeds(level, self.ratio, self.dof1, self.dof2))

    def of(self, table: int) -> _Parts:
        """Return those of one table."""
        own = slice(table, table + 1)
        ratio, of_plan = self.ratio[:, own], own if self.dof2.size > 1 else slice(1)
        told, dof1, dof2 = self.told[:, of_plan], self.dof1[:, of_plan], self.dof2[of_plan]
        return _Parts(told, ratio, dof1, dof2, self.level)


def _said(parts: _Parts, moved: Array, hours: float) -> str:
    """Say what moves in one table, by how much over the run and in an hour."""
    told, moving = parts.told[:, 0], parts.moving[:, 0]
    names = np.array(Trend._fields)
    sizes = dict(zip(Trend._fields, moved.tolist(), strict=True))
    named = names[moving if moving.any() else told].tolist()
    courses = " and ".join(_course(name, sizes[name], hours) for name in named)
    means = " and ".join(_WORDS[name][1] for name in names[moving].tolist())
    verb = "is the mean" if moving.sum() == 1 else "are the means"
    more = f"; {means} {verb} over the run" if means else ""
    p = f_survival(parts.ratio, parts.dof1, parts.dof2)[told].min() * told.sum()
    return f"from start to end of the run {courses}, p = {min(p, 1.0):.2g}{more}"


def _course(name: str, moved: float, hours: float) -> str:
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
        Fisher's test against the pure error.

    Notes
    -----
    Only readings of one angle and one direction are compared, so that neither a difference of the
    directions nor an open turn counts as drift. Each trend is tested beside the others, so that
    each is named for what it is; they share the false-alarm rate.
    """
    parts = _parts(stack, level)
    moved = cache(lambda: _moved(stack))

    def said(index: int) -> str:
        hours = float(stack.hours[index if stack.hours.size > 1 else 0])
        return _said(parts.of(index), moved()[:, index], hours)

    few = not stack.trend.bias.shape[2], "needs three strokes or more, of all positions"
    untold = parts.known == 0, "no angle is read often enough in one direction"
    return gate_stack("drift", np.asarray(parts.moving.any(axis=0)), said, (few, untold))


def _parts(stack: TableStack, level: float) -> _Parts:
    """The parts of the trends, each tested beside the others."""
    found = stack.apart
    each = [_beside_others(found.within, found.rank, own) for own in _places(stack.trend)]
    parts = np.stack([part for part, _ in each])
    told = (parts >= 1.0) & (found.dof >= FEW)
    explained = np.array([(contracted(basis, stack.output) ** 2).sum(axis=0) for _, basis in each])
    variance = np.maximum(found.squares / np.maximum(found.dof, 1.0), stack.smallest**2)
    dof1, dof2 = np.where(told, parts, 1.0), np.maximum(found.dof, 1.0)
    return _Parts(told, explained / dof1 / variance, dof1, dof2, level)


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
    change = (trend.bias[row, last] - trend.bias[row, first]).T
    bias = (change * coefficients[: len(change)]).sum(axis=0)
    # the time goes from -1 to 1; a turn forward makes cos th less, by its sine
    of_time = [2.0 * coefficients[own].sum(axis=0) for own in _places(trend)[1:]]
    return np.array([bias, of_time[0], -of_time[1]]) / stack.scale
