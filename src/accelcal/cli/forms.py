"""The forms in which a result is shown: text, JSON and CSV."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Protocol

from accelcal.cli.deliver import deliver

Rows = Sequence[Mapping[str, Any]]


class Result(Protocol):
    """What can be shown in each form; as a string it is the text."""

    def to_document(self) -> Mapping[str, Any]:
        """Return the JSON document."""

    def rows(self) -> Rows:
        """Return the rows of the CSV."""


def in_form(found: Result, form: str, rows: Rows | None = None) -> str:
    """Write a result in the form that was asked for.

    Parameters
    ----------
    found : Result
        The result.
    form : {"text", "json", "csv"}
        The form.
    rows : sequence of mapping, optional
        Rows of the CSV, where they are not those of the result.

    Returns
    -------
    str
        The result.
    """
    if form == "text":
        return str(found)
    if form == "csv":
        return csv_of(found.rows() if rows is None else rows)
    from accelcal.results.json_text import json_text

    return json_text(found.to_document())


def deliver_result(found: Result, path: str | None, form: str, rows: Rows | None = None) -> None:
    """Write a result as JSON to a file, and show it unless the file is standard output.

    Parameters
    ----------
    found : Result
        The result.
    path : str or None
        The file; ``"-"`` is standard output.
    form : {"text", "json", "csv"}
        The form in which it is shown.
    rows : sequence of mapping, optional
        Rows of the CSV, where they are not those of the result.
    """
    if path is not None:
        deliver(in_form(found, "json"), path)
    if path != "-":
        deliver(in_form(found, form, rows), words=form == "text")


def one_below_the_other(texts: Iterable[str]) -> str:
    """Put the texts of several results together."""
    return ("\n\n" + "=" * 100 + "\n\n").join(texts)


def csv_of(rows: Rows) -> str:
    r"""Write rows as CSV, under the names of the first one.

    Parameters
    ----------
    rows : sequence of mapping
        One or more rows with the same names.

    Returns
    -------
    str
        The CSV.

    Examples
    --------
    >>> csv_of([{"a": 1, "b": None}, {"a": 0.5, "b": "x"}])
    'a,b\n1,\n0.5,x\n'
    """
    from accelcal.io.csv_text import csv_text

    names = list(rows[0])
    return csv_text([names, *([row[name] for name in names] for row in rows)])
