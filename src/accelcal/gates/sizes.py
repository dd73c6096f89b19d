"""Gates on sizes: coefficients out of all proportion, and readings in another unit."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from itertools import combinations
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Ints, Mask, Places
from accelcal.estimate.tables import PreparedTable
from accelcal.gates.plan import TablePlan, once_a_plan, rank_and_inverse
from accelcal.gates.stack import TableStack
from accelcal.gates.verdict import GateStack, acceleration, gate_stack, times
from accelcal.geometry import side_of
from accelcal.head_angles import head_positions
from accelcal.model import (
    BIAS,
    COEFFICIENTS,
    ERROR_TERMS,
    ERROR_UNITS,
    MISALIGNMENT,
    SCALE_FACTOR,
    coefficient_unit,
)
from accelcal.numerics.grouping import Grouped, distinct, grouped

LARGEST_RATIOS = {"K0": 0.2, "K2": 0.1, "K3": 0.1, "M": 0.1, "M_ip": 0.1}
"""Largest part of K1 that a coefficient of any accelerometer has [1 / g^(n - 1)]."""

LARGEST_RESIDUAL = 0.02
"""Largest rms residual of any accelerometer [g]."""

_FEWEST = 4  # positions in a turn: fewer leave no residual
_TRIED = range(6, 41)  # numbers of angles of which each two are tried; four may be negated so
_FAR_LESS = 0.01  # share of the squared residuals as given that other positions may leave
_WHOLE = 1e-6  # by which the number of a position may miss a whole one
_TELLING = 0.3  # readings below this share of the largest tell nothing about the unit
_OTHER_SIZE = 1.3  # ratio of two strokes, or of two scale factors, above any temperature effect
_NEAR_DECADE = 0.1  # log10 by which a ratio may miss a power of ten, as a bias shifts it
_IN_A_DECADE = 7.9  # just below 10^(1 - _NEAR_DECADE)
_CLEARLY_ONE_SIZE = 1.299  # just below _OTHER_SIZE
_MOST_TOLD = 3
_SMALLEST = 1e-300


def proportions(stack: TableStack) -> GateStack:
    """Compare the error coefficients and residuals with what any accelerometer has.

    It warns where the scale factor is not positive, or another coefficient or the rms residual is
    too large a part of it.
    """
    scale_factor, misalignment = (stack.coefficients[:, i] for i in (SCALE_FACTOR, MISALIGNMENT))
    turned = scale_factor <= 0.0
    over = np.where(turned, np.nan, scale_factor)
    columns = [COEFFICIENTS.index(name) for name in LARGEST_RATIOS]
    ratio = stack.coefficients[:, columns] / over[:, None]
    left = np.sqrt((stack.residual**2).sum(axis=0) / stack.readings)
    rms = left / over
    large = (np.abs(ratio) / list(LARGEST_RATIOS.values()) > 1.0).any(axis=1)
    bad = turned | large | (rms / LARGEST_RESIDUAL > 1.0)
    unit = stack.table.record.unit

    def said(index: int) -> str:
        if not bad[index]:
            return "all coefficients in proportion to K1"
        other = other_positions(stack.table, stack.output[:, index], stack.delta0)
        if other is None and left[index] > abs(scale_factor[index]):
            return _no_answer(float(scale_factor[index]), float(left[index]), unit)
        if turned[index] and other is None:
            across = side_of(stack.table.mounting) * float(misalignment[index])
            return _not_positive(float(scale_factor[index]), across, unit)
        ratios = dict(zip(LARGEST_RATIOS, ratio[index].tolist(), strict=True))
        found = _out_of_proportion(ratios)
        if turned[index]:
            found.append(f"K1 = {scale_factor[index]:.6g} {coefficient_unit('K1', unit)}")
        if other is None:
            side = side_of(stack.table.mounting)
            found += _reason(ratios, float(rms[index]), side, alone=len(found) == 1)
        return ", ".join(found if other is None else [*found, other.said])

    return gate_stack("proportions", bad, said)


def _no_answer(scale_factor: float, rms: float, unit: str | None) -> str:
    """Say that the readings, of which such an rms is left, are none of an accelerometer."""
    return (
        f"K1 = {scale_factor:.3g} {coefficient_unit('K1', unit)} is smaller than what it leaves of"
        f" the readings, rms {rms:.3g} {coefficient_unit('K0', unit)}: they do not follow the"
        " angle; look for the channel and its contacts"
    )


def _out_of_proportion(ratios: dict[str, float]) -> list[str]:
    """Say which coefficients of one table are too large a part of K1."""
    large = {
        ERROR_TERMS[name]: (ratios[name], limit)
        for name, limit in LARGEST_RATIOS.items()
        if abs(ratios[name]) / limit > 1.0
    }
    return [
        f"{name} = {size:.3g} {ERROR_UNITS[name]} is above {limit:g} {ERROR_UNITS[name]} in size"
        for name, (size, limit) in large.items()
    ]


def _reason(ratios: dict[str, float], rms: float, side: float, *, alone: bool) -> list[str]:
    """Say what may be the reason; `alone` if one coefficient is out of proportion."""
    if rms / LARGEST_RESIDUAL > 1.0:
        return [f"the readings are {acceleration(rms)} (rms) away from the model"]
    if abs(ratios["M"]) / LARGEST_RATIOS["M"] > 1.0:
        return [_shifted(1.0, side * ratios["M"])]
    if alone and abs(ratios["K0"]) / LARGEST_RATIOS["K0"] > 1.0:
        return ["subtract what the output is at 0 g by design, a carrier or mid-range"]
    return []


def _shifted(scale_factor: float, across: float) -> str:
    turn = np.degrees(np.arctan2(-across, scale_factor))
    return f"as if all positions were shifted by {turn:.1f} deg"


def _not_positive(scale_factor: float, across: float, unit: str | None) -> str:
    """Say why a scale factor is not positive, beside what goes with a_p [output unit / g]."""
    if not abs(across) > LARGEST_RATIOS["M"] * abs(scale_factor):
        return wrong_sign(scale_factor, unit)
    return f"{_turned_size(scale_factor, unit)}, {_shifted(scale_factor, across)}"


def wrong_sign(scale_factor: float, unit: str | None) -> str:
    """Say what a scale factor that is not positive means."""
    why = "the sign of the output is turned, or the positions are shifted by half a turn"
    return f"{_turned_size(scale_factor, unit)}: {why}"


def _turned_size(scale_factor: float, unit: str | None) -> str:
    """Say that a scale factor is not positive."""
    return f"K1 is not positive ({scale_factor:.6g} {coefficient_unit('K1', unit)})"


class OtherPositions(NamedTuple):
    """Positions with which readings are in proportion, and hardly leave a residual."""

    name: str  # what is wrong with those given
    said: str
    squares: float  # squared residuals left [output unit^2]


def other_positions(table: PreparedTable, output: Array, delta0: float) -> OtherPositions | None:
    """Find other positions with which readings are in proportion, and hardly leave a residual.

    The readings, shape (n,) [output unit], are those at the angles of the table, with a fixture
    angle [rad].
    """
    given = _fit(table, output, delta0, table.record.angle)[1]
    left = partial(_left_in_proportion, table, output, delta0, given * _FAR_LESS)
    return _fitting_turn(table, left) or _fitting_exchange(table, left)


def _fitting_turn(table: PreparedTable, left: Callable[[Array], float]) -> OtherPositions | None:
    """Another number of positions in a turn, which go once around.

    They do so with the return to the first one or without. None where none fits, or the angles are
    none of numbered positions.
    """
    positions = table.record.positions
    number = table.record.angle * positions / 360.0  # from 0
    if np.abs(number - np.round(number)).max() > _WHOLE:
        return None
    last = int(np.round(number.max()))
    for other in (last + 1, last):
        if other < _FEWEST or other == positions:
            continue
        squares = left(number * 360.0 / other)
        if np.isfinite(squares):
            said = f"the readings fit {other} positions in a turn: declare '# positions: {other}'"
            return OtherPositions("number of positions", said, squares)
    return None


def _fitting_exchange(
    table: PreparedTable, left: Callable[[Array], float]
) -> OtherPositions | None:
    """The only two angles whose exchange in all strokes fits."""
    angle = table.record.angle
    angles = distinct(angle)
    if angles.size not in _TRIED:
        return None
    pairs = list(combinations(angles.tolist(), 2))
    squares = [left(_exchanged(angle, *pair)) for pair in pairs]
    fits = np.flatnonzero(np.isfinite(squares))
    if fits.size != 1:
        return None
    first, second = pairs[fits[0]]
    said = f"the readings fit with those at {first:g} and {second:g} deg exchanged in all strokes"
    return OtherPositions("positions exchanged", said, squares[fits[0]])


def _exchanged(angle: Array, first: float, second: float) -> Array:
    return np.where(angle == first, second, np.where(angle == second, first, angle))


def _left_in_proportion(
    table: PreparedTable, output: Array, delta0: float, largest: float, angle: Array
) -> float:
    """Squared residuals of readings at angles [deg], infinite where they are in no proportion.

    So they are as well where they are not small against those of the angles given: what is large
    in truth, as a K2, is not much less so with two positions exchanged that hardly differ.
    """
    (k0, k1, m), squares = _fit(table, output, delta0, angle)
    rms = np.sqrt(squares / output.size)
    sizes = (k0, LARGEST_RATIOS["K0"]), (m, LARGEST_RATIOS["M"]), (rms, LARGEST_RESIDUAL)
    is_small = all(abs(size) <= k1 * most for size, most in sizes) and squares <= largest
    return squares if is_small else np.inf


def _fit(table: PreparedTable, output: Array, delta0: float, angle: Array) -> tuple[Array, float]:
    """K0, K1 and M, which four angles tell apart, and the squared residuals that they leave."""
    design = table.design_at(angle, delta0)[:, [BIAS, SCALE_FACTOR, MISALIGNMENT]]
    found = np.linalg.lstsq(design, output)[0]
    return np.asarray(found), float(((output - design @ found) ** 2).sum())


def units(stack: TableStack) -> GateStack:
    """Look for strokes and readings that another unit or range has made larger or smaller.

    It warns where some readings of a stroke differ by a power of ten from those at the same and the
    opposite head position, or where whole strokes are of another size.

    Notes
    -----
    The size of a stroke is the amplitude of a sine through it, which no wrong order changes.
    """
    groups = _groups(stack.plan)
    amplitude = groups.amplitudes(stack.known(stack.output))
    whole = cache(lambda: _Sizes.of(stack.output, amplitude, groups))
    bad = ~_alike(np.abs(stack.output), amplitude, groups.axes)
    rows = np.flatnonzero(bad)
    if rows.size and stack.there is None:
        bad[rows] = _Sizes.of(stack.output[:, rows], amplitude[:, rows], groups).bad

    def said(index: int) -> str:
        found = whole()
        if found.of_strokes[index]:
            return _size_of_strokes(groups.strokes.key, found.ratio[:, index])
        power = found.power[:, index]
        first, *others = np.flatnonzero(power).tolist()
        more = f" and {len(others)} more" if others else ""
        size = times(10.0 ** float(power[first]))
        return (
            f"{stack.place(index, first)}{more}: about {size} times the readings at the"
            " same and the opposite angle, another unit or range"
        )

    return gate_stack("units", bad, said)


class _Groups(NamedTuple):
    """Readings whose sizes are held against each other."""

    axes: list[Places]  # readings on each axis of the head
    strokes: Grouped
    wave: Array  # one, cosine and sine of the angle of each reading, shape (n, 3)
    # from their products with a stroke to its cosine and sine, shape (S, 3, 2) or (T, S, 3, 2)
    inverse: Array
    known: Mask  # strokes of which enough angles are read, shape (S,) or (T, S)

    def amplitudes(self, output: Array) -> Array:
        """Amplitudes of a sine through the readings of each known stroke, (known, T).

        Of tables with gaps they are those of each stroke, (S, T), 0 where it is not known.
        """
        seen = self.strokes.products(output, self.wave)
        if self.known.ndim == 2:
            size = np.hypot(*np.einsum("stk,tskl->lst", seen, self.inverse))
            return np.where(self.known.T, size, 0.0)
        size = np.hypot(*np.moveaxis(seen[self.known] @ self.inverse[self.known], 2, 0))
        return np.asarray(np.maximum(size, _SMALLEST))


@once_a_plan
def _groups(plan: TablePlan) -> _Groups:
    axes = grouped(head_positions(2.0 * plan.head)).parts  # twice the angle: opposites are one
    strokes, th = plan.strokes, np.radians(plan.head)
    wave = np.column_stack([np.ones_like(th), np.cos(th), np.sin(th)])
    known = wave if plan.there is None else plan.there[..., None] * wave
    rank, inverse = rank_and_inverse(strokes.products(known, wave))
    return _Groups(axes, strokes, wave, inverse[..., 1:], rank > 2.0)


class _Sizes(NamedTuple):
    """Sizes of the readings and of the S strokes of T tables against each other.

    The readings differ by a `power` of ten from the others on the same axis of the head, (n, T);
    the strokes are in a `ratio` to the middle one, (S, T). The latter tells what is wrong with the
    tables `of_strokes`, (T,).
    """

    power: Array
    ratio: Array
    of_strokes: Mask

    @classmethod
    def of(cls, output: Array, amplitude: Array, groups: _Groups) -> _Sizes:
        power = _decades(np.abs(output), groups.axes)
        wrong = power != 0.0
        count, first = wrong.sum(axis=0), wrong.argmax(axis=0)
        strokes = groups.strokes
        share = strokes.sums(wrong.astype(np.float64)) / strokes.members[:, None]
        whole = ((share == 0.0) | (share > 0.5)).all(axis=0)
        small = np.take_along_axis(power, first[None], axis=0)[0] < 0.0
        ratio = np.ones((groups.known.size, output.shape[1]))
        if groups.known.any():
            ratio[groups.known] = amplitude / _middle(amplitude)
        return cls(power, ratio, (count == 0) | whole | ((count == 1) & small))

    @property
    def bad(self) -> Mask:
        """Tables to warn of, shape (T,)."""
        return np.asarray(~self.of_strokes | _of_other_size(self.ratio).any(axis=0))


def _alike(size: Array, amplitude: Array, axes: list[Places]) -> Mask:
    """Tables of which no reading and no stroke can be of another size than the others, (T,).

    The usual size on an axis is one of those on it. So none there is ten times or a tenth of it,
    give or take `_NEAR_DECADE`, where the largest is less than `_IN_A_DECADE` times the least; and
    none tells anything where the largest is small against all on another axis. In the same way no
    stroke differs from the middle one by more than the largest does from the least.
    """
    on_axes = [size[own] for own in axes]
    low, high = (np.stack([pick(own, axis=0) for own in on_axes]) for pick in (np.min, np.max))
    alike = (high < _IN_A_DECADE * low) | (high <= _TELLING * low.max(axis=0))
    least, largest = amplitude.min(axis=0, initial=np.inf), amplitude.max(axis=0, initial=0.0)
    return np.asarray(alike.all(axis=0) & (largest < _CLEARLY_ONE_SIZE * least))


def _decades(size: Array, axes: list[Places]) -> Array:
    """Powers of ten by which readings differ from the others on the same axis of the head."""
    usual = np.empty_like(size)
    for own in axes:
        usual[own] = _middle(size[own])
    telling = (usual > _TELLING * usual.max(axis=0)) & (size > 0.0)
    decades = np.log10(np.where(telling, size, 1.0) / np.where(telling, usual, 1.0))
    power = np.round(decades)
    return np.where(np.abs(decades - power) < _NEAR_DECADE, power, 0.0)


def _middle(values: Array) -> Array:
    """Lower median of each table: one of the values, so that two groups are not mixed, (T,)."""
    place = (len(values) - 1) // 2
    return np.asarray(np.partition(values, place, axis=0)[place])


def _of_other_size(ratio: Array) -> Mask:
    return np.asarray(np.abs(np.log(ratio)) > np.log(_OTHER_SIZE))


def _size_of_strokes(strokes: Ints, ratio: Array) -> str:
    """Say which strokes of one table are of another size."""
    other = _of_other_size(ratio)
    if not other.any():
        return "all strokes of one size"
    found = [
        f"stroke {k} is {times(size)} times"
        for k, size in zip(strokes[other].tolist(), ratio[other].tolist(), strict=True)
    ]
    said = "the other stroke" if strokes.size == 2 else "the other strokes"
    more = f" (and {len(found) - _MOST_TOLD} more)" if len(found) > _MOST_TOLD else ""
    return f"{', '.join(found[:_MOST_TOLD])} as large as {said}{more}: another unit or range"
