"""Gates on sizes: coefficients out of all proportion, and readings in another unit."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from accelcal.gates.stack import TableStack
from accelcal.gates.trend import Cells
from accelcal.gates.verdict import GateStack, acceleration, gate_stack, times
from accelcal.grouping import distinct
from accelcal.model import COEFFICIENTS

__all__ = ["proportions", "units", "wrong_sign"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_LARGEST = {"K0": 0.2, "K2": 0.1, "K3": 0.1, "M": 0.1, "M_ip": 0.1}  # over K1
_LARGEST_RESIDUAL = 0.02  # rms [g]
_TELLING = 0.3  # readings below this share of the largest tell nothing about the unit
_OTHER_SIZE = 1.3  # ratio of two strokes, or of two scale factors, above any temperature effect
_NEAR_DECADE = 0.1  # of a power of ten, in decimal digits: a bias makes opposite readings differ
_MOST_TOLD = 3
_SMALLEST = 1e-300


def proportions(stack: TableStack) -> GateStack:
    """Compare the error coefficients and residuals with what any accelerometer has.

    Parameters
    ----------
    stack : TableStack
        The tables.

    Returns
    -------
    GateStack
        A warning where the scale factor is not positive, or another coefficient or the rms
        residual is too large a part of it; the statistic is the largest of them over its limit.
    """
    scale_factor = stack.coefficients[:, COEFFICIENTS.index("K1")]
    turned = scale_factor <= 0.0
    over = np.where(turned, np.nan, scale_factor)
    columns = [COEFFICIENTS.index(name) for name in _LARGEST]
    ratio = stack.coefficients[:, columns] / over[:, None]
    residual = stack.output - stack.coefficients @ stack.table.design.T
    rms = np.sqrt((residual**2).mean(axis=1)) / over
    sizes = np.column_stack([np.abs(ratio) / list(_LARGEST.values()), rms / _LARGEST_RESIDUAL])
    largest = np.where(turned, np.inf, sizes.max(axis=1))

    def said(index: int) -> str:
        if turned[index]:
            return wrong_sign(float(scale_factor[index]))
        found = _odd(dict(zip(_LARGEST, ratio[index].tolist(), strict=True)), float(rms[index]))
        return ", ".join(found) or "all coefficients in proportion to K1"

    return gate_stack("proportions", largest > 1.0, said, largest)


def _odd(ratios: dict[str, float], rms: float) -> list[str]:
    """Say what of one table is out of proportion."""
    odd = [
        f"{name}/K1 = {ratios[name]:.3g} is above {limit:g} in size"
        for name, limit in _LARGEST.items()
        if abs(ratios[name]) / limit > 1.0
    ]
    if rms / _LARGEST_RESIDUAL > 1.0:
        odd.append(f"the readings are {acceleration(rms)} (rms) away from the model")
    elif abs(ratios["M"]) / _LARGEST["M"] > 1.0:
        turn = np.degrees(np.arctan2(-ratios["M"], 1.0))
        odd.append(f"as if all positions were shifted by {turn:.1f} deg")
    return odd


def wrong_sign(scale_factor: float) -> str:
    """Say what a scale factor that is not positive means.

    Parameters
    ----------
    scale_factor : float
        K1 [output unit / g].

    Returns
    -------
    str
        The finding.
    """
    return (
        f"K1 = {scale_factor:.6g} is not positive: the sign of the output is turned, or the"
        " positions are shifted by half a turn"
    )


def units(stack: TableStack) -> GateStack:
    """Look for strokes and readings that another unit or range has made larger or smaller.

    Parameters
    ----------
    stack : TableStack
        The tables.

    Returns
    -------
    GateStack
        A warning where some readings of a stroke differ by a power of ten from those at the same
        and the opposite head position, or where whole strokes are of another size; the statistic
        is the ratio farthest from one.

    Notes
    -----
    The size of a stroke is the amplitude of a sine through it, which no wrong order changes.
    """
    cells = Cells.of(stack.table.record.stroke)
    power = _decades(stack.output, np.mod(stack.table.head, 180.0))
    wrong = power != 0.0
    count, first = wrong.sum(axis=1), wrong.argmax(axis=1)
    share = cells.sums(wrong.astype(np.float64)) / cells.members
    whole = ((share == 0.0) | (share > 0.5)).all(axis=1)
    row = np.arange(len(stack))
    odd = power[row, first]
    of_strokes = (count == 0) | whole | ((count == 1) & (odd < 0.0))
    ratio = _ratios_of_strokes(stack, cells)
    other = np.abs(np.log(ratio)) > np.log(_OTHER_SIZE)

    def said(index: int) -> str:
        if of_strokes[index]:
            return _size_of_strokes(cells.key, ratio[index], other[index])
        more = f" and {count[index] - 1} more" if count[index] > 1 else ""
        size = times(10.0 ** float(odd[index]))
        return (
            f"{stack.place(index, int(first[index]))}{more}: about {size} times the readings at the"
            " same and the opposite angle, another unit or range"
        )

    farthest = np.abs(np.log(ratio)).argmax(axis=1)
    statistic = np.where(of_strokes, ratio[row, farthest], 10.0**odd)
    return gate_stack("units", ~of_strokes | other.any(axis=1), said, statistic)


def _decades(output: Array, axis: Array) -> Array:
    """Powers of ten by which readings differ from the others on the same axis of the head."""
    size = np.abs(output)
    usual = np.empty_like(size)
    for own in (axis == value for value in distinct(axis)):
        usual[:, own] = _middle(size[:, own])
    telling = (usual > _TELLING * usual.max(axis=1, keepdims=True)) & (size > 0.0)
    decades = np.log10(np.where(telling, size, 1.0) / np.where(telling, usual, 1.0))
    power = np.round(decades)
    return np.where(np.abs(decades - power) < _NEAR_DECADE, power, 0.0)


def _middle(values: Array) -> Array:
    """Lower median of each row: one of the values, so that two groups are not mixed, (T, 1)."""
    place = (values.shape[1] - 1) // 2
    return np.asarray(np.partition(values, place, axis=1)[:, place : place + 1])


def _ratios_of_strokes(stack: TableStack, cells: Cells) -> Array:
    """Amplitude of each stroke over the middle one, (T, S); 1 where its readings are too few."""
    weights = np.zeros((2, stack.output.shape[1]))
    known = np.zeros(cells.key.size, dtype=np.bool_)
    sine = lru_cache(maxsize=8)(_sine)  # strokes back are at the same angles as each other
    for k in range(cells.key.size):
        own = cells.cell == k
        angles = tuple(stack.table.head[own].tolist())
        known[k] = len(set(angles)) >= 3
        if known[k]:
            weights[:, own] = sine(angles)
    ratio = np.ones((len(stack), cells.key.size))
    if known.any():
        size = np.hypot(*(cells.sums(stack.output * weight)[:, known] for weight in weights))
        size = np.maximum(size, _SMALLEST)
        ratio[:, known] = size / _middle(size)
    return ratio


def _sine(angle: tuple[float, ...]) -> Array:
    """Weights of readings in cosine and sine of a sine through them, shape (2, n)."""
    th = np.radians(angle)
    matrix = np.column_stack([np.ones_like(th), np.cos(th), np.sin(th)])
    return np.asarray(np.linalg.pinv(matrix)[1:])


def _size_of_strokes(strokes: NDArray[np.int64], ratio: Array, other: Mask) -> str:
    """Say which strokes of one table are of another size."""
    if not other.any():
        return "all strokes of one size"
    found = [
        f"stroke {k} is {times(size)} times"
        for k, size in zip(strokes[other].tolist(), ratio[other].tolist(), strict=True)
    ]
    said = "the other stroke" if strokes.size == 2 else "the other strokes"
    more = f" (and {len(found) - _MOST_TOLD} more)" if len(found) > _MOST_TOLD else ""
    return f"{', '.join(found[:_MOST_TOLD])} as large as {said}{more}: another unit or range"
