"""The calibration of a head as text for a terminal."""

from __future__ import annotations

from collections.abc import Iterator

from accelcal.report.findings import gate_lines
from accelcal.report.lines import aligned, visible_lines, wrapped
from accelcal.report.numbers import in_millionths
from accelcal.results.head_calibration import HeadCalibration
from accelcal.units import MICRO

_TOLD = 0.5
"""Share of the declared variance below which a harmonic counts as not told."""


def text(found: HeadCalibration) -> str:
    """Write the calibration of a head as lines of at most 100 characters."""
    lines = [*_head(found), "", *_positions(found)]
    if found.harmonics:
        lines += ["", *_harmonics(found)]
    if found.units:
        lines += ["", *_units(found)]
    return visible_lines([*lines, *gate_lines(found.gates)])


def _head(found: HeadCalibration) -> Iterator[str]:
    yield from wrapped(f"Head, {found.origin} from {found.source}")
    told = f"{len(found.errors)} positions, {MICRO * found.uncertainty:.3g} urad rms uncertainty"
    if found.declared_uncertainty_rad is not None:
        told += f"; {MICRO * found.declared_uncertainty_rad:.3g} urad declared"
    yield told


def _positions(found: HeadCalibration) -> Iterator[str]:
    rows = [("position", "error", "U (95 %)", "")]
    for angle, q in zip(found.angles_deg, found.quantities(), strict=True):
        rows.append((f"{angle:g} deg", *in_millionths(q), "urad"))
    yield from aligned(rows, right={0, 1, 2}, indent="  ")


def _harmonics(found: HeadCalibration) -> Iterator[str]:
    rows = [("harmonic", "amplitude", "U (95 %)", "", "told", "")]
    for item in found.harmonics:
        lost = item.told < _TOLD
        why = f"cannot be told apart from {item.absorbed_by}" if item.absorbed_by else "not told"
        share = f"{100 * item.told:.0f} %"
        rows.append((item.name, *in_millionths(item.amplitude), "urad", share, why if lost else ""))
    yield from aligned(rows, right={1, 2, 4}, indent="  ")


def _units(found: HeadCalibration) -> Iterator[str]:
    yield "Coefficients, with the head by each unit alone and by all [ug/g^n]"
    rows = [("", "", "alone", "U (95 %)", "jointly", "U (95 %)")]
    for unit in found.units:
        for name, change in unit.coefficients.items():
            before, after = map(in_millionths, (change.before, change.after))
            rows.append((unit.name, name, *before, *after))
    yield from aligned(rows, right={2, 3, 4, 5}, indent="  ")
