"""A calibration as a notebook shows it."""

from __future__ import annotations

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
from accelcal.results.calibration import Calibration
from accelcal.results.table import TableCalibration


def calibration_html(calibration: Calibration) -> str:
    """Write a calibration as tables, without scripts and styles of its own."""
    parts = [items(map(_bold_warning, [*without_uncertainty(calibration), *alarms(calibration)]))]
    parts += [table_html(found) for found in calibration.tables]
    for whose, rows in temperature_laws(calibration):
        caption = f"temperature laws{whose}, T0 = {calibration.T0_degC:g} °C"
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


def _bold_warning(sentence: str) -> str:
    return f"<b>WARNING</b> {safe(sentence)}"


def table_html(found: TableCalibration) -> str:
    """Write one table of a calibration."""
    temperature = found.temperature_degC
    where = "" if temperature is None else f", {temperature:.2f} °C"
    caption = f"run {found.run}{where}, mounting {found.mounting}"
    rows = [(r.name, r.meaning or r.symbol, *r[3:]) for r in coefficient_rows(found)]
    return table(caption, HEADINGS, rows)
