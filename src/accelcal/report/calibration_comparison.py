"""A comparison of two calibrations, told in text."""

from __future__ import annotations

from collections.abc import Iterator

from accelcal.model import SLOPES
from accelcal.numerics.probability import LEVEL
from accelcal.report.calibration_rows import SHOWN_COEFFICIENTS
from accelcal.report.findings import headline, probability
from accelcal.report.lines import aligned, notes, sections, wrapped
from accelcal.report.numbers import matching_digits, significant
from accelcal.results.calibration_comparison import (
    CalibrationComparison,
    CoefficientChange,
    ComparedCalibration,
    IndicatedChange,
)
from accelcal.shown_units import in_small_unit
from accelcal.units import MICRO

_HEADINGS = ("", "", "old", "new", "new - old", "U (95 %)", "unit", "E_n ")
_NAMES = {symbol: name for name, symbol, *_ in SHOWN_COEFFICIENTS}
_NAMES |= {symbol: f"{_NAMES[law]} {side} T0" for symbol, (law, side) in SLOPES.items()}
_ORDER = list(_NAMES)


def text(found: CalibrationComparison) -> str:
    """Tell a comparison in lines of at most 100 characters."""
    return sections(
        _head(found),
        _verdict(found),
        _changes([shown for shown in shown_changes(found) if not shown[1].effect]),
        _changes([shown for shown in shown_changes(found) if shown[1].effect]),
        _in_use(found),
        notes(found.notes),
    )


def _head(found: CalibrationComparison) -> Iterator[str]:
    unit = f"  serial {found.serial}" if found.serial else ""
    level = found.temperature_degC
    yield f"TWO CALIBRATIONS{unit}{'' if level is None else f', at {level:.4g} degC'}"
    for name, own in (("old", found.old), ("new", found.new)):
        yield from wrapped(_of(own), f"  {name}  ")
    if found.same_head is not None:
        yield f"heads: {'one, whose errors are common to both' if found.same_head else 'one each'}"


def _of(own: ComparedCalibration) -> str:
    effects = f"effects {', '.join(own.effects)}" if own.effects else ""
    return ", ".join(filter(None, (own.date, own.source, effects)))


def _verdict(found: CalibrationComparison) -> Iterator[str]:
    joint, changes = found.joint, [own for _, own in shown_changes(found)]
    tested = "coefficients and sizes of effects" if found.sizes else "coefficients"
    chance = f"chance if nothing has changed {probability(found.p_value)}"
    told = headline(f"The {tested}", found.verdict, found.hidden_by)
    yield from wrapped(f"{told} ({chance})")
    chance = f" of coefficients, chance {probability(joint.p_value)}" if found.sizes else ""
    yield (
        f"joint test: chi^2 {significant(joint.chi2, 3)} of {joint.coefficients} differences"
        f"{chance}"
    )
    yield (
        f"|E_n| > 1 (*): {sum(not own.agrees for own in changes)} of {len(changes)} {tested};"
        f" {(1.0 - LEVEL) * len(changes):.1g} if nothing has changed"
    )


def _changes(changes: list[tuple[str, CoefficientChange]]) -> Iterator[str]:
    if changes:
        rows = [_row(*change) for change in changes]
        yield from aligned([_HEADINGS, *rows], right={2, 3, 4, 5, 7}, indent="  ")


def shown_changes(found: CalibrationComparison) -> list[tuple[str, CoefficientChange]]:
    """Choose what a report shows, in its order: the name of each, and the change.

    Of the coefficients those that the report of a calibration has, and the sizes of effects.
    """
    several = len({own.cross_axis for own in found.coefficients} - {None}) > 1
    shown = (own for own in found.coefficients if own.coefficient in _ORDER)
    order = sorted(shown, key=lambda own: _ORDER.index(own.coefficient))
    axes = [f", {own.cross_axis}" if several and own.cross_axis else "" for own in order]
    names = [_NAMES[own.coefficient] + axis for own, axis in zip(order, axes, strict=True)]
    sizes = [own.effect or "" for own in found.sizes]
    return list(zip([*names, *sizes], [*order, *found.sizes], strict=True))


def _row(name: str, own: CoefficientChange) -> tuple[str, ...]:
    factor, unit = in_small_unit(own.difference.unit)
    score, half = own.normalised_error, own.difference.expanded_uncertainty
    values = (side.value or 0.0 for side in (own.old, own.new, own.difference))
    (old, _), (new, _), change = (matching_digits(value, half, factor) for value in values)
    return (
        name,
        own.coefficient,
        old,
        new,
        *change,
        unit,
        # + 0.0 turns -0.0 into 0.0
        ("" if score is None else f"{round(score, 2) + 0.0:.2f}") + (" " if own.agrees else "*"),
    )


def _in_use(found: CalibrationComparison) -> Iterator[str]:
    ends = (found.indicated[0].a_i, found.indicated[-1].a_i)
    limit, _ = matching_digits(found.at_most, found.largest.band, MICRO)
    yield from wrapped(
        f"Change of the indicated acceleration, {ends[0]:.3g} to {ends[1]:.3g} g:"
        f" largest {_at(found.largest)}; nowhere beyond {limit} ug (95 %, for the whole range at"
        " once)"
    )


def _at(own: IndicatedChange) -> str:
    value, half = matching_digits(own.difference.value or 0.0, own.band, MICRO)
    return f"{value} +- {half} ug at {own.a_i:.3g} g"
