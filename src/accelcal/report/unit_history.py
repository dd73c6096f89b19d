"""A unit through its recalibrations, as text for a terminal."""

from __future__ import annotations

from collections.abc import Iterator

from accelcal.escapes import visible
from accelcal.plural import counted
from accelcal.report.findings import p_value
from accelcal.report.lines import aligned, hanging, visible_lines
from accelcal.report.numbers import in_millionths, matching_digits, significant
from accelcal.results.quantity import Quantity
from accelcal.results.unit_history import History, Trend
from accelcal.shown_units import SMALL_UNITS
from accelcal.units import MICRO

_SHOWN = 40


def text(history: History) -> str:
    """Write a history as lines of at most 100 characters."""
    lines = [*_heading(history)]
    for trend in history.trends:
        lines += ["", *_trend(trend, history.alpha)]
    for note in history.notes:
        lines += hanging(f"note: {visible(note)}")
    return visible_lines(lines)


def _heading(history: History) -> Iterator[str]:
    points = history.trends[0].points
    level = history.temperature_degC
    where = "" if level is None else f", at {level:.4g} degC"
    yield f"History of {visible(history.serial or 'a unit without serial number')}"
    yield (
        f"{counted(len(points), 'calibration')} from {points[0].date} to {points[-1].date}"
        f"{where}, mounting {history.mounting}; intervals are of 95 %"
    )


def _trend(trend: Trend, alpha: float) -> Iterator[str]:
    unit = SMALL_UNITS[trend.points[0].measured.unit]
    where = "" if not trend.reference else f", from {trend.reference:.9g} {trend.reference_unit}"
    yield f"{trend.name} {trend.symbol}{where} [{unit}]"
    yield from _drifts(trend, unit)
    yield f"  scatter  {_scatter(trend, unit)}"
    for jump in trend.jumps:
        size, chance = _interval(jump.size), p_value(jump.p_value)
        yield f"  JUMP     between {jump.after} and {jump.before}: {size} {unit}, {chance}"
    if trend.no_other_jump is not None:
        other = "other " if trend.jumps else ""
        largest = p_value(trend.no_other_jump)
        yield f"  no {other}jump at alpha = {alpha:g}; the largest has {largest}"
    yield from _points(trend)


def _drifts(trend: Trend, unit: str) -> Iterator[str]:
    """Tell the drift with the interval that holds for most units first."""
    wide, narrow = trend.drift_of_a_walk, trend.drift
    if wide is None:
        yield f"  drift    {_interval(narrow)} {unit}/year{_significance(narrow)}"
        return
    included, beside = (", jumps included", " beside the jumps") if trend.jumps else ("", "")
    yield (
        f"  drift    {_interval(wide)} {unit}/year{_significance(wide)}, for a unit that may wander"
        f"{included}"
    )
    yield f"           {_interval(narrow)} {unit}/year{beside} if it does not wander"


def _points(trend: Trend) -> Iterator[str]:
    rows = [("date", "value", "U", "less line", "from")]
    for point in trend.points[-_SHOWN:]:
        found, wide = point.measured.value or 0.0, point.measured.expanded_uncertainty
        value, half = matching_digits(found, wide, MICRO)
        apart = matching_digits(found - point.line, wide, MICRO)[0]
        rows.append((point.date, value, half, apart, visible(point.source)[-50:]))
    yield "  calibrations"
    yield from aligned(rows, right={1, 2, 3}, indent="    ")
    if len(trend.points) > _SHOWN:
        yield f"    and {len(trend.points) - _SHOWN} earlier ones (CSV and JSON have all)"


def _interval(quantity: Quantity) -> str:
    return " +- ".join(in_millionths(quantity))


def _significance(quantity: Quantity) -> str:
    return "" if quantity.is_off_zero else ", which may be none"


def _scatter(trend: Trend, unit: str) -> str:
    if not trend.scatter_limits[1]:
        return (
            "none: the values lie closer together than their uncertainties, which may share errors"
        )
    value, low, high = (
        significant(MICRO * number, 2) if number else "0"
        for number in (trend.scatter, *trend.scatter_limits)
    )
    told = f"{value} ({low} to {high}) {unit}"
    return f"{told} from one calibration to the next, beyond what is stated"
