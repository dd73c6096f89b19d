"""A calibration as text for an engineer."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from accelcal.escapes import visible
from accelcal.plural import counted, degrees_of_freedom
from accelcal.report.calibration_rows import (
    HEADINGS,
    LAW_HEADINGS,
    LawRow,
    coefficient_rows,
    first_alarms,
    residual_grid,
    residuals_by_angle,
    rows_of_mean,
    strong_correlations,
    temperature_laws,
    without_uncertainty,
)
from accelcal.report.lines import WIDTH, aligned, hanging, sections, unit_of
from accelcal.report.numbers import in_millionths, matching_digits, significant, sized
from accelcal.report.verdict import verdict_lines
from accelcal.results.table import TableCalibration
from accelcal.shown_units import ACCELERATIONS, by_size, plain, readable
from accelcal.units import MICRO

if TYPE_CHECKING:
    from accelcal.results.calibration import Calibration
    from accelcal.results.findings import FoundEffect
    from accelcal.results.fixture_angle import FixtureAngle
    from accelcal.results.quantity import ErrorSource, Gate, Quantity

_STANDARD_GRAVITY = 9.80665  # m/s^2, 3rd CGPM 1901


def text(calibration: Calibration) -> str:
    """Write a calibration as lines of at most 100 characters, in ASCII."""
    alarms = first_alarms(calibration)
    return sections(
        _heading(calibration),
        _bare(calibration),
        _alarms(alarms),
        _open(calibration.warnings),
        *(table_lines(t, calibration.g_local_m_s2, alarms) for t in calibration.tables),
        _mean_of_runs(calibration),
        _temperature(calibration),
        _fixture_angles(calibration.fixture_angle),
        _effects(calibration),
        _errors(calibration),
        _record_gates(calibration.gates, alarms),
        [] if calibration.verdict is None else verdict_lines(calibration.verdict),
    )


def _heading(calibration: Calibration) -> Iterator[str]:
    unit = unit_of(calibration.serial, calibration.source)
    date = f", {calibration.date}" if calibration.date else ""
    yield from hanging(visible(f"Calibration of {unit}{date}"))
    tables = calibration.tables
    readings = counted(sum(table.readings for table in tables), "reading")
    robust = ", robust" if calibration.robust else ""
    gravity = calibration.g_local_m_s2
    yield (
        f"{calibration.method}{robust}, {readings} in {counted(len(tables), 'table')}; g is local g"
        + (f" = {gravity!r} m/s^2, taken as exact" if gravity else "")
        + (f"; T0 = {calibration.T0_degC:g} degC" if calibration.T0_degC is not None else "")
    )


def _bare(calibration: Calibration) -> Iterator[str]:
    for sentence in without_uncertainty(calibration):
        yield from hanging(visible(f"NO UNCERTAINTY: {sentence}"))


def _alarms(found: Sequence[str]) -> Iterator[str]:
    if found:
        yield "CLEAR UP THESE WARNINGS FIRST (each warns by chance in at most 1 % of good records)"
    yield from _items("WARNING", found)


def table_lines(
    table: TableCalibration, local_gravity: float | None, alarms: Sequence[str] = ()
) -> Iterator[str]:
    """Tell one table: its coefficients, residuals and gates, with warnings not among the alarms."""
    temperature = table.temperature_degC
    where = "temperature unknown" if temperature is None else f"{temperature:.2f} degC"
    yield (
        f"Run {table.run}: {where}, mounting {table.mounting},"
        f" {counted(table.readings, 'reading')}, {degrees_of_freedom(table.dof)}"
    )
    yield from _coefficients(table)
    yield from scale_factor_elsewhere(table, local_gravity)
    for sentence in strong_correlations(table):
        yield from hanging(sentence, indent="  ")
    yield from residual_lines(table)
    yield from _gates(table.gates, alarms)
    yield from _items("note", table.warnings)


def _coefficients(table: TableCalibration) -> Iterator[str]:
    found = coefficient_rows(table)
    rows = [(r.name, r.symbol + " *" * bool(r.meaning), *r[3:]) for r in found]
    yield from aligned([HEADINGS, *rows], right={2, 3, 5, 6}, indent="  ")
    yield from (f"  * {r.symbol} stands for {r.meaning}" for r in found if r.meaning)


def scale_factor_elsewhere(table: TableCalibration, local_gravity: float | None) -> Iterator[str]:
    """Scale factor in ppm, and per m/s^2 and standard g, which need the local gravity."""
    quantity = table.coefficients["K1"]
    value, expanded = quantity.value, quantity.expanded_uncertainty
    if value is None:
        return
    if expanded is not None:
        yield f"  scale factor known to {significant(expanded / abs(value) * MICRO, 2)} ppm (U)"
    if not local_gravity:
        return
    unit = quantity.unit.removesuffix("/g")
    for factor, per in (
        (1.0 / local_gravity, "per m/s^2"),
        (_STANDARD_GRAVITY / local_gravity, f"per standard g ({_STANDARD_GRAVITY} m/s^2)"),
    ):
        shown = matching_digits(value, expanded, factor)
        yield f"  K1 = {shown[0]} +- {shown[1]} {unit} {per}"


def _mean_of_runs(calibration: Calibration) -> Iterator[str]:
    if calibration.temperature_model is None and len(calibration.tables) > 1:
        from accelcal.compensate.at_temperature import means_of_runs

        for mean in means_of_runs(calibration):
            yield f"Mean of {mean.runs}"
            yield from aligned([LAW_HEADINGS, *rows_of_mean(mean)], right={2, 3}, indent="  ")


def _temperature(calibration: Calibration) -> Iterator[str]:
    for whose, rows in temperature_laws(calibration):
        yield f"Temperature laws{whose}, bilinear about T0 = {calibration.T0_degC:g} degC"
        yield from aligned([LAW_HEADINGS, *rows], right={2, 3}, indent="  ")
    if calibration.temperature_model:
        yield from _items("note", calibration.temperature_model.warnings)


def _fixture_angles(angles: Sequence[FixtureAngle]) -> Iterator[str]:
    """What both sides of an axis tell; the tables above hold M with the angle in it."""
    for found in angles:
        yield f"Fixture angle apart from the misalignment, mountings {reversed_mountings(found)}"
        yield from aligned([LAW_HEADINGS, *fixture_angle_rows(found)], right={2, 3}, indent="  ")


def reversed_mountings(found: FixtureAngle) -> str:
    """Name the mountings that freed a misalignment from the fixture angle."""
    clamped = f", clamped at {found.clamping_deg:g} deg" if found.clamping_deg else ""
    return f"{found.axis}+ and {found.axis}-{clamped}"


def fixture_angle_rows(found: FixtureAngle) -> list[LawRow]:
    """Make the lines of a fixture angle: name, symbol, value, half width of the interval, unit."""
    rows = [("fixture angle", "delta0", *in_microradians(found.angle))]
    places = ["" if t is None else f" at {t:.4g} degC" for t in found.temperatures]
    for where, quantity in zip(places, found.misalignments, strict=True):
        rows.append((f"misalignment{where}", "delta", *in_microradians(quantity)))
    symbol = "delta_ip" if found.axis == "o" else "delta_io"
    for where, quantity in zip(places, found.couplings, strict=False):
        rows.append((f"cross-coupling{where}", symbol, *in_millionths(quantity), "ug/g^2"))
    return rows


def in_microradians(quantity: Quantity) -> tuple[str, str, str]:
    """Tell an angle: value, half width of the 95 % interval, unit."""
    return (*in_millionths(quantity), "urad")


def _effects(calibration: Calibration) -> Iterator[str]:
    if calibration.effects:
        yield "Effects taken out of the readings, with their sizes in this record"
    for effect in calibration.effects:
        gaps = [significant(gap * MICRO) for gap in (effect.gap_before, effect.gap_after)]
        as_found = as_found_of(calibration, effect)
        yield from _item(
            effect.name, f"{sizes_of(effect)}{as_found}; gap {gaps[0]} -> {gaps[1]} ug rms"
        )


def as_found_of(calibration: Calibration, effect: FoundEffect) -> str:
    """Tell of an effect that it has the size that the discovery found, where it has not its own."""
    return ", as the discovery found" if effect.id in calibration.effects_as_found else ""


def sizes_of(effect: FoundEffect) -> str:
    """Tell the parameters of an effect with their half widths."""
    return ", ".join(f"{name} = {sized(size)}" for name, size in effect.parameters.items())


def _errors(calibration: Calibration) -> Iterator[str]:
    if calibration.error_sources:
        yield "Sources of error"
    for name, size in error_rows(calibration):
        yield from hanging(f"{name}: {size}", "  ")


def error_rows(calibration: Calibration) -> Iterator[tuple[str, str]]:
    """Tell each source of error and its size, that of the readings for each table."""
    for table, source in zip(calibration.tables, calibration.reading_noises, strict=False):
        yield f"reading noise, run {table.run}", _size(source) + _in_micro_g(source, table)
    for source in calibration.error_sources:
        if source.name in _COMMON_SOURCES:
            yield _COMMON_SOURCES[source.name], _size(source)


_COMMON_SOURCES = {
    "head": "head position",
    "launch": "bias, launch to launch",
    "launch_sf": "scale factor, launch to launch",
    "temperature": "temperature of a run",
}


def _size(source: ErrorSource) -> str:
    """Tell the size of a source of error, and how it is known."""
    if source.value is None:
        return "unknown"
    dof = _freedom(source)
    if source.value == 0.0 and source.source == "estimated":
        return f"none shows above the reading noise (estimated{dof})"
    factor, unit = readable(source.unit, source.value)
    return f"{significant(factor * source.value)} {plain(unit)} ({source.source}{dof})"


def _freedom(source: ErrorSource) -> str:
    """Tell the degrees of freedom; residuals without any told the head error as well."""
    if source.dof is None:
        return ", together with the head error" if source.source == "residuals" else ""
    return f", {degrees_of_freedom(source.dof)}"


def _in_micro_g(source: ErrorSource, table: TableCalibration) -> str:
    """Tell the noise of a table's readings as an acceleration too."""
    scale_factor = table.coefficients["K1"].value
    if source.value is None or not scale_factor:
        return ""
    return f" = {significant(abs(source.value / scale_factor) * MICRO)} ug"


