"""Results as a notebook shows them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import singledispatch
from typing import TYPE_CHECKING

from accelcal.compensate.at_temperature import means_of_runs
from accelcal.plural import counted
from accelcal.report.calibration import fixture_angle_rows, reversed_mountings
from accelcal.report.calibration_comparison import HEADINGS as COMPARISON_HEADINGS
from accelcal.report.calibration_comparison import rows_of, shown_changes
from accelcal.report.calibration_rows import (
    HEADINGS,
    LAW_HEADINGS,
    coefficient_rows,
    grouped_alarms,
    rows_of_mean,
    temperature_laws,
    without_uncertainty,
)
from accelcal.report.disagreement import run_rows, shape_rows
from accelcal.report.discovery import (
    CHANGE_HEADINGS,
    NOT_SURE,
    change_row,
    gap_rows,
    other_values,
    outcome,
)
from accelcal.report.findings import chance, factor_rows, p_value
from accelcal.report.html import items, long_table, preformatted, result, safe, table
from accelcal.report.numbers import is_number_of, matching_digits, significant
from accelcal.report.stability import HEADING, bound_rows, component_rows, noise_rows
from accelcal.report.stand_discovery import head_rows, title
from accelcal.report.verdict import limit_row, remark
from accelcal.results.calibration import Calibration
from accelcal.results.calibration_comparison import CalibrationComparison
from accelcal.results.disagreement import Disagreement
from accelcal.results.discovery import Discovery
from accelcal.results.error_budget import ErrorBudget
from accelcal.results.quantity import Gate, Quantity
from accelcal.results.stability import Stability
from accelcal.results.stand_discovery import StandDiscovery
from accelcal.results.table import TableCalibration
from accelcal.results.unit_history import History
from accelcal.results.verdict import Verdict
from accelcal.shown_units import plain, readable
from accelcal.units import MICRO

if TYPE_CHECKING:
    from accelcal.effects.effect import Effect
    from accelcal.record import TumbleRecord
    from accelcal.results.findings import FoundEffect, Share


@singledispatch
def in_notebook(found: object) -> str:
    """Write a result as its text, or in the way that is registered for its kind below."""
    return preformatted(str(found))


@in_notebook.register
def calibration_html(calibration: Calibration) -> str:
    """Write a calibration as tables, without scripts and styles of its own."""
    warned = [*without_uncertainty(calibration), *grouped_alarms(calibration)]
    parts = [items(f"<b>WARNING</b> {safe(sentence)}" for sentence in warned)]
    parts += [table_html(found) for found in calibration.tables]
    for mean in means_of_runs(calibration):
        parts.append(table(f"mean of {mean.runs}", LAW_HEADINGS, rows_of_mean(mean)))
    for whose, rows in temperature_laws(calibration):
        caption = f"temperature laws{whose}, T0 = {calibration.T0_degC:g} degC"
        parts.append(table(caption, LAW_HEADINGS, rows))
    for found in calibration.fixture_angle:
        caption = f"fixture angle apart from the misalignment, {reversed_mountings(found)}"
        parts.append(table(caption, LAW_HEADINGS, fixture_angle_rows(found)))
    told = [warning for found in calibration.tables for warning in found.warnings]
    if calibration.temperature_model:
        told += calibration.temperature_model.warnings
    parts.append(items(map(safe, [*told, *calibration.warnings])))
    if calibration.verdict is not None:
        parts.append(verdict_html(calibration.verdict))
    return result(
        f"Calibration of {calibration.serial or calibration.source}", [calibration.method], *parts
    )


def table_html(found: TableCalibration) -> str:
    """Write one table of a calibration."""
    temperature = found.temperature_degC
    where = "" if temperature is None else f", {temperature:.2f} degC"
    caption = f"run {found.run}{where}, mounting {found.mounting}"
    rows = [(r.name, r.meaning or r.symbol, *r[3:]) for r in coefficient_rows(found)]
    return table(caption, HEADINGS, rows)


_INTERVAL = ("value", "U (95 %)", "unit")


@in_notebook.register
def discovery_html(discovery: Discovery) -> str:
    """Write the verdict, effects with their parameters, the gap, where it is, and what is open."""
    effects = [
        row
        for effect in discovery.effects
        for row in _effect_rows(effect, sure=effect.id not in discovery.doubtful)
    ]
    headings = ("effect", "parameter", *_INTERVAL, "p", "looks alike")
    parts = [f"<p>{safe(outcome(discovery, chance(discovery.p_value)))}</p>"]
    parts.append(table("effects", headings, effects))
    parts.append(table("gap", *_headed(gap_rows(discovery))))
    if discovery.effects or discovery.unexplained:
        parts.append(_where(discovery.where))
    if discovery.effects:
        changes = [change_row(item) for item in discovery.coefficients]
        parts.append(table("coefficients over K1", ("", *CHANGE_HEADINGS, "unit"), changes))
    if discovery.unexplained:
        parts.append(f"<p><b>unexplained</b> {safe(discovery.unexplained.structure)}</p>")
    faults = [fault.finding for fault in discovery.faults]
    return result(
        f"Discovery in {discovery.serial or discovery.source}",
        [counted(discovery.readings, "reading")],
        *parts,
        notes=[*faults, discovery.next_measurement, *discovery.notes],
    )


@in_notebook.register
def disagreement_html(found: Disagreement) -> str:
    """Write where a comparison found differences, and what has changed run by run."""
    gap = significant(MICRO * found.rms) if found.rms else "0"
    rms, chi2 = f"rms {gap} ug", f"reduced chi^2 {found.reduced_chi2:.3g}"
    rows = shape_rows(found)
    return result(
        f"Comparison of {found.serial or found.source}",
        [found.verdict, p_value(found.p_value), rms, chi2],
        _where(found.where) if found.structure else "",
        long_table("changes since the calibration (95 %)", *_headed(run_rows(found))),
        long_table("changes of the shape (95 %)", *_headed(rows)) if rows else "",
        notes=[found.structure, *found.notes],
    )


@in_notebook.register
def comparison_html(found: CalibrationComparison) -> str:
    """Write two calibrations coefficient by coefficient."""
    return result(
        f"Two calibrations of {found.serial or found.new.source}",
        [found.verdict, p_value(found.p_value)],
        long_table("new less old (95 %)", COMPARISON_HEADINGS, rows_of(shown_changes(found))),
        notes=found.notes,
    )


@in_notebook.register
def stand_html(stand: StandDiscovery) -> str:
    """Write what several units tell of their stand."""
    rows = [
        (title(stand, effect), effect.verdict, name, *_interval(quantity), p_value(effect.p_value))
        for effect in stand.effects
        for name, quantity in (effect.parameters or {"": Quantity(None, None, "")}).items()
    ]
    head = [(f"{angle:g}", *shown) for angle, *shown in head_rows(stand)]
    return result(
        "Stand",
        [counted(len(stand.units), "unit")],
        table("effects", ("effect", "whose", "parameter", *_INTERVAL, "p"), rows),
        long_table("head positions [urad]", ("angle [deg]", *_INTERVAL[:2]), head),
        notes=stand.notes,
    )


@in_notebook.register
def stability_html(found: Stability) -> str:
    """Write the components of a random bias, its bound and the noise terms."""
    tables = {
        "random bias": component_rows(found),
        "bound (3)": bound_rows(found),
        "noise terms": noise_rows(found),
    }
    warned = [f"{gate.name}: {gate.finding}" for gate in found.gates if gate.verdict == "warn"]
    return result(
        f"Stability of {found.serial or found.source}",
        [counted(len(found.launches), "launch")],
        *(table(caption, (*HEADING, ""), rows) for caption, rows in tables.items()),
        notes=[*warned, *found.warnings],
    )


_OF_BUDGET = ("value_g", "bound_g", "standard_uncertainty_g", "expanded_uncertainty_g")
_CORRELATED = "errors of the coefficients are correlated and cancel in part, which the total counts"


@in_notebook.register
def budget_html(budget: ErrorBudget) -> str:
    """Write the errors of all points, component by component."""
    rows = [
        (
            f"{row['a_i']:g} g",
            "" if row["temperature_degC"] is None else f"{row['temperature_degC']:g} degC",
            f"{row['time_s']:g} s",
            row["component"],
            *(f"{MICRO * row[key]:.1f}" for key in _OF_BUDGET[:2]),
            *(
                "" if row[key] is None else significant(MICRO * row[key], 2)
                for key in _OF_BUDGET[2:]
            ),
        )
        for row in budget.rows()
        if any(row[key] for key in _OF_BUDGET)
    ]
    headings = ("a_i", "temperature", "time", "component", "error", "bound of (4)", "u", "U (95 %)")
    return result(
        f"Error by (4) of {budget.serial or budget.source}",
        [counted(budget.a_i.size, "point")],
        long_table("errors [ug]", headings, rows),
        notes=[_CORRELATED if budget.correlated else "", *budget.warnings],
    )


@in_notebook.register
def verdict_html(verdict: Verdict) -> str:
    """Write a verdict, limit by limit."""
    limits = verdict.judgements
    said = [f"{limit.symbol}: {told}" for limit in limits if (told := remark(limit))]
    return result(
        f"Verdict against {verdict.specification}",
        [verdict.outcome.upper()],
        table("limits", ("", "", "value", "+- U", "limit", ""), map(limit_row, limits)),
        notes=[*said, *verdict.notes, f"decision rule: {verdict.rule_statement}"],
    )


def gate_html(gate: Gate) -> str:
    """Write the outcome of a check as a line."""
    return f"<p><b>{safe(gate.verdict)}</b> {safe(gate.name)}: {safe(gate.finding)}</p>"


@in_notebook.register
def history_html(history: History) -> str:
    """Write the drift and the jumps of a unit."""
    drifts = [
        (trend.name, name, drift)
        for trend in history.trends
        for name, drift in (
            ("drift if it may wander", trend.drift_of_a_walk),
            ("drift if it does not wander", trend.drift),
        )
    ]
    rows = [(of, name, "", *_interval(drift)) for of, name, drift in drifts if drift is not None]
    rows += [
        (trend.name, f"jump {j.after} … {j.before}", p_value(j.p_value), *_interval(j.size))
        for trend in history.trends
        for j in trend.jumps
    ]
    return result(
        f"History of {history.serial or 'a unit'}",
        [counted(len(history.trends[0].points), "calibration")],
        table("drift and jumps", ("", "", "", *_INTERVAL), rows),
        notes=history.notes,
    )


def record_html(record: TumbleRecord) -> str:
    """Write what a record holds, a row for each run and mounting."""
    rows = [_table_row(part) for part in record.tables()]
    unit = f" [{record.unit}]" if record.unit else ""
    headings = ("run", "mounting", "temperature", "readings", "strokes", "angles", f"output{unit}")
    return result(
        f"Readings of {record.serial or record.source}",
        [counted(len(record), "reading"), record.date or ""],
        long_table("runs", headings, rows),
        notes=record.notes,
    )


def effect_html(effect: Effect) -> str:
    """Write what an effect of the catalogue is."""
    about = ("physics", "formula", "signature", "to_tell_apart", "acts_on")
    rows = [(name.replace("_", " "), getattr(effect, name)) for name in about]
    parameters = [(p.name, p.unit, p.meaning) for p in effect.parameters]
    return result(
        effect.name,
        [effect.id],
        table("about", ("", ""), rows),
        table("parameters", ("name", "unit", "meaning"), parameters),
    )


# -- parts -----------------------------------------------------------------------------------------


def _effect_rows(effect: FoundEffect, *, sure: bool) -> Iterator[tuple[str, ...]]:
    shown = effect.name if sure else f"{effect.name} ({NOT_SURE})"
    alike = ", ".join(effect.indistinguishable)
    for number, (name, quantity) in enumerate(effect.parameters.items()):
        first = number == 0
        told = (p_value(effect.p_value), alike) if first else ("", other_values(effect, name))
        yield (shown if first else "", name, *_interval(quantity), *told)


def _where(found: Sequence[Share]) -> str:
    return table("where they disagree", *_headed(factor_rows(found)))


def _headed(rows: Sequence[Sequence[str]]) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
    return rows[0], rows[1:]


def _interval(quantity: Quantity) -> tuple[str, str, str]:
    """Value, half width of the 95 % interval, unit, in a unit that is easily read."""
    if quantity.value is None:
        return ("not determined" if quantity.unit else "", "", quantity.unit)
    if is_number_of(quantity):
        return (f"{quantity.value:g}", "", "")
    factor, unit = readable(quantity.unit, quantity.value)
    return (*matching_digits(quantity.value, quantity.expanded_uncertainty, factor), plain(unit))


def _table_row(part: TumbleRecord) -> tuple[str, ...]:
    temperature = part.mean_temperature
    return (
        part.run_labels[int(part.run[0])],
        str(part.mounting[0]),
        "" if temperature != temperature else f"{temperature:.2f} degC",  # NaN differs from itself
        str(len(part)),
        str(len(set(part.stroke.tolist()))),
        str(part.head_angles.size),
        f"{part.output.min():.6g} … {part.output.max():.6g}",
    )
