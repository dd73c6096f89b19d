"""A calibration as a notebook shows it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape
from typing import Any

from accelcal.report.names import visible
from accelcal.report.rows import alarms, coefficient_rows, temperature_rows, without_uncertainty
from accelcal.report.verdict import verdict_text

__all__ = ["calibration_html"]

_HEADINGS = ("", "", "value", "U (95 %)", "unit", "u", "U/u", "mostly from")
_LAW_HEADINGS = _HEADINGS[:5]


def calibration_html(document: Mapping[str, Any]) -> str:
    """Write a calibration as HTML tables, without scripts and styles of its own.

    Parameters
    ----------
    document : mapping
        Document of a calibration, as of `accelcal.Calibration.to_document`.

    Returns
    -------
    str
        A fragment of HTML.
    """
    name = document["serial"] or document["source"]
    parts = [f"<p><b>Calibration of {_safe(str(name))}</b>, {_safe(document['method'])}</p>"]
    parts.append(_list(map(_bold_warning, [*without_uncertainty(document), *alarms(document)])))
    parts += [_table(table) for table in document["tables"]]
    model = document["temperature_model"]
    if model:
        caption = f"temperature laws, T0 = {document['T0_degC']:g} °C"
        parts.append(_rows(caption, _LAW_HEADINGS, temperature_rows(document)))
    told = [w for part in (*document["tables"], model or {}) for w in part.get("warnings", ())]
    parts.append(_list(map(_safe, [*told, *document["warnings"]])))
    if verdict := document.get("verdict"):
        parts.append(f"<pre>{escape(verdict_text(verdict))}</pre>")
    return "".join(parts)


def _bold_warning(sentence: str) -> str:
    return f"<b>WARNING</b> {_safe(sentence)}"


def _table(table: Mapping[str, Any]) -> str:
    temperature = table["temperature_degC"]
    where = "" if temperature is None else f", {temperature:.2f} °C"
    caption = f"run {table['run']}{where}, mounting {table['mounting']}"
    found = coefficient_rows(table)
    rows = [(r.name, r.meaning or r.symbol, *r[3:]) for r in found]
    return _rows(caption, _HEADINGS, rows)


def _rows(caption: str, headings: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    body = "".join(_line("td", row) for row in rows)
    return f"<table><caption>{_safe(caption)}</caption>{_line('th', headings)}{body}</table>"


def _line(tag: str, cells: Iterable[str]) -> str:
    return f"<tr>{''.join(f'<{tag}>{_safe(cell)}</{tag}>' for cell in cells)}</tr>"


def _safe(text: str) -> str:
    return escape(visible(text))


def _list(items: Iterable[str]) -> str:
    """List of items that are HTML already, each once."""
    found = "".join(f"<li>{item}</li>" for item in dict.fromkeys(items))
    return f"<ul>{found}</ul>" if found else ""