def _record_gates(gates: Sequence[Gate], alarms: Sequence[str]) -> Iterator[str]:
    lines = list(_gates(gates, alarms))
    yield from ["The record as a whole", *lines] if lines else []


def _gates(gates: Sequence[Gate], alarms: Sequence[str]) -> Iterator[str]:
    told = _BRACKETS.sub("", "\n".join(alarms))
    of: dict[str, list[Gate]] = {}
    for gate in gates:
        above = gate.verdict == "warn" and _BRACKETS.sub("", gate.finding) in told
        of.setdefault("above" if above else gate.verdict, []).append(gate)
    yield from _items("WARNING", map(_finding, of.get("warn", ())))
    for key, said in (("above", "gates that WARN, see above"), ("pass", "gates passed")):
        if key in of:
            yield from hanging(f"{said}: {', '.join(g.name for g in of[key])}", indent="  ")
    yield from _items("not assessed", map(_finding, of.get("not assessed", ())))


_BRACKETS = re.compile(r" \([^()]*\)")
"""Numbers in which warnings of a gate differ that say the same of several tables."""


def _finding(gate: Gate) -> str:
    return f"{gate.name}: {gate.finding}"


def _open(warnings: Sequence[str]) -> Iterator[str]:
    if warnings:
        yield "What these numbers leave open"
    yield from _items("-", warnings)


