"""Exports as YAML and as CSV."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

from accelcal.io.csv_text import csv_text

__all__ = ["to_csv", "to_yaml"]


def to_yaml(content: Mapping[str, Any]) -> str:
    """Write an export as YAML.

    Parameters
    ----------
    content : mapping
        What `accelcal.export.content.export_content` returns: texts, finite numbers, truth
        values, None, and lists and mappings of them.

    Returns
    -------
    str
        The document, block by block. Texts are quoted as in JSON, which YAML understands; numbers
        always have a decimal point, without which YAML 1.1 takes 1e-5 for a text.

    Examples
    --------
    >>> print(to_yaml({"serial": "AL-15", "range": [-1.0, 1e-5], "date": None}), end="")
    serial: "AL-15"
    range:
      - -1.0
      - 1.0e-05
    date: null
    """
    return "".join(f"{line}\n" for line in _yaml_lines(content))


def _yaml_lines(value: Any) -> Iterator[str]:
    """Lines of a mapping or list that is not empty."""
    items = value.items() if isinstance(value, Mapping) else ((None, item) for item in value)
    for key, item in items:
        mark = "-" if key is None else f"{key}:"
        if not isinstance(item, Mapping | list) or not item:
            yield f"{mark} {_yaml_scalar(item)}"
            continue
        lines = _yaml_lines(item)
        if key is None:
            mark, first = "-", next(lines)
            yield f"- {first}"
        else:
            yield mark
        yield from (f"  {line}" for line in lines)


def _yaml_scalar(value: Any) -> str:
    if isinstance(value, float):
        text = repr(value)
        return text if "." in text else text.replace("e", ".0e")
    text = json.dumps(value, ensure_ascii=False)
    return "".join(c if c.isprintable() else f"\\U{ord(c):08X}" for c in text)


def to_csv(content: Mapping[str, Any]) -> str:
    """Write an export as CSV: a row for each coefficient, all else in header lines.

    Parameters
    ----------
    content : mapping
        What `accelcal.export.content.export_content` returns.

    Returns
    -------
    str
        The table. The last columns hold the covariance; cells are empty where nothing is known.
    """
    table = dict(content)
    rows, covariance = table.pop("coefficients"), table.pop("covariance")
    by_symbol = dict(zip(covariance["symbols"], covariance["matrix"], strict=True))
    said = {**table, "covariance": covariance["note"]}
    above = "".join(f"# {key}: {_on_one_line(value)}\n" for key, value in said.items())
    headings = [*rows[0], *(f"covariance_{symbol}" for symbol in by_symbol)]
    unknown = [None] * len(by_symbol)
    cells = ([*row.values(), *by_symbol.get(row["symbol"], unknown)] for row in rows)
    return above + csv_text([headings, *cells])


def _on_one_line(value: Any) -> str:
    if isinstance(value, str) and value.isprintable():
        return value
    return "" if value is None else json.dumps(value)
