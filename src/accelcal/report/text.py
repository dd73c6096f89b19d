"""A calibration as text for an engineer."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from accelcal.report.numbers import significant
from accelcal.report.rows import (
    coefficient_rows,
    residual_grid,
    strong_correlations,
    temperature_rows,
)

__all__ = ["calibration_text"]

Document = Mapping[str, Any]

_WIDTH = 100
_STANDARD_GRAVITY = 9.80665  # m/s^2, 3rd CGPM 1901
_MICRO = 1e6
_READABLE = {"rad": (_MICRO, "urad"), "g": (_MICRO, "ug"), "1": (_MICRO, "ppm")}


def calibration_text(document: Document) -> str:
    """Write a calibration as text.

    Parameters
    ----------
    document : mapping
        Document of a calibration, as of `accelcal.Calibration.to_document`.

    Returns
    -------
    str
        Lines of at most 100 characters, in ASCII.
    """
    lines = [*_heading(document)]
    lines += [] if document["warnings"] == [] else ["", *_open(document)]
    for table in document["tables"]:
        lines += ["", *_table(table, document)]
    if document["temperature_model"]:
        lines += ["", *_temperature(document["temperature_model"], document["T0_degC"])]
    lines += ["", *_errors(document), *_gates(document["gates"])]
    return "\n".join(lines)


def _heading(document: Document) -> Iterator[str]:
    name = f"serial {document['serial']}, " if document["serial"] else ""
    date = f", {document['date']}" if document["date"] else ""
    yield f"Calibration of {name}{document['source']}{date}"
    tables = document["tables"]
    readings = sum(table["readings"] for table in tables)
    robust = ", robust" if document["robust"] else ""
    count = f"{len(tables)} table{'s' if len(tables) > 1 else ''}"
    yield (
        f"{document['method']}{robust}, {readings} readings in {count}; g is local g"
        + (f" = {document['g_local_m_s2']:g} m/s^2" if document["g_local_m_s2"] else "")
        + (f"; T0 = {document['T0_degC']:g} degC" if document["T0_degC"] is not None else "")
    )


def _table(table: Document, document: Document) -> Iterator[str]:
    temperature = table["temperature_degC"]
    where = "temperature unknown" if temperature is None else f"{temperature:.2f} degC"
    yield (
        f"Run {table['run']}: {where}, mounting {table['mounting']}, {table['readings']} readings,"
        f" {table['dof']} degrees of freedom"
    )
    yield from _coefficients(table)
    yield from _scale_factor_elsewhere(table, document["g_local_m_s2"])
    yield from _correlations(table)
    yield from _residuals(table)
    yield from _gates(table["gates"])
    yield from _items("note", table["warnings"])


def _coefficients(table: Document) -> Iterator[str]:
    rows = [
        (r.name, r.symbol, r.value, r.expanded, r.unit, r.standard, r.factor, r.dominated_by)
        for r in coefficient_rows(table)
    ]
    heading = ("", "", "value", "+- U (95 %)", "unit", "u", "k", "mostly from")
    yield from _columns([heading, *rows], right={2, 3, 5, 6})


def _scale_factor_elsewhere(table: Document, local_gravity: float | None) -> Iterator[str]:
    """Scale factor in ppm, and per m/s^2 and standard g, which need the local gravity."""
    quantity = table["coefficients"]["K1"]
    if quantity["expanded_uncertainty"] is not None:
        relative = quantity["expanded_uncertainty"] / abs(quantity["value"])
        yield f"  K1 is known to {significant(relative * _MICRO, 2)} ppm (U)"
    if not local_gravity:
        return
    per_si = quantity["value"] / local_gravity
    unit = quantity["unit"].removesuffix("/g")
    yield (
        f"  K1 = {per_si:.9g} {unit}/(m/s^2) = {per_si * _STANDARD_GRAVITY:.9g} {unit} per standard"
        f" g ({_STANDARD_GRAVITY} m/s^2)"
    )


def _correlations(table: Document) -> Iterator[str]:
    pairs = [f"{a} with {b} {r:+.2f}" for a, b, r in strong_correlations(table)]
    if pairs:
        yield f"  strongly correlated: {', '.join(pairs)}"


def _residuals(table: Document) -> Iterator[str]:
    strokes, rows = residual_grid(table)
    yield "  residuals [ug] by head angle and stroke"
    heading = ["deg", *(f"k={stroke}" for stroke in strokes), "mean"]
    lines = [heading]
    for angle, values in rows:
        seen = [value for value in values if value is not None]
        shown = ["" if value is None else _micro(value) for value in values]
        lines.append([f"{angle:g}", *shown, _micro(sum(seen) / len(seen))])
    yield from _columns(lines, right=set(range(len(heading))))


def _micro(value: float) -> str:
    return f"{value * _MICRO:.1f}"


def _temperature(model: Document, reference: float) -> Iterator[str]:
    yield f"Temperature laws, bilinear about T0 = {reference:g} degC"
    yield from _columns(
        [("", "", "value", "+- U (95 %)", "unit"), *temperature_rows(model)], right={2, 3}
    )
    yield from _items("note", model["warnings"])


def _errors(document: Document) -> Iterator[str]:
    yield "Sources of error"
    readings = [s for s in document["error_sources"] if s["name"] == "reading"]
    for table, source in zip(document["tables"], readings, strict=True):
        yield f"  reading noise, run {table['run']}: {_size(source)}{_in_micro_g(source, table)}"
    titles = {"head": "head position", "launch": "bias, launch to launch"}
    titles["launch_sf"] = "scale factor, launch to launch"
    for source in document["error_sources"]:
        if source["name"] in titles:
            yield f"  {titles[source['name']]}: {_size(source)}"


def _size(source: Document) -> str:
    if source["value"] is None:
        return "unknown"
    dof = f", {source['dof']:.0f} degrees of freedom" if source["dof"] is not None else ""
    factor, unit = _READABLE.get(source["unit"], (1.0, source["unit"]))
    return f"{significant(factor * source['value'])} {unit} ({source['source']}{dof})"


def _in_micro_g(source: Document, table: Document) -> str:
    scale_factor = table["coefficients"]["K1"]["value"]
    if source["value"] is None or not scale_factor or source["source"] == "declared":
        return ""
    return f" = {significant(abs(source['value'] / scale_factor) * _MICRO)} ug"


def _gates(gates: Sequence[Document]) -> Iterator[str]:
    passed = [gate["name"] for gate in gates if gate["verdict"] == "pass"]
    if passed:
        yield f"  gates passed: {', '.join(passed)}"
    for gate in gates:
        if gate["verdict"] == "warn":
            yield from _item("WARNING", f"{gate['name']}: {gate['finding']}")
        elif gate["verdict"] != "pass":
            yield from _item("not assessed", f"{gate['name']}: {gate['finding']}")


def _open(document: Document) -> Iterator[str]:
    yield "What these numbers leave open"
    yield from _items("-", document["warnings"])


def _items(mark: str, sentences: Iterable[str]) -> Iterator[str]:
    for sentence in sentences:
        yield from _item(mark, sentence)


def _item(mark: str, sentence: str) -> list[str]:
    mark = mark if mark == "-" else f"{mark}:"
    return textwrap.wrap(
        f"{mark} {sentence}", _WIDTH, initial_indent="  ", subsequent_indent="    "
    )


def _columns(rows: Sequence[Sequence[str]], right: set[int]) -> Iterator[str]:
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    for row in rows:
        cells = (
            cell.rjust(width) if i in right else cell.ljust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        yield ("  " + "  ".join(cells)).rstrip()
