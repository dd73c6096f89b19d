"""Files of calibrations: frames that a batch wrote, and documents of fits."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from accelcal.errors import InputError
from accelcal.io.engines import exact_numbers
from accelcal.io.files.text import is_document, read_text
from accelcal.recalibrations.entries import Entry, entries_of
from accelcal.results.calibration import Calibration
from accelcal.results.documents.stored import all_from_json

if TYPE_CHECKING:
    import pandas as pd

_DECIMAL_COMMA = re.compile(r'[;\t]"?-?\d+,\d+(?:[eE][+-]?\d+)?"?(?:[;\t]|$)', re.MULTILINE)
"""A number as a German spreadsheet writes it."""


def read_entries(paths: Sequence[str]) -> list[Entry]:
    """Read what some files say of units.

    They are frames of ``accelcal batch`` (CSV or Parquet) or documents of ``accelcal fit`` (JSON),
    and an entry is of one table. Raises InputError if a file cannot be read, or is neither of the
    two.
    """
    return [entry for path in paths for entry in _read(path)]


def _read(path: str) -> list[Entry]:
    name, text, *_ = read_text(path, "result")
    read = partial(all_from_json, Calibration) if is_document(text) else _frame
    try:
        return entries_of(read(text))
    except InputError as error:
        raise error.at(name) from None


def _frame(text: str) -> pd.DataFrame:
    from io import StringIO

    import pandas as pd

    headings = text.partition("\n")[0]
    separator = max(",;\t", key=headings.count)
    _refuse_cut(text, separator)
    options: Any = {
        "sep": separator,
        "decimal": "," if separator != "," and _DECIMAL_COMMA.search(text) else ".",
        "dtype": {"serial": str, "date": str, "run": str, "source": str, "sha256": str},
        "keep_default_na": False,  # only what is empty is missing: a serial may be NA
        "na_values": [""],
        "low_memory": False,  # in parts, a column of texts and empty cells would have two types
        **exact_numbers(),
    }
    try:
        frame: pd.DataFrame = pd.read_csv(StringIO(text), **options)
    except ValueError:  # that of the parser is one too
        raise InputError(
            "not a frame of results; give what accelcal batch -o RESULTS.csv wrote, or fit the"
            " table first"
        ) from None
    return frame


def _refuse_cut(text: str, separator: str) -> None:
    """Refuse a last row that ends too soon: of its last number some digits may be lost."""
    bare = text.strip("\n")
    ends = [bare.rpartition("\n")[2], bare.partition("\n")[0]]
    there, wanted = (len(next(csv.reader([row], delimiter=separator), ())) for row in ends)
    if there < wanted:
        raise InputError(
            f"the last row has {there} of {wanted} fields: the file was cut off; copy it again"
        )
