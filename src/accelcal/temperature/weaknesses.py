"""The hysteresis of the bias, and what is missing in temperature laws from tables, and why.

Only two runs at one level tell of a loop. At its lowest and its highest level it may close or not:
there half of what the loop is elsewhere is expected of each run, and may be missing or come twice.
Its width may differ from level to level: each has a half width h of its own, the laws go through
the middle of both branches, and h_T is the mean of h over the levels.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask, Places
from accelcal.estimate.launch import SAME_LEVEL, reached_by, same_levels
from accelcal.estimate.uncertainty import Component, Intervals, interval_stack, propagate
from accelcal.reference import LEAST_RISE
from accelcal.results.beyond_uncertainty import EXTRAPOLATED, LESS_CERTAIN
from accelcal.results.quantity import Quantity
from accelcal.sentences import Sentence
from accelcal.temperature.bilinear import chance_of_misfit, taken_from_the_other_side

_HALF_OPEN = 0.5
"""Where the bias of the lowest and of the highest level is taken to lie, in half widths from the
middle towards the branch on which they are reached, and its standard uncertainty: the loop may be
closed there, or as wide as it is elsewhere."""


class Branches(NamedTuple):
    """On which branch of the loop n tables lie, alike in all records of one course of levels."""

    # shape (n, L): a column for each level that was reached both ways: 1 after heating, -1 after
    # cooling
    paired: Array
    # shape (n, L): the same, and at the lowest and the highest level what is expected of the loop
    # there, from the mean half width
    acting: Array
    # shape (n, m): columns of what lies off the middle by an amount that no pair shows: levels
    # reached one way only, the first level, of which nobody knows how it was reached, and the
    # lowest and the highest one, off what is expected there
    loose: Array
    mean: Array  # shape (n, L): weights that take the mean temperature of each level of `paired`

    def off_the_middle(self, half_widths: Array) -> Array:
        """Columns of the errors of `loose`, of the size of the root mean square half width [g].

        From half widths of shape (..., L) to columns of shape (..., n, m).
        """
        squares = half_widths**2
        size = np.sqrt(squares.sum(axis=-1) / max(squares.shape[-1], 1))
        return np.asarray(size[..., None, None] * self.loose)


def branches_of(temperature: Array, order: Places) -> Branches:
    """Tell on which branch each of n levels [degC] lies, which were met in an order, shape (n,).

    Where no level was reached both ways, there is no column.
    """
    in_order = reached_by(temperature[order].tolist())
    nothing = np.zeros((temperature.size, 0))
    if in_order is None:
        return Branches(nothing, nothing, nothing, nothing)
    reached = in_order[np.argsort(order)]
    masks = [np.isin(np.arange(reached.size), level) for level in same_levels(temperature)]
    both = [mask for mask in masks if {-1.0, 1.0} <= set(reached[mask].tolist())]
    known = np.nan_to_num(reached)
    one_way = known * ~np.any(both, axis=0)
    ends = np.stack([masks[0], masks[-1]], axis=1)
    loose = np.column_stack([one_way, np.isnan(reached), _HALF_OPEN * ends])
    paired = np.column_stack([known * mask for mask in both])
    towards = _HALF_OPEN * (1.0 * masks[-1] - masks[0]) / len(both)
    return Branches(
        paired=paired,
        acting=paired + towards[:, None],
        loose=loose[:, loose.any(axis=0)],
        mean=np.column_stack([mask / mask.sum() for mask in both]),
    )


class Hysteresis(NamedTuple):
    """Half widths of the loop of R records, and their mean over the levels."""

    mean: Array  # shape (R,): h_T [g]; NaN without a level
    # its uncertainty, shape (R, 1), which is not less than the scatter of the half widths tells,
    # with L - 1 degrees of freedom
    intervals: Intervals
    # shape (R, L): half the bias after heating less the bias after cooling, of each level [g], and
    # the levels [degC]
    half_widths: Array
    temperature: Array
    p: Array  # shape (R,): probability that levels alike differ so much; NaN where it is unknown

    def quantity(self, index: int) -> Quantity | None:
        """h_T of one record; None without a level."""
        if not self.half_widths.shape[1]:
            return None
        return self.intervals.of_record(index).around(self.mean[[index]], "g")[0]


def mean_hysteresis(
    half_widths: Array, components: Mapping[str, Component], temperature: Array
) -> Hysteresis:
    """Average the half widths over the levels.

    The half widths, shape (R, L), are half the bias after heating less the bias after cooling, of
    each level [g], with the components of their errors; the levels are of the same shape [degC].
    """
    records, size = half_widths.shape
    if size == 0:
        nothing = np.full(records, np.nan)
        unknown = Intervals(*[nothing[:, None]] * len(Intervals._fields))
        return Hysteresis(nothing, unknown, half_widths, temperature, nothing)
    of_mean = propagate(components, np.full((1, size), 1.0 / size))
    told = np.sum([part.covariance[:, 0, 0] for part in of_mean.values()], axis=0)
    seen = half_widths.var(axis=1, ddof=1) / size if size > 1 else np.zeros(records)
    missing = Component(
        np.maximum(seen - told, 0.0)[:, None, None], np.full((records, 1), max(size - 1.0, 1.0))
    )
    found = interval_stack({**of_mean, "scatter of the levels": missing})
    p = np.full(records, np.nan)
    if size > 1:
        p = chance_of_misfit(half_widths, components, np.diff(np.eye(size), axis=0))
    return Hysteresis(half_widths.mean(axis=1), found, half_widths, temperature, p)


NO_LEVEL_NEAR_T0 = (
    "the laws have one level on each side of T0 and none at it, and are not determined; measure at"
    " T0, or give T0 at a measured level"
)
_NOT_MEASURED = {
    "above": "no level more than 5 degC above T0: the slopes above are not determined",
    "below": "no level more than 5 degC below T0: the slopes below are not determined",
}
_LAUNCH = "launch_uncertainty not declared:"
OF_LOOP = "the loop"
"""Source of a shift from launch to launch that nothing tells from a hysteresis."""
_CONFOUNDED = {
    OF_LOOP: (
        f"{_LAUNCH} h_T is half the difference of launches, and what their biases shift by cannot"
        " be told from it; U counts all of it as such shifts, and is too large where there is a"
        " hysteresis"
    ),
    "estimated": (
        f"{_LAUNCH} launches and a hysteresis that differs by level cannot be told apart; the shift"
        " from launch to launch takes the hysteresis as alike at all levels"
    ),
}
_QUANTITIES = ("bias", "scale factor", "misalignment")
_SIGNIFICANT = 0.001
_MATTERS = 0.01  # share of a variance; its error is a tenth of the standard uncertainty


def law_sentences(
    sides: Sequence[str],
    off: Mask,
    loop: Hysteresis,
    shift_source: str,
    reference: Array,
    temperature: Array,
    by_heat: Array,
) -> Iterator[Sentence]:
    """Say what is missing in the laws of R records alike, of which some sides of T0 were measured.

    Bias, scale factor and misalignment may be `off` their laws, shape (R, 3). `OF_LOOP` is the
    source of a shift from launch to launch where nothing tells it from a hysteresis, else it is as
    of `accelcal.estimate.launch.RunShift`. T0 and the levels [degC] are of shape (R,) and (R, n),
    and so is `by_heat`, the share of their variances that errors of their temperature make.
    """
    for side, text in _NOT_MEASURED.items():
        if side not in sides:
            yield Sentence(True, text)
    yield from _of_other_slopes(sides, reference, temperature)
    yield from _of_end_level(sides, reference, temperature, by_heat)
    for name, is_off in zip(_QUANTITIES, off.T, strict=True):
        yield Sentence(
            is_off,
            f"the {name} does not follow its bilinear law: a curvature, another break, or an"
            f" undeclared shift from run to run; its values and slopes are {LESS_CERTAIN}",
        )
    yield from _of_loop(loop, shift_source)
    yield _of_far_reference(reference, temperature)
    if len(sides) == 2:
        yield from _of_reference_between(reference, temperature)


def _of_other_slopes(
    sides: Sequence[str], reference: Array, temperature: Array
) -> Iterator[Sentence]:
    """Say which level has the slope of the other side, and how T0 would need none."""
    rise = temperature - reference[:, None]
    beyond = taken_from_the_other_side(rise, sides)
    at = np.take_along_axis(temperature, beyond.argmax(axis=1)[:, None], axis=1)[:, 0]
    there, here = ("above", "below") if sides[0] == "below" else ("below", "above")
    yield Sentence(
        np.asarray(beyond.any(axis=1)),
        lambda level, t0: (
            f"{level:g} degC lies {there} T0 = {t0:g} degC, where no slope is measured: the one"
            f" {here} is taken, +- all of it; give T0 at a measured level"
        ),
        [at, reference],
    )


def _of_end_level(
    sides: Sequence[str], reference: Array, temperature: Array, by_heat: Array
) -> Iterator[Sentence]:
    """Say that the errors of temperatures at T0 count by the slopes of one side alone.

    No reading tells the slopes of the other side, on which one of two such errors lies.
    """
    if len(sides) != 1:
        return
    at_T0 = np.abs(temperature - reference[:, None]) <= SAME_LEVEL
    (measured,) = sides
    beyond = {"above": "below", "below": "above"}[measured]
    yield Sentence(
        np.asarray((at_T0 & (by_heat > _MATTERS)).any(axis=1)),
        lambda t0: (
            f"errors of the temperature at T0 = {t0:g} degC count by the slopes {measured} alone:"
            f" where those {beyond} are larger, U at T0 is too small; measure a level {beyond} T0"
        ),
        [reference],
    )


def _of_loop(loop: Hysteresis, shift_source: str) -> Iterator[Sentence]:
    """Say where its width differs, and that launches may pass for it where they may."""
    yield Sentence(
        loop.p < _SIGNIFICANT,
        lambda *widths: (
            f"the hysteresis differs by level: {_told(widths)}; h_T is their mean, and U holds"
            " the scatter"
        ),
        [*loop.half_widths.T, *loop.temperature.T],
    )
    if loop.half_widths.shape[1] and shift_source in _CONFOUNDED:
        yield Sentence(True, _CONFOUNDED[shift_source])


def _told(widths: Sequence[float]) -> str:
    half = len(widths) // 2  # so many half widths, and then the level of each
    levels = zip(widths[:half], widths[half:], strict=True)
    return ", ".join(f"{1e6 * h:.3g} ug at {at:.3g} degC" for h, at in levels)


def _of_far_reference(reference: Array, temperature: Array) -> Sentence:
    """Say that the values at T0 are extrapolated, where T0 is far outside the levels."""
    low, high = temperature.min(axis=1), temperature.max(axis=1)
    outside = np.maximum(low - reference, reference - high)
    return Sentence(
        outside > LEAST_RISE,
        lambda reference, outside, low, high: (
            f"T0 = {reference:g} degC lies {outside:g} degC outside the levels, {low:g} to"
            f" {high:g} degC: the values at T0 are extrapolated, and {EXTRAPOLATED}"
        ),
        [reference, outside, low, high],
    )


def _of_reference_between(reference: Array, temperature: Array) -> Iterator[Sentence]:
    """Say where no level lies at T0 and one alone on a side, so that no misfit shows the break."""
    rise = temperature - reference[:, None]
    is_apart = np.abs(rise).min(axis=1) > SAME_LEVEL
    for side, other, beyond in (("above", "below", rise), ("below", "above", -rise)):
        farthest = beyond.max(axis=1, keepdims=True)
        is_alone = np.all((beyond < 0.0) | (farthest - beyond <= SAME_LEVEL), axis=1)
        yield Sentence(
            is_apart & is_alone,
            lambda t0, side=side, other=other: (
                f"no level lies at T0 = {t0:g} degC, and one alone {side} it: the values at T0 are"
                f" extrapolated from the levels {other}, and {EXTRAPOLATED}; give T0 at a measured"
                " level"
            ),
            [reference],
        )
