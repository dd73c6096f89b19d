"""Results other than a calibration, as a notebook shows them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from accelcal.plural import counted
from accelcal.report.disagreement import run_rows
from accelcal.report.discovery import NOT_SURE, gap_rows
from accelcal.report.findings import factor_cells, p_value
from accelcal.report.html import heading, items, safe, table
from accelcal.report.numbers import matching_digits, significant
from accelcal.report.scale import readable, written
from accelcal.report.stability import HEADING, bound_rows, component_rows, noise_rows
from accelcal.report.stand_discovery import head_rows, title
from accelcal.report.verdict import limit_row, remark
from accelcal.results.quantity import Gate, Quantity
from accelcal.units import MICRO

if TYPE_CHECKING:
    from accelcal.effects.effect import Effect
    from accelcal.record import TumbleRecord
    from accelcal.results.disagreement import Disagreement
    from accelcal.results.discovery import Discovery
    from accelcal.results.error_budget import ErrorBudget
    from accelcal.results.findings import FoundEffect, Share
    from accelcal.results.stability import Stability
    from accelcal.results.stand_discovery import StandDiscovery
    from accelcal.results.unit_history import History

_MOST_ROWS = 60
_INTERVAL = ("value", "U (95 %)", "unit")


def discovery_html(discovery: Discovery) -> str:
    """Write a discovery as HTML tables.

    Parameters
    ----------
    discovery : Discovery
        The discovery.

    Returns
    -------
    str
        A fragment of HTML: effects with their parameters, the gap, where it is, what is open.
    """
    name = discovery.serial or discovery.source
    parts = [heading(f"Discovery in {name}", counted(discovery.readings, "reading"))]
    effects = [
        row
        for effect in discovery.effects
        for row in _effect_rows(effect, sure=effect.id not in discovery.doubtful)
    ]
    headings = ("effect", "parameter", *_INTERVAL, "p", "looks alike")
    parts.append(table("effects", headings, effects))
    if not effects:
        parts.append("<p>no effect is named</p>")
    parts.append(table("gap", *_headed(gap_rows(discovery))))
    if discovery.effects or discovery.unexplained:
        parts.append(_where(discovery.where))
    if discovery.unexplained:
        parts.append(f"<p><b>unexplained</b> {safe(discovery.unexplained.structure)}</p>")
    told = [fault.finding for fault in discovery.faults]
    parts.append(items(map(safe, [*told, discovery.next_measurement or "", *discovery.notes])))
    return "".join(parts).replace("<li></li>", "")


def disagreement_html(found: Disagreement) -> str:
    """Write a comparison as HTML tables.

    Parameters
    ----------
    found : Disagreement
        The comparison.

    Returns
    -------
    str
        A fragment of HTML.
    """
    told = (
        f"rms {_micro(found.rms)} µg",
        f"reduced χ² {found.reduced_chi2:.3g}",
        p_value(found.p_value),
    )
    parts = [heading(f"Comparison of {found.serial or found.source}", *told)]
    parts.append(_where(found.where))
    heads, rows = _headed(run_rows(found))
    caption = "changes since the calibration (95 %)"
    parts += [table(caption, heads, rows[:_MOST_ROWS]), _cut(rows)]
    return "".join([*parts, items(map(safe, filter(None, [found.structure, *found.notes])))])


def stand_html(stand: StandDiscovery) -> str:
    """Write what several units tell of their stand as HTML tables.

    Parameters
    ----------
    stand : StandDiscovery
        What was discovered.

    Returns
    -------
    str
        A fragment of HTML.
    """
    parts = [heading("Stand", counted(len(stand.units), "unit"))]
    rows = [
        (title(stand, effect), effect.verdict, name, *_interval(quantity), p_value(effect.p_value))
        for effect in stand.effects
        for name, quantity in (effect.parameters or {"": Quantity(None, None, "")}).items()
    ]
    parts.append(table("effects", ("effect", "whose", "parameter", *_INTERVAL, "p"), rows))
    head = [(f"{angle:g}°", *shown) for angle, *shown in head_rows(stand)]
    caption = "head positions [µrad]"
    parts += [table(caption, ("angle", *_INTERVAL[:2]), head[:_MOST_ROWS]), _cut(head)]
    return "".join([*parts, items(map(safe, stand.notes))])


def stability_html(result: Stability) -> str:
    """Write a stability test as HTML tables.

    Parameters
    ----------
    result : Stability
        The analysis.

    Returns
    -------
    str
        A fragment of HTML.
    """
    name = result.serial or result.source
    parts = [heading(f"Stability of {name}", counted(len(result.launches), "launch"))]
    for caption, rows in (
        ("random bias", component_rows(result)),
        ("bound (3)", bound_rows(result)),
        ("noise terms", noise_rows(result)),
    ):
        signed = [(*row[:5], written(row[5]), *row[6:]) for row in rows]
        parts.append(table(caption, (*HEADING, ""), signed))
    told = [f"{gate.name}: {gate.finding}" for gate in result.gates if gate.verdict == "warn"]
    return "".join([*parts, items(map(safe, [*told, *result.warnings]))])


_OF_BUDGET = ("value_g", "bound_g", "standard_uncertainty_g", "expanded_uncertainty_g")
_CORRELATED = "errors of the coefficients are correlated and cancel in part, which the total counts"


def budget_html(budget: ErrorBudget) -> str:
    """Write an error budget as an HTML table.

    Parameters
    ----------
    budget : ErrorBudget
        The budget.

    Returns
    -------
    str
        A fragment of HTML.
    """
    name = budget.serial or budget.source
    parts = [heading(f"Error by (4) of {name}", counted(budget.a_i.size, "point"))]
    rows = [
        (
            f"{row['a_i']:g} g",
            "" if row["temperature_degC"] is None else f"{row['temperature_degC']:g} °C",
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
    parts.append(table("errors [µg]", headings, rows[:_MOST_ROWS]))
    said = [_CORRELATED] if budget.correlated else []
    return "".join([*parts, _cut(rows), items(map(safe, [*said, *budget.warnings]))])


def verdict_html(document: Mapping[str, Any]) -> str:
    """Write a verdict as an HTML table.

    Parameters
    ----------
    document : mapping
        Document of a verdict, as of `accelcal.results.verdict.Verdict.to_document`.

    Returns
    -------
    str
        A fragment of HTML.
    """
    limits = document["limits"]
    parts = [heading(f"Verdict against {document['specification']}", document["outcome"].upper())]
    parts.append(table("limits", ("", "", "value", "± U", "limit", ""), map(limit_row, limits)))
    said = [f"{limit['symbol']}: {told}" for limit in limits if (told := remark(limit))]
    rule = f"decision rule: {document['rule_statement']}"
    return "".join([*parts, items(map(safe, [*said, rule]))])


def gate_html(gate: Gate) -> str:
    """Write the outcome of a check as a line of HTML.

    Parameters
    ----------
    gate : Gate
        The outcome.

    Returns
    -------
    str
        A fragment of HTML.
    """
    return f"<p><b>{safe(gate.verdict)}</b> {safe(gate.name)}: {safe(gate.finding)}</p>"


def history_html(history: History) -> str:
    """Write a history as HTML tables.

    Parameters
    ----------
    history : History
        The history.

    Returns
    -------
    str
        A fragment of HTML.
    """
    count = counted(len(history.trends[0].points), "calibration")
    parts = [heading(f"History of {history.serial or 'a unit'}", count)]
    rows = [(trend.name, "drift", "", *_interval(trend.drift)) for trend in history.trends]
    rows += [
        (trend.name, f"jump {j.after} … {j.before}", p_value(j.p_value), *_interval(j.size))
        for trend in history.trends
        for j in trend.jumps
    ]
    parts.append(table("drift and jumps", ("", "", "", *_INTERVAL), rows))
    return "".join([*parts, items(map(safe, history.notes))])


def record_html(record: TumbleRecord) -> str:
    """Write what a record holds as an HTML table.

    Parameters
    ----------
    record : TumbleRecord
        The record.

    Returns
    -------
    str
        A fragment of HTML: a row for each run and mounting.
    """
    name = record.serial or record.source
    parts = [heading(f"Readings of {name}", counted(len(record), "reading"), record.date or "")]
    rows = [_table_row(part) for part in record.tables()]
    unit = f" [{record.unit}]" if record.unit else ""
    headings = ("run", "mounting", "temperature", "readings", "strokes", "angles", f"output{unit}")
    parts.append(table("runs", headings, rows[:_MOST_ROWS]))
    return "".join([*parts, _cut(rows), items(map(safe, record.notes))])


def effect_html(effect: Effect) -> str:
    """Write an effect of the catalogue as an HTML table.

    Parameters
    ----------
    effect : Effect
        The effect.

    Returns
    -------
    str
        A fragment of HTML.
    """
    about = ("physics", "formula", "signature", "to_tell_apart", "acts_on")
    rows = [(name.replace("_", " "), getattr(effect, name)) for name in about]
    parameters = [(p.name, p.unit, p.meaning) for p in effect.parameters]
    told = table("about", ("", ""), rows)
    return f"{heading(effect.name, effect.id)}{told}" + table(
        "parameters", ("name", "unit", "meaning"), parameters
    )


# -- parts -----------------------------------------------------------------------------------------


def _effect_rows(effect: FoundEffect, *, sure: bool) -> Iterator[tuple[str, ...]]:
    shown = effect.name if sure else f"{effect.name} ({NOT_SURE})"
    alike = ", ".join(effect.indistinguishable)
    for number, (name, quantity) in enumerate(effect.parameters.items()):
        first = number == 0
        told = (p_value(effect.p_value), alike) if first else ("", "")
        yield (shown if first else "", name, *_interval(quantity), *told)


def _where(found: Sequence[Share]) -> str:
    return table("where they disagree", *_headed(factor_cells(found)))


def _headed(rows: Sequence[Sequence[str]]) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
    """Take the heading from the rows of a text."""
    return rows[0], rows[1:]


def _interval(quantity: Quantity) -> tuple[str, str, str]:
    """Value, half width of the 95 % interval, unit, in a unit that is easily read."""
    if quantity.value is None:
        return ("not determined" if quantity.unit else "", "", quantity.unit)
    factor, unit = readable(quantity.unit, quantity.value)
    return (*matching_digits(quantity.value, quantity.expanded_uncertainty, factor), unit)


def _table_row(part: TumbleRecord) -> tuple[str, ...]:
    temperature = part.mean_temperature
    return (
        part.run_labels[int(part.run[0])],
        str(part.mounting[0]),
        "" if temperature != temperature else f"{temperature:.2f} °C",  # NaN differs from itself
        str(len(part)),
        str(len(set(part.stroke.tolist()))),
        str(len(set(part.angle.tolist()))),
        f"{part.output.min():.6g} … {part.output.max():.6g}",
    )


def _cut(rows: Sequence[object]) -> str:
    more = len(rows) - _MOST_ROWS
    return f"<p>and {counted(more, 'row')} more; <code>.to_frame()</code> has all</p>" * (more > 0)


def _micro(value: float | None) -> str:
    return "" if value is None else significant(MICRO * value) if value else "0"
