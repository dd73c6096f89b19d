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
from accelcal.results.levels import nearest_level
from accelcal.results.quantity import Document

_HIGHLIGHTED = ("K1", "k0", "delta")
_UNITS = {"1": ""}


def calibration_chapter(calibration: Calibration, name: str) -> Chapter:
    """Make the report of a calibration; `name` sets its pictures apart on a page of several."""
    document = calibration.to_document()
    tone, outcome = _outcome(document)
    sections = (
        _warnings(document),
        evidence.verdict(document),
        coefficients.coefficients(document),
        coefficients.temperature(calibration, document, name),
        coefficients.fixture_angles(document),
        coefficients.effects(document),
        evidence.residuals(calibration, document, name),
        evidence.budget(calibration, document, name),
        evidence.checks(document),
        evidence.open_questions(document),
        evidence.provenance(document),
    )
    return Chapter(
        sort="Calibration",
        title=str(document["serial"] or PurePath(document["source"]).name),
        subtitle=_subtitle(document),
        tone=tone,
        outcome=outcome,
        lede=_lede(document),
        highlights=list(_highlights(document)),
        sections=[section for section in sections if section is not None],
    )


def _subtitle(document: Document) -> str:
    date = f"tested {document['date']}, " if document["date"] else ""
    return f"{date}from {document['source']}"


def _outcome(document: Document) -> tuple[Tone, str]:
    """How it came out: the verdict, or else what the checks say."""
    verdict = document.get("verdict")
    warned = bool(alarms(document))
    bare = bool(without_uncertainty(document))
    if verdict and verdict["outcome"] == "fail":
        return "bad", "fails its data sheet"
    if warned:
        return "warn", "checks warn"
    if bare:
        return "warn", "no uncertainty"
    if verdict and verdict["outcome"] == "pass":
        return "good", "keeps its data sheet"
    if verdict:
        return "warn", "data sheet: some limits open"
    return ("plain" if _not_made(document) else "good"), "no check warns"


def _lede(document: Document) -> str:
    table = _main_table(document)
    rows = {row.symbol: row for row in coefficient_rows(table)}
    k1, k0 = rows["K1"], rows["k0"]
    temperature = table["temperature_degC"]
    where = "" if temperature is None else f" at {temperature:.4g} degC"
    told = f"Scale factor {_with(k1)} and bias {_with(k0)}{where}"
    readings = counted(sum(t["readings"] for t in document["tables"]), "reading")
    told += f", from {readings} in {counted(len(document['tables']), 'table')}. "
    return typeset(told) + _said_of_verdict(document) + _said_of_checks(document)


def _with(row: Any) -> str:
    if row.value == "not determined":
        return "not determined"
    told = f"{row.value} +- {row.expanded} {row.unit}" if row.expanded else row.value
    return f"{told} (which is {row.meaning})" if row.meaning else told


def _said_of_verdict(document: Document) -> str:
    verdict = document.get("verdict")
    if not verdict:
        return ""
    failed = [limit["limit"] for limit in verdict["limits"] if limit["outcome"] == "fail"]
    names = ", ".join(dict.fromkeys(name.replace("_", " ") for name in failed))
    of = verdict["specification"]
    if failed:
        return f"It fails the data sheet {of} in {names}. "
    open_ = [limit for limit in verdict["limits"] if limit["outcome"] != "pass"]
    if open_:
        return (
            f"It breaks no limit of {of}, but {len(open_)} of {len(verdict['limits'])} are open. "
        )
    return f"It keeps all limits of {of}. "


def _said_of_checks(document: Document) -> str:
    warned = len(alarms(document))
    if warned:
        return f"{counted(warned, 'check').capitalize()} warn{'s' if warned == 1 else ''}."
    skipped = _not_made(document)
    return f"No check warns; {skipped} could not be made." if skipped else "No check warns."


def _not_made(document: Document) -> int:
    """How many checks could not be made, of all tables and of the record as a whole."""
    gates = [gate for table in document["tables"] for gate in table["gates"]]
    return sum(gate["verdict"] not in ("pass", "warn") for gate in (*gates, *document["gates"]))


def _main_table(document: Document) -> Document:
    """The table nearest to the reference temperature."""
    levels = [table["temperature_degC"] for table in document["tables"]]
    nearest: Document = document["tables"][nearest_level(levels, document["T0_degC"])]
    return nearest


def _highlights(document: Document) -> Iterator[Highlight]:
    table = _main_table(document)
    free = _free_misalignment(document, table)
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


def _free_misalignment(document: Document, table: Document) -> Document | None:
    """The misalignment free of the fixture angle at the level of a table, where it is known."""
    for found in document.get("fixture_angle", ()):
        for level in found["misalignment"]:
            near = level["temperature_degC"] == table["temperature_degC"]
            if found["axis"] == table["mounting"][0] and near:
                known: Document = level
                return known
    return None


def _warnings(document: Document) -> Section | None:
    blocks: list[Block] = []
    bare, warned = without_uncertainty(document), alarms(document)
    if bare:
        blocks.append(Note("bad", "No uncertainty", [typeset(item) for item in bare]))
    if warned:
        blocks.append(Note("warn", "Clear these up first", [typeset(item) for item in warned]))
    return Section("Before you use these numbers", blocks) if blocks else None
