"""What is missing in temperature laws from tables, and why: each condition with its sentence."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.estimate.launch import SAME_LEVEL
from accelcal.reference import LEAST_RISE
from accelcal.results.beyond_uncertainty import EXTRAPOLATED, LESS_CERTAIN
from accelcal.sentences import Sentence
from accelcal.temperature.bilinear import taken_from_the_other_side
from accelcal.temperature.hysteresis import Hysteresis

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
