"""Rows as the text of a CSV file."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable
from typing import Any

_MARKS = re.compile('[,"\n\r]')


def csv_text(rows: Iterable[Iterable[Any]]) -> str:
    r"""Write rows as CSV, in quotes what must be.

    Parameters
    ----------
    rows : iterable of iterable
        Cells; nothing is written for None.

    Returns
    -------
    str
        A line for each row.

    Examples
    --------
    >>> csv_text([["run", "note"], [20, "warm, twice"], [60, None]])
    'run,note\n20,"warm, twice"\n60,\n'
    """
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def needs_quotes(text: str) -> bool:
    """Tell whether a cell, or one of several that are joined, has what must be in quotes."""
    return _MARKS.search(text) is not None


def quoted(text: str) -> str:
    """Write one cell as `csv_text` does, where there is no time for the rest of it."""
    return '"' + text.replace('"', '""') + '"' if needs_quotes(text) else text
