"""Sections of a report on why to believe it: verdict, residuals, budget, checks, provenance."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from accelcal.apparatus import UNITS
from accelcal.page.blocks import (
    Block,
    Bullets,
    Facts,
    Figure,
    Gallery,
    Paragraph,
    Section,
    Table,
    Tone,
    narrowed,
)
from accelcal.page.pictures import picture
from accelcal.report.calibration import error_rows
from accelcal.report.calibration_rows import residuals_by_angle, table_title
from accelcal.report.numbers import significant
from accelcal.report.typeset import typeset
from accelcal.report.verdict import limit_row, remark
from accelcal.results.calibration import Calibration
from accelcal.results.quantity import Gate
from accelcal.results.table import TableCalibration
from accelcal.results.tables_in_use import tables_in_use
from accelcal.units import MICRO

_OUTCOMES: dict[str, Tone] = {"PASS": "good", "FAIL": "bad", "undecided": "warn"}
_CHECKS: dict[str, Tone] = {"pass": "good", "WARN": "warn"}
_SHOWN = {"warn": "WARN", "pass": "pass"}
_NAMES = {"reading": "readings", "launch": "launches", "launch_sf": "launches (scale factor)"}
_NOT_RECORDED = "not recorded"
_NO_GRAVITY = "not given; g is local g"


def place(table: TableCalibration) -> str:
    """Name a table by its run, temperature and mounting."""
    temperature = table.temperature_degC
    where = "" if temperature is None else f", {temperature:.4g} degC"
    return f"run {table.run}{typeset(where)}, mounting {table.mounting}"


def verdict(calibration: Calibration) -> Section | None:
    """Tell the verdict against a data sheet; None where it was not judged."""
    found = calibration.verdict
    if found is None:
        return None
    rows = []
    for limit in found.judgements:
        outcome, symbol, value, expanded, allowed, name = limit_row(limit)
        said = "" if outcome in ("PASS", "FAIL") and not limit.remark else remark(limit)
        row = (name, outcome, symbol, value, expanded, allowed, said)
        rows.append(tuple(map(typeset, row)))
    headings = ("limit", "outcome", "symbol", "value", "U (95 %)", "allowed", "remark")
    source = f" ({found.source})" if found.source else ""
    blocks: list[Block] = [
        Table(f"Limits of {found.specification}", headings, rows, (3, 4), _OUTCOMES),
        *(Paragraph(f"Note: {typeset(note)}.") for note in found.notes),
        Paragraph(f"Decision rule: {typeset(found.rule_statement)}"),
        Paragraph(f"Data sheet: {found.specification}{source}."),
    ]
    return Section("Verdict against the data sheet", blocks)


def residuals(calibration: Calibration, name: str) -> Section | None:
    """Show what the model leaves of the readings; None where the document has no residuals."""
    tables = [table for table in calibration.tables if table.residuals.value]
    if not tables:
        return None
    if not any(table.dof for table in tables):
        said = "There are none: as many coefficients were fitted as there are readings."
        return Section("Residuals", [Paragraph(said)])
    rms = [table.residual_rms / abs(table.coefficients["K1"].value or 1.0) for table in tables]
    told = " to ".join(f"{significant(MICRO * size)}" for size in sorted({min(rms), max(rms)}))
    intro = f"Reading minus model; its rms over the degrees of freedom is {told} µg."
    blocks: list[Block] = [Paragraph(intro), Gallery(_residual_pictures(calibration, name, tables))]
    blocks += [part for table in tables for part in _residual_tables(table)]
    return Section("Residuals", blocks)


def _residual_pictures(
    calibration: Calibration, name: str, tables: list[TableCalibration]
) -> list[Figure]:
    plot = calibration.plot
    strokes = sum(len(set(table.residuals.stroke)) for table in tables)
    size = (3.8, 3.0) if strokes <= _NARROW else (7.6, 3.3)
    return [
        picture(f"{name}map", plot.residual_map, _OF_MAP, size),
        picture(f"{name}tumble", plot.tumble, _OF_TUMBLE, (3.8, 3.6), polar=True),
        picture(f"{name}angles", plot.residuals, _OF_ANGLES, (3.8, 3.0)),
    ]


_OF_MAP = (
    "Residuals by head angle and stroke.",
    "Heat map of reading minus model; the tables below have the numbers.",
)
_OF_TUMBLE = (
    "Residuals round the turn, the mean of each angle with its 95 % band; the bold circle is zero.",
    "Polar picture of reading minus model, forward and back strokes apart.",
)
_OF_ANGLES = (
    "Each residual by head angle; bars are the means of forward and back strokes with 95 %"
    " intervals.",
    "Reading minus model against the head angle, forward and back strokes apart.",
)


_NARROW = 60
"""Strokes that a narrow heat map can hold."""


_MOST_COLUMNS = 10
"""Strokes for which paper is wide enough."""


def _residual_tables(table: TableCalibration) -> Iterator[Table]:
    """All residuals, some strokes at a time, at the angles that these have."""
    strokes = sorted(set(table.residuals.stroke))
    part = {stroke: i // _MOST_COLUMNS for i, stroke in enumerate(strokes)}
    rows: list[dict[float, dict[int, float]]] = [{} for _ in strokes[::_MOST_COLUMNS] or [0]]
    for angle, own in residuals_by_angle(table).items():
        for stroke, value in own.items():
            rows[part[stroke]].setdefault(angle, {})[stroke] = value
    caption = f"Residuals [µg], {place(table)}"
    for i, found in enumerate(rows):
        some = strokes[i * _MOST_COLUMNS : (i + 1) * _MOST_COLUMNS]
        headings = ("angle", *(f"stroke {k}" for k in some))
        cells = [
            (f"{angle:g}°", *(_cell(own.get(k)) for k in some)) for angle, own in found.items()
        ]
        named = f"{caption}, stroke {some[0]} to stroke {some[-1]}" if len(rows) > 1 else caption
        yield Table(named, headings, cells, range(len(headings)), folded=True)


def _cell(value: float | None) -> str:
    return "" if value is None else typeset(f"{round(MICRO * value, 1) + 0.0:.1f}")


def budget(calibration: Calibration, name: str) -> Section:
    """Tell the sources of error, and the share of each in each coefficient."""
    headings = ("source of error", "standard uncertainty")
    known = [(name, typeset(size)) for name, size in error_rows(calibration)]
    sources = Table("Sources of error", headings, known or [("none", _NOT_RECORDED)])
    blocks: list[Block] = [sources]
    if any(table.budget for table in calibration.tables):
        shown = table_title(tables_in_use(calibration).main)
        caption = f"Shares of the variance of each coefficient by source of error, {shown}."
        seen = "Stacked bars of the shares; the tables below have the numbers."
        drawn = picture(f"{name}budget", calibration.plot.budget, (caption, seen), (3.8, 3.2))
        blocks = [Gallery([drawn, sources])]
    blocks += [_shares(table) for table in calibration.tables if table.budget]
    return Section("Uncertainty budget", blocks)


def _shares(table: TableCalibration) -> Table:
    parts = table.budget
    sources = list(dict.fromkeys(source for own in parts.values() for source in own))
    rows = []
    for name, own in parts.items():
        total = sum(size**2 for size in own.values())
        shares = [own.get(source, 0.0) ** 2 / total if total > 0.0 else 0.0 for source in sources]
        rows.append((typeset(name), *(f"{100.0 * share:.0f} %" for share in shares)))
    caption = f"Shares of the variance, {place(table)}"
    headings = ("coefficient", *(_NAMES.get(source, source) for source in sources))
    return Table(caption, headings, rows, range(1, len(headings)), folded=True)


def checks(calibration: Calibration) -> Section:
    """Tell what the gates found: a row a gate, a column a table; then what they warn of."""
    columns = [(table_title(table), table.gates) for table in calibration.tables]
    if calibration.gates:
        columns.append(("all", calibration.gates))
    names = list(dict.fromkeys(gate.name for _, gates in columns for gate in gates))
    if not names:
        return Section("Checks", [Paragraph("No check was made.")])
    rows = [(name, *(_outcome(name, gates) for _, gates in columns)) for name in names]
    headings = ("check", *(title for title, _ in columns))
    intro = "Each check warns by chance in at most 1 % of good records."
    blocks: list[Block] = [
        Paragraph(intro),
        *narrowed(Table("Outcomes", headings, rows, tones=_CHECKS), 8),
    ]
    warned = list(_findings(columns, ("warn",)))
    if warned:
        blocks.append(Bullets(warned))
    skipped = [(item,) for item in _findings(columns, ("not assessed",))]
    if skipped:
        blocks.append(Table("Checks that could not be made", ("why",), skipped, folded=True))
    return Section("Checks", blocks)


def _outcome(name: str, gates: Iterable[Gate]) -> str:
    found = [gate.verdict for gate in gates if gate.name == name]
    return _SHOWN.get(found[0], "not made") if found else "–"


def _findings(
    columns: Iterable[tuple[str, Iterable[Gate]]], verdicts: tuple[str, ...]
) -> Iterable[str]:
    """What some gates found, once where several tables say the same."""
    where: dict[str, list[str]] = {}
    for title, gates in columns:
        for gate in gates:
            if gate.verdict in verdicts:
                where.setdefault(f"{gate.name}: {gate.finding}", []).append(title)
    return (f"{typeset(finding)} ({', '.join(titles)})" for finding, titles in where.items())


def open_questions(calibration: Calibration) -> Section:
    """Tell what was not determined, what stands for something else, what was taken as given."""
    items = list(calibration.warnings)
    for table in calibration.tables:
        missing = [n for n, q in table.coefficients.items() if q.value is None]
        if missing:
            items.append(f"run {table.run}: {', '.join(missing)} not determined, taken as zero")
        for name, meaning in table.stands_for.items():
            items.append(
                f"run {table.run}: {name} cannot be told from others at these angles; it stands"
                f" for {meaning}"
            )
    if calibration.delta0_rad:
        given = significant(MICRO * calibration.delta0_rad, 4)
        items.append(f"a fixture angle of {given} urad was taken as given")
    said = [typeset(item) for item in dict.fromkeys(items)]
    title = "What these readings cannot tell"
    return Section(title, [Bullets(said) if said else Paragraph("Nothing is left open.")])


def provenance(calibration: Calibration) -> Section:
    """Tell input, options and software; ``not recorded`` where the document does not say."""
    known = calibration.provenance
    gravity, reference = calibration.g_local_m_s2, calibration.T0_degC
    items = [
        ("serial number", calibration.serial or _NOT_RECORDED),
        ("date of the test", calibration.date or _NOT_RECORDED),
        ("input", calibration.source),
        ("SHA-256 of the input", known.get("sha256") or _NOT_RECORDED),
        ("readings", f"{sum(table.readings for table in calibration.tables)}"),
        ("method", calibration.method + (", robust" if calibration.robust else "")),
        ("reference temperature", _NOT_RECORDED if reference is None else f"{reference:g} °C"),
        ("local gravity", f"{gravity!r} m/s², taken as exact" if gravity else _NO_GRAVITY),
        ("unit of the output", calibration.output_unit or _NOT_RECORDED),
        ("declared", _declared(calibration) if known else _NOT_RECORDED),
        ("options", _listed(known.get("options")) if known else _NOT_RECORDED),
        *((f"header: {name}", str(value)) for name, value in known.get("metadata", {}).items()),
        ("software", calibration.software or _NOT_RECORDED),
    ]
    blocks: list[Block] = [Facts(items)]
    if known.get("notes"):
        blocks.append(Bullets([str(note) for note in known["notes"]]))
    return Section("Provenance", blocks)


def _declared(calibration: Calibration) -> str:
    output = calibration.output_unit or "output units"
    values = calibration.provenance.get("declared") or {}
    said = {name: f"{value:g} {UNITS.get(name, output)}" for name, value in values.items()}
    return typeset(_listed(said))


def _listed(options: Mapping[str, Any] | None) -> str:
    shown = {
        name: ",".join(map(str, value)) if isinstance(value, list | tuple) else value
        for name, value in (options or {}).items()
        if value not in (None, False)
    }
    return "; ".join(f"{name} = {value}" for name, value in shown.items()) or "nothing"
