"""The forms in which a result is shown: text, JSON and CSV."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from typing import Any, Protocol

from accelcal.cli.deliver import deliver

Rows = Sequence[Mapping[str, Any]]


class Result(Protocol):
    """What can be shown in each form; as a string it is the text."""

    def to_document(self) -> Mapping[str, Any]:
        """Return the JSON document."""

    def rows(self) -> Rows:
        """Return the rows of the CSV."""


Forms = Mapping[str, Callable[[], str]]
"""Form, ``"text"``, ``"json"`` or ``"csv"`` -> what writes a result in it."""


def deliver_forms(forms: Forms, path: str | None, form: str) -> None:
    """Write what was found as JSON to a file, and show it unless the file is standard output.

    The file ``"-"`` is standard output.
    """
    made = {name: cache(make) for name, make in forms.items()}
    if path is not None:
        deliver(made["json"](), path)
    if path != "-":
        deliver(made[form](), words=form == "text")


def deliver_result(
    found: Result, path: str | None, form: str, csv: Callable[[], str] | None = None
) -> None:
    """Deliver one result in the forms that all have.

    The CSV is the rows of the result unless something else writes it.
    """
    forms = {
        "text": lambda: str(found),
        "json": lambda: json_of(found.to_document()),
        "csv": csv or (lambda: csv_of(found.rows())),
    }
    deliver_forms(forms, path, form)


def json_of(document: Mapping[str, Any]) -> str:
    """Write a document as JSON."""
    from accelcal.results.documents.json_text import json_text

    return json_text(document)


def one_below_the_other(texts: Iterable[str]) -> str:
    """Put the texts of several results together."""
    return ("\n\n" + "=" * 100 + "\n\n").join(texts)


def csv_of(rows: Rows) -> str:
    r"""Write rows as CSV, under the names of the first one.

    Examples
    --------
    >>> csv_of([{"a": 1, "b": None}, {"a": 0.5, "b": "x"}])
    'a,b\n1,\n0.5,x\n'
    """
    from accelcal.io.files.csv_text import csv_text

    names = list(rows[0])
    return csv_text([names, *([row[name] for name in names] for row in rows)])
