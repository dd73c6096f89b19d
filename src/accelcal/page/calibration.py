"""The report of a calibration."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import PurePath
from typing import Any

from accelcal.page import coefficients, evidence
from accelcal.page.blocks import Block, Chapter, Highlight, Note, Section, Tone
from accelcal.page.typeset import typeset
from accelcal.plural import counted
from accelcal.report.calibration import in_microradians
from accelcal.report.calibration_rows import alarms, coefficient_rows, without_uncertainty
from accelcal.results.calibration import Calibration
from accelcal.results.quantity import Quantity
from accelcal.results.table import TableCalibration, nearest_table

_HIGHLIGHTED = ("K1", "k0", "delta")
_UNITS = {"1": ""}


def calibration_chapter(calibration: Calibration, name: str) -> Chapter:
    """Make the report of a calibration; `name` sets its pictures apart on a page of several."""
    tone, outcome = _outcome(calibration)
    date = f"tested {calibration.date}, " if calibration.date else ""
    sections = (
        _warnings(calibration),
        evidence.verdict(calibration),
        coefficients.coefficients(calibration),
        coefficients.temperature(calibration, name),
        coefficients.fixture_angles(calibration),
        coefficients.effects(calibration),
        evidence.residuals(calibration, name),
        evidence.budget(calibration, name),
        evidence.checks(calibration),
        evidence.open_questions(calibration),
        evidence.provenance(calibration),
    )
    return Chapter(
        sort="Calibration",
        title=str(calibration.serial or PurePath(calibration.source).name),
        subtitle=f"{date}from {calibration.source}",
        tone=tone,
        outcome=outcome,
        lede=_lede(calibration),
        highlights=list(_highlights(calibration)),
        sections=[section for section in sections if section is not None],
    )


def _outcome(calibration: Calibration) -> tuple[Tone, str]:
    """How it came out: the verdict, or else what the checks say."""
    verdict = calibration.verdict
    warned = bool(alarms(calibration))
    bare = bool(without_uncertainty(calibration))
    if verdict is not None and verdict.outcome == "fail":
        return "bad", "fails its data sheet"
    if warned:
        return "warn", "checks warn"
    if bare:
        return "warn", "no uncertainty"
    if verdict is not None and verdict.outcome == "pass":
        return "good", "keeps its data sheet"
    if verdict is not None:
        return "warn", "data sheet: some limits open"
    return ("plain" if _not_made(calibration) else "good"), "no check warns"


def _lede(calibration: Calibration) -> str:
    table = nearest_table(calibration.tables, calibration.T0_degC)
    rows = {row.symbol: row for row in coefficient_rows(table)}
    k1, k0 = rows["K1"], rows["k0"]
    temperature = table.temperature_degC
    where = "" if temperature is None else f" at {temperature:.4g} degC"
    told = f"Scale factor {_with(k1)} and bias {_with(k0)}{where}"
    readings = counted(sum(t.readings for t in calibration.tables), "reading")
    told += f", from {readings} in {counted(len(calibration.tables), 'table')}. "
    return typeset(told) + _said_of_verdict(calibration) + _said_of_checks(calibration)


def _with(row: Any) -> str:
    if row.value == "not determined":
        return "not determined"
    told = f"{row.value} +- {row.expanded} {row.unit}" if row.expanded else row.value
    return f"{told} (which is {row.meaning})" if row.meaning else told


def _said_of_verdict(calibration: Calibration) -> str:
    verdict = calibration.verdict
    if verdict is None:
        return ""
    failed = [limit.limit for limit in verdict.judgements if limit.outcome == "fail"]
    names = ", ".join(dict.fromkeys(name.replace("_", " ") for name in failed))
    of = verdict.specification
    if failed:
        return f"It fails the data sheet {of} in {names}. "
    open_ = [limit for limit in verdict.judgements if limit.outcome != "pass"]
    if open_:
        return (
            f"It breaks no limit of {of}, but {len(open_)} of {len(verdict.judgements)} are open. "
        )
    return f"It keeps all limits of {of}. "


def _said_of_checks(calibration: Calibration) -> str:
    warned = len(alarms(calibration))
    if warned:
        return f"{counted(warned, 'check').capitalize()} warn{'s' if warned == 1 else ''}."
    skipped = _not_made(calibration)
    return f"No check warns; {skipped} could not be made." if skipped else "No check warns."


def _not_made(calibration: Calibration) -> int:
    """How many checks could not be made, of all tables and of the record as a whole."""
    gates = [gate for table in calibration.tables for gate in table.gates]
    return sum(gate.verdict not in ("pass", "warn") for gate in (*gates, *calibration.gates))


def _highlights(calibration: Calibration) -> Iterator[Highlight]:
    table = nearest_table(calibration.tables, calibration.T0_degC)
    free = _free_misalignment(calibration, table)
    for row in coefficient_rows(table):
        if row.symbol not in _HIGHLIGHTED or row.value == "not determined":
            continue
        if row.symbol == "delta" and free is not None:
            value, expanded, unit = in_microradians(free)
            row = row._replace(value=value, expanded=expanded, unit=unit)
        unit = _UNITS.get(row.unit, row.unit)
        known = row.expanded not in ("", "unknown")
        detail = f"± {typeset(row.expanded)} (95 %)" if known else "uncertainty unknown"
        symbol = typeset(row.meaning or row.symbol)
        yield Highlight(f"{row.name} {symbol}", typeset(f"{row.value} {unit}"), detail)


def _free_misalignment(calibration: Calibration, table: TableCalibration) -> Quantity | None:
    """The misalignment of a table free of the fixture angle, where it is known."""
    found = calibration.misalignment(table)
    return None if found is table.error_model["delta"] else found


def _warnings(calibration: Calibration) -> Section | None:
    blocks: list[Block] = []
    bare, warned = without_uncertainty(calibration), alarms(calibration)
    if bare:
        blocks.append(Note("bad", "No uncertainty", [typeset(item) for item in bare]))
    if warned:
        blocks.append(Note("warn", "Clear these up first", [typeset(item) for item in warned]))
    return Section("Before you use these numbers", blocks) if blocks else None
