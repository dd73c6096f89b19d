"""A calibration as a notebook shows it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import astuple
from html import escape
from typing import Any

from accelcal.report.rows import coefficient_rows

__all__ = ["calibration_html"]

_HEADINGS = ("", "", "value", "± U (95 %)", "unit", "u", "U/u", "mostly from")


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
    parts = [f"<p><b>Calibration of {escape(str(name))}</b>, {escape(document['method'])}</p>"]
    parts += [_table(table) for table in document["tables"]]
    gates = [*document["gates"], *(gate for t in document["tables"] for gate in t["gates"])]
    warned = [f"{g['name']}: {g['finding']}" for g in gates if g["verdict"] == "warn"]
    told = [w for t in document["tables"] for w in t["warnings"]]
    return "".join([*parts, _list([*warned, *told, *document["warnings"]])])


def _table(table: Mapping[str, Any]) -> str:
    temperature = table["temperature_degC"]
    where = "" if temperature is None else f", {temperature:.2f} °C"
    caption = escape(f"run {table['run']}{where}, mounting {table['mounting']}")
    body = "".join(_line("td", astuple(row)) for row in coefficient_rows(table))
    return f"<table><caption>{caption}</caption>{_line('th', _HEADINGS)}{body}</table>"


def _line(tag: str, cells: Iterable[str]) -> str:
    return f"<tr>{''.join(f'<{tag}>{escape(cell)}</{tag}>' for cell in cells)}</tr>"


def _list(sentences: Iterable[str]) -> str:
    items = "".join(f"<li>{escape(sentence)}</li>" for sentence in dict.fromkeys(sentences))
    return f"<ul>{items}</ul>" if items else ""
