"""A calibration as a notebook shows it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from accelcal.report.calibration import fixture_angle_rows, reversed_mountings
from accelcal.report.calibration_rows import (
    HEADINGS,
    LAW_HEADINGS,
    alarms,
    coefficient_rows,
    temperature_laws,
    without_uncertainty,
)
from accelcal.report.html import items, result, safe, table
from accelcal.report.notebook_results import verdict_html


def calibration_html(document: Mapping[str, Any]) -> str:
    """Write the document of a calibration as tables, without scripts and styles of its own."""
    parts = [items(map(_bold_warning, [*without_uncertainty(document), *alarms(document)]))]
    parts += [table_html(found) for found in document["tables"]]
    for whose, rows in temperature_laws(document):
        caption = f"temperature laws{whose}, T0 = {document['T0_degC']:g} °C"
        parts.append(table(caption, LAW_HEADINGS, rows))
    for found in document.get("fixture_angle", ()):
        caption = f"fixture angle apart from the misalignment, {reversed_mountings(found)}"
        parts.append(table(caption, LAW_HEADINGS, fixture_angle_rows(found)))
    model = document["temperature_model"] or {}
    told = [w for part in (*document["tables"], model) for w in part.get("warnings", ())]
    parts.append(items(map(safe, [*told, *document["warnings"]])))
    if verdict := document.get("verdict"):
        parts.append(verdict_html(verdict))
    return result(
        f"Calibration of {document['serial'] or document['source']}", [document["method"]], *parts
    )


def _bold_warning(sentence: str) -> str:
    return f"<b>WARNING</b> {safe(sentence)}"


def table_html(found: Mapping[str, Any]) -> str:
    """Write one table of the document of a calibration."""
    temperature = found["temperature_degC"]
    where = "" if temperature is None else f", {temperature:.2f} °C"
    caption = f"run {found['run']}{where}, mounting {found['mounting']}"
    rows = [(r.name, r.meaning or r.symbol, *r[3:]) for r in coefficient_rows(found)]
    return table(caption, HEADINGS, rows)
