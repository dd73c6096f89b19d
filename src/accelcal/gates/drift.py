"""Gate on drift: does the bias, the scale factor or the angle of the unit move over the run."""

from __future__ import annotations

from itertools import compress, pairwise
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.estimate.trend import FEW, Trend
from accelcal.gates.plan import TablePlan, contracted, once_a_plan, rank_and_inverse
from accelcal.gates.stack import TableStack
from accelcal.gates.verdict import GateStack, acceleration, angle, gate_stack
from accelcal.numerics.probability import f_exceeds, f_survival, written_p_value
from accelcal.plural import listed
from accelcal.shown_units import three_digits

_AND_BACK = 1.5  # times the change from start to end beyond which a bias moved there and back

_WORDS = {  # what drifts -> its name, its mean over the run
    "bias": ("bias", "K0"),
    "scale_factor": ("scale factor", "K1"),
    "angle": ("angle of the unit in the head", "M"),
}


class _Parts(NamedTuple):
    """What the readings tell of the parts of a trend: bias, scale factor and angle.

    `of_trend`, shape (D, q, 3 q), goes from the trend to what each part adds to the others, along
    orthonormal columns, those of the bias first. All else is of shape (3, D).
    """

    of_trend: Array
    told: Mask  # whether the readings tell it
    dof1: Array  # degrees of freedom of the part
    dof2: Array  # and of what it is held against

    def level(self, level: float) -> Array:
        """Level of each part, shape (D,), where that of all together is given."""
        return np.asarray(level / np.maximum(self.told.sum(axis=0), 1))

    def p(self, ratio: Array, table: int) -> float:
        """Probability of the most significant of the parts of one table that are told."""
        own = table if self.told.shape[1] > 1 else 0
        told = self.told[:, own]
        tests = (ratio[told, table], self.dof1[told, own], self.dof2[told, own])
        p = min(map(f_survival, *(values.tolist() for values in tests)))
        return min(p * int(told.sum()), 1.0)


@once_a_plan
def _parts(plan: TablePlan) -> _Parts:
    found = plan.apart
    rank, beside = _beside_others(found.normal, found.rank, _owners(plan.trend))
    told = (rank >= 1.0) & (found.dof >= FEW)
    dof1, dof2 = np.where(told, rank, 1.0), np.where(told, found.dof, 1.0)
    return _Parts(np.concatenate(found.normal @ beside, axis=2), told, dof1, dof2)


class _Moved(NamedTuple):
    """By how much a part of one table moves: from the first to the last reading, and in all."""

    ends: float
    span: float

    def course(self, name: str, hours: float) -> str:
        """Say how it moves."""
        what, size = f"the {_WORDS[name][0]}", _size(name, self.ends)
        if self.span > _AND_BACK * abs(self.ends):
            span = _size(name, self.span)
            return f"{what} moves there and back within {span}, by {size} at the end"
        per_hour = f" ({_size(name, self.ends / hours)} per hour)" if hours > 0.0 else ""
        return f"{what} moves by {size}{per_hour}"


def _size(name: str, value: float) -> str:
    if name == "scale_factor":
        return f"{three_digits(1e6 * value)} ppm"
    return (acceleration if name == "bias" else angle)(value)


def drift(stack: TableStack, level: float) -> GateStack:
    """Test the trends of the readings at one angle and in one direction over the run.

    It warns where a trend of the bias, the scale factor or the angle is significant by Fisher's
    test against the pure error.

    Notes
    -----
    Only readings of one angle and one direction are compared, so that neither a difference of the
    directions nor an open turn counts as drift. Each trend is tested beside the others, so that
    each is named for what it is; they share the false-alarm rate.
    """
    parts = _parts(stack.plan)
    ratio = _ratios(stack, parts)
    moving = parts.told & f_exceeds(parts.level(level), ratio, parts.dof1, parts.dof2)

    def said(index: int) -> str:
        hours = float(stack.hours[index if stack.hours.size > 1 else 0])
        names = list(compress(Trend._fields, moving[:, index]))
        told = np.broadcast_to(parts.told, moving.shape)[:, index]
        shown = names or list(compress(Trend._fields, told))
        moved = _moved(stack, index)
        courses = listed(moved[name].course(name, hours) for name in shown)
        p = written_p_value(parts.p(ratio, index))
        return f"from start to end of the run {courses}, {p}{_what_is_a_mean(names)}"

    few = not stack.plan.trend.bias.shape[2], "needs three strokes or more, of all positions"
    untold = ~parts.told.any(axis=0), "no angle is read often enough in one direction"
    return gate_stack("drift", np.asarray(moving.any(axis=0)), said, (few, untold))


def _what_is_a_mean(names: list[str]) -> str:
    """Say of what moves that its coefficient is the mean over the run."""
    means = listed(_WORDS[name][1] for name in names)
    verb = "is the mean" if len(names) == 1 else "are the means"
    return f"; {means} {verb} over the run" if names else ""


def _ratios(stack: TableStack, parts: _Parts) -> Array:
    """Fisher's F of each part beside the others, against the pure error, shape (3, T)."""
    trend = stack.apart.trend
    along = contracted(parts.of_trend, trend).reshape(len(_WORDS), *trend.shape)
    explained = (along**2).sum(axis=1)
    variance = stack.apart.squares / np.maximum(stack.plan.apart.dof, 1.0)
    return np.asarray(explained / parts.dof1 / np.maximum(variance, stack.smallest**2))


def _places(trend: Trend) -> list[slice]:
    edges = np.cumsum([0, *(part.shape[2] for part in trend)]).tolist()
    return [slice(*edge) for edge in pairwise(edges)]


def _owners(trend: Trend) -> Mask:
    """Tell which columns are of each part, shape (3, q)."""
    sizes = [part.shape[2] for part in trend]
    return np.asarray(np.repeat(np.arange(len(sizes)), sizes) == np.arange(len(sizes))[:, None])


def _beside_others(normal: Array, rank: Array, own: Mask) -> tuple[Array, Array]:
    """Rank that each part adds to the other columns, (3, D), and a basis of what it adds.

    The basis, (3, D, q, q), is told by the columns, of which `normal` is the normal matrix and
    `own` tells those of each part.
    """
    own = own[:, None, None]
    of_others, inverse = rank_and_inverse(np.where(own | own.mT, 0.0, normal))
    part = rank - of_others
    added = np.where(own, np.eye(len(normal.T)) - inverse @ normal, 0.0)
    squares, vectors = np.linalg.eigh(added.mT @ normal @ added)  # the largest come last
    told = np.arange(-squares.shape[2], 0) >= -part[..., None]
    return part, added @ (vectors / np.sqrt(np.where(told, squares, np.inf))[..., None, :])


def _moved(stack: TableStack, table: int) -> dict[str, _Moved]:
    """How each part moves in one table."""
    trend, moment, scale = stack.plan.trend, stack.plan.moment, stack.scale[table]
    at, coefficients = table if len(moment) > 1 else 0, stack.apart.trend[:, table]
    of_bias, *others = _places(trend)
    course, moment = trend.bias[at] @ coefficients[of_bias], moment[at]
    # The time goes from -1 to 1, so that a slope counts twice. A turn forward by d lowers cos th by
    # d sin th, hence the sign of the last.
    scale_factor, turn = (2.0 * coefficients[part].sum() / scale for part in others)
    bias = (course[moment.argmax()] - course[moment.argmin()]) / scale
    return {
        "bias": _Moved(bias, np.ptp(course) / scale),
        "scale_factor": _Moved(scale_factor, abs(scale_factor)),
        "angle": _Moved(-turn, abs(turn)),
    }
