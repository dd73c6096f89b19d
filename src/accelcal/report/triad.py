"""The calibration of a triad as text for a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from accelcal.plural import degrees_of_freedom
from accelcal.report.calibration_rows import HEADINGS
from accelcal.report.findings import gate_lines
from accelcal.report.lines import aligned, hanging, sections, unit_of
from accelcal.report.numbers import matching_digits, significant
from accelcal.results.quantity import Quantity
from accelcal.results.triad import FRAMES, TriadCalibration


def text(found: TriadCalibration) -> str:
    """Write the calibration of a triad as lines of at most 100 characters."""
    return sections(_head(found), _table(found), _gates(found))


def _head(found: TriadCalibration) -> Iterator[str]:
    yield f"Triad {unit_of(found.serial, found.source)}"
    what = "|a| - 1" if found.frame != "block" else "the channels"
    where = "" if found.temperature_degC is None else f"; {found.temperature_degC:.2f} degC"
    yield (
        f"{found.attitudes} attitudes, {degrees_of_freedom(found.dof)};"
        f" residual of {what} {1e3 * found.residual_rms:.3g} mg rms{where}"
    )
    yield f"frame: {FRAMES.get(found.frame, found.frame)}"


def _table(found: TriadCalibration) -> Iterator[str]:
    biases = {name: q for name, q in found.parameters.items() if name.startswith("b_")}
    rows = [HEADINGS[:6], *_rows("bias", biases), *_rows("scale factor", found.scale_factors)]
    if found.g_local_m_s2:
        rows += _rows("", {n: _per_si(q, found) for n, q in found.scale_factors.items()})
    rows += _rows("sensitive axis", found.misalignments)
    rows += _rows("90 deg - angle", {f"{p[0]}, {p[1]}": q for p, q in found.axis_angles.items()})
    yield from aligned(rows, right={2, 3, 5}, indent="  ")


def _per_si(quantity: Quantity, found: TriadCalibration) -> Quantity:
    g = found.g_local_m_s2 or 1.0
    unit = quantity.unit.removesuffix("/g") + " per m/s^2"
    parts = (quantity.value, quantity.standard_uncertainty, quantity.expanded_uncertainty)
    value, standard, expanded = (None if part is None else part / g for part in parts)
    return Quantity(value, standard, unit, expanded, quantity.dof)


def _rows(name: str, quantities: Mapping[str, Quantity]) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for symbol, q in quantities.items():
        factor, unit = (1e3, "mrad") if q.unit == "rad" else (1.0, q.unit)
        value, standard = q.value or 0.0, q.standard_uncertainty
        if standard == 0.0:
            cells = (f"{factor * value:g}", "by frame", unit, "")
        elif standard is None:
            cells = (f"{factor * value:.8g}", "-", unit, "-")
        else:
            shown = matching_digits(value, q.expanded_uncertainty, factor)
            cells = (*shown, unit, significant(factor * standard, 2))
        rows.append((name, symbol, *cells))
        name = ""
    return rows


def _gates(found: TriadCalibration) -> Iterator[str]:
    yield from gate_lines(found.gates)
    for note in found.notes:
        yield from hanging(f"- {note}")