def _items(mark: str, sentences: Iterable[str]) -> Iterator[str]:
    for sentence in sentences:
        yield from _item(mark, sentence)


def _item(mark: str, sentence: str) -> list[str]:
    mark = mark if mark == "-" else f"{mark}:"
    return hanging(visible(f"{mark} {sentence}"), indent="  ")


Residual = float | None

_LONGEST_ROW = 96
_SUMMARY = ("mean", "forward", "back", "lowest", "highest")


def residual_lines(table: TableCalibration) -> Iterator[str]:
    """Write a grid of positions and strokes; where it is too wide, a summary of each."""
    strokes = sorted(set(table.residuals.stroke))
    largest = max((abs(value) for value in table.residuals.value), default=0.0)
    size, unit = by_size(largest, ACCELERATIONS, 9.9995)  # four digits before the point
    decimals = _decimals(largest / size)

    def shown(value: Residual) -> str:
        return "" if value is None else f"{round(value / size, decimals) + 0.0:.{decimals}f}"

    heading = ["deg", *(f"k={stroke}" for stroke in strokes), "mean"]
    if len("  ".join(heading)) <= _LONGEST_ROW:  # a grid of many strokes is not even written
        lines = list(_grid(heading, residual_grid(table)[1], shown))
        if max(map(len, lines)) <= WIDTH - 2:
            yield f"  residuals [{unit}] by head angle and stroke"
            yield from lines
            return
    yield f"  residuals [{unit}] by head angle, over {len(strokes)} strokes (the JSON has them all)"
    summary = [["deg", *_SUMMARY]]
    for angle, own in residuals_by_angle(table).items():
        summary.append([f"{angle:g}", *map(shown, _summary(own))])
    yield from aligned(summary, right=range(len(summary[0])), indent="  ")


def _grid(
    heading: list[str],
    rows: Sequence[tuple[float, Sequence[Residual]]],
    shown: Callable[[Residual], str],
) -> Iterator[str]:
    """All residuals, a line for each head angle."""
    grid = [heading]
    grid += [[f"{angle:g}", *map(shown, [*values, _mean(values)])] for angle, values in rows]
    if len(heading) == 3:  # of a single stroke there is no mean
        grid = [line[:-1] for line in grid]
    return aligned(grid, right=range(len(grid[0])), indent="  ")


def _decimals(largest: float) -> int:
    """Three digits for the largest residual, and one decimal at most below a thousand."""
    return min(max(1, 2 - math.floor(math.log10(largest))), 6) if 0.0 < largest < 1000.0 else 1


def _mean(values: Sequence[Residual]) -> Residual:
    seen = [value for value in values if value is not None]
    return sum(seen) / len(seen) if seen else None


def _summary(own: Mapping[int, float]) -> list[Residual]:
    one_way = [value for stroke, value in own.items() if stroke % 2 == 1]
    other_way = [value for stroke, value in own.items() if stroke % 2 == 0]
    seen = own.values()
    return [_mean([*seen]), _mean(one_way), _mean(other_way), min(seen), max(seen)]
