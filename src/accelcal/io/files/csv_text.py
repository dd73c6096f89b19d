"""Rows as the text of a CSV file, and which of such files are results of a batch."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable
from typing import Any

_EXACT = 2.0**53
"""Up to here a float holds every whole number."""

_MARKS = re.compile('[,"\n\r]')


def csv_text(rows: Iterable[Iterable[Any]]) -> str:
    r"""Write rows as CSV, in quotes what must be.

    Nothing is written for None.

    Examples
    --------
    >>> csv_text([["run", "note"], [20, "warm, twice"], [60, None]])
    'run,note\n20,"warm, twice"\n60,\n'
    """
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def cell_text(value: Any) -> str:
    r"""Write a value as a cell of one line.

    A float that is a whole number is its digits alone.

    Examples
    --------
    >>> cell_text(15.0), cell_text(1.25), cell_text("warm\ntwice")
    ('15', '1.25', 'warm twice')
    """
    if isinstance(value, float):
        is_whole = value.is_integer() and abs(value) < _EXACT
        return str(int(value)) if is_whole else repr(float(value))
    text = value.decode(errors="backslashreplace") if isinstance(value, bytes) else str(value)
    return " ".join(text.split())


def needs_quotes(text: str) -> bool:
    """Tell whether a cell, or one of several that are joined, has what must be in quotes."""
    return _MARKS.search(text) is not None


def quoted(text: str) -> str:
    """Write one cell as `csv_text` does, where there is no time for the rest of it."""
    return in_quotes(text) if needs_quotes(text) else text


def in_quotes(text: str) -> str:
    """Put a cell in quotes; those in it are doubled."""
    return '"' + text.replace('"', '""') + '"'


_FRAMES = ({"serial", "K1", "K1_standard_uncertainty"}, {"serial", "coefficient", "T0_degC"})
"""Columns that tell the two frames of a batch from all other tables."""

_FAILURES = {"source", "message"}


def is_batch_result(text: str) -> bool:
    r"""Tell whether a text is a result of a batch.

    Its first line tells, even if a spreadsheet has written it anew.

    Examples
    --------
    >>> is_batch_result("source,message\n"), is_batch_result("temperature,position,output\n")
    (True, False)
    """
    names = set(re.split("[,;\t]", text.partition("\n")[0].replace('"', "").strip("\ufeff\r")))
    return names == _FAILURES or any(names >= frame for frame in _FRAMES)
