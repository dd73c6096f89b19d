"""Two engines that turn the rows of a table into columns: a light one and, for bulk, pandas.

Both deliver the same columns. The engine on pandas reads numbers at once and gives up on anything
unusual, quotes, missing fields or a cell that is no number; the light one then has the last word.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from accelcal.arguments.kinds import shown
from accelcal.errors import TableError
from accelcal.io.layout.heading_rows import ANGLE_IN_PARTS
from accelcal.io.layout.parts import Layout
from accelcal.io.layout.separators import split_line
from accelcal.io.values.cells import Column, numbered
from accelcal.io.values.places import with_decimal_degrees
from accelcal.io.values.thousands import thousands_mark, without_mark
from accelcal.io.words.vocabulary import ACROSS, MISSING
from accelcal.plural import counted

if TYPE_CHECKING:
    import pandas as pd

_NO_THOUSANDS = re.compile(r",(?!\d{3}(?!\d))")
"""Comma that other than three digits follow."""

MAY_BE_DECIMALS = (None, "std", "count", "run", "lot", "unit")
"""Roles of a column behind the outputs into which their decimals may have come."""

_SPLIT = re.compile(r"[-+\u2212\u2013]?[0-9]{1,3},[0-9]{3,}(?:\.[0-9]*)?")
"""A number of which a comma may have split the decimals."""

_MOST_ALIKE = 3
"""Whole parts of the outputs of a test at +1 and -1 g alone, whose decimals may be alike."""

_TWICE = re.compile(r"\.\d{3}\.")

NUMERIC = frozenset(
    {"temperature", "position", "angle", "clamping", "stroke", "output", "std", "count"}
).union(ANGLE_IN_PARTS)
"""Roles of columns that hold numbers, with the strokes of a wide table."""

_ANGLES = ("angle", "clamping")

BULK_CHARACTERS = 2_000_000
"""Characters of the rows from which on pandas reads them."""

Found = TypeVar("Found")

Columns = Mapping[int, Column]
"""Index of a heading -> its column."""


class BulkEngineGivesUp(Exception):  # noqa: N818  (a signal between two functions, no error)
    """The rows hold something that only the light engine understands."""


Engine = Callable[[Layout, Sequence[int], int], Columns]
"""Turns the rows of a table into columns: `columns_by_split` or `columns_by_pandas`."""


def by_an_engine(layout: Layout, read: Callable[[Engine], Found]) -> Found:
    """Read a table by pandas where there is so much of it that its import is worth it.

    Where pandas gives up, or the table is refused, the light engine reads it, which words the
    faults.
    """
    if sum(map(len, layout.rows)) >= BULK_CHARACTERS:
        with suppress(BulkEngineGivesUp, TableError):
            return read(columns_by_pandas)
    return read(columns_by_split)


def columns_by_split(layout: Layout, used: Sequence[int], needed: int) -> Columns:
    """Split the rows by the standard library.

    The columns that are used have cells of text. A row has at least the fields that are needed.
    Raises TableError if a row has too many or too few fields.
    """
    _refuse_short(layout)
    table = split_rows(layout, needed)
    _refuse_split_numbers(layout, table)
    by_heading = list(zip(*table, strict=True))
    numeric = [i for i in used if _is_numeric(layout, i)]
    text = " ".join(chain.from_iterable(by_heading[i] for i in numeric))
    decimal, mark = decimal_mark(text, layout.separator), ""
    if "," in text or _TWICE.search(text):
        mark = thousands_mark(text)
    if mark:
        decimal = "," if mark == "." else "."
        for i in numeric:
            by_heading[i] = tuple(without_mark(cell, mark) for cell in by_heading[i])
    lines = np.array(layout.lines, dtype=np.int64)
    return {i: _column(layout, i, by_heading[i], lines, decimal) for i in used}


def split_rows(layout: Layout, needed: int) -> list[list[str]]:
    """Cells of each row, as many as there are headings.

    Blank cells at their ends fall away or are added. Raises TableError if a row has too many or too
    few fields.
    """
    width = len(layout.headings)
    table = [split_line(row, layout.separator) for row in layout.rows]
    for index, cells in enumerate(table):
        if len(cells) != width:
            table[index] = _fitted(cells, width, needed, layout, index)
    return table


def _refuse_short(layout: Layout) -> None:
    """Refuse rows that all end before the last column of outputs, which then may be shifted."""
    last = layout.headings[-1]
    if layout.separator is None or last.role not in ACROSS:
        return
    longest = 1 + max(row.count(layout.separator) for row in layout.rows)
    if longest < len(layout.headings):
        problem = f"no row has more than {longest} fields, but {len(layout.headings)} have headings"
        remedy = f"leave empty fields where some are missing, or delete the heading {last.text}"
        raise layout.refuse(problem, remedy)


def _refuse_split_numbers(layout: Layout, table: Iterable[Sequence[str]]) -> None:
    """Refuse decimals below a heading of their own, as those of ``20,1,1,1,30401``."""
    roles = [heading.role for heading in layout.headings]
    place = roles.index("output") if layout.separator == "," and "output" in roles else len(roles)
    if {*roles[place + 1 : place + 2]}.isdisjoint(MAY_BE_DECIMALS):
        return
    pairs = (cells[place : place + 2] for cells in table)
    numbers = (",".join(pair) for pair in pairs if pair[1:] and pair[1])
    first = next(numbers, "")
    is_bare = _SPLIT.fullmatch(first) and any(first in row for row in layout.rows)
    found = [first, *numbers] if is_bare else []
    if found and all(map(_SPLIT.fullmatch, found)) and not _are_two_columns(found):
        problem = f"{shown(first)} below two headings looks like a number with a decimal comma"
        raise layout.refuse(problem, "separate the columns by semicolons")


def _are_two_columns(pairs: Iterable[str]) -> bool:
    """Tell whether what follows a comma is all much the same size, as decimals are not."""
    whole, behind = zip(*(own.split(",") for own in pairs), strict=True)
    sizes = [float(own) for own in behind]
    return len({*sizes}) == 1 or (len({*whole}) > _MOST_ALIKE and max(sizes) <= 2.0 * min(sizes))


def decimal_mark(text: str, separator: str | None) -> str:
    """Tell the decimal mark of numbers with blanks between.

    Between commas a comma inside quotes is a decimal one where it cannot be a thousands mark:
    somewhere there are not three digits behind it.

    Examples
    --------
    >>> decimal_mark("20,0 1,354", ","), decimal_mark("20 1,354", ",")
    (',', '.')
    """
    if text.count(",") <= text.count("."):
        return "."
    return "," if separator != "," or _NO_THOUSANDS.search(text) else "."


def columns_by_pandas(layout: Layout, used: Sequence[int], _needed: int) -> Columns:
    """Split the rows, and read their numbers, by pandas.

    The arguments are those of `columns_by_split`. Raises BulkEngineGivesUp if the light engine must
    look.
    """
    mark, last, rows = layout.separator, len(layout.headings) - 1, layout.rows
    if mark is None or not all(row.count(mark) == last and '"' not in row for row in rows):
        raise BulkEngineGivesUp
    _refuse_split_numbers(layout, (split_line(row, mark) for row in rows))
    comma = mark != "," and any("," in row for row in rows)
    numeric = [i for i in used if _is_numeric(layout, i)]
    decimal = "," if comma else "."
    text = "\n".join([*rows, ""]).encode()
    frame = read_frame(text, mark, last + 1, used, numeric, decimal)
    lines = np.array(layout.lines, dtype=np.int64)
    cells = {i: frame[i].to_numpy() if i in numeric else [*frame[i].str.strip()] for i in used}
    return {i: _column(layout, i, cells[i], lines, decimal) for i in used}


def read_frame(
    rows: bytes,
    separator: str | None,
    headings: int,
    used: Collection[int],
    numeric: Collection[int],
    decimal: str,
) -> pd.DataFrame:
    """Read plain rows by pandas.

    Each row ends in a line feed, and none has quotes. The columns that are used are called by their
    indices; numbers lose no digit, what is missing is NaN, and a text is no number. Raises
    BulkEngineGivesUp if there is anything else in them.
    """
    import io

    import pandas as pd

    blank = sorted(MISSING | {text.upper() for text in MISSING} | {"NaN"})
    options: dict[str, Any] = {
        "sep": separator,
        "header": None,
        "names": list(range(headings)),
        "index_col": False,
        "usecols": list(used),
        "dtype": {i: np.float64 if i in numeric else object for i in used},
        "decimal": decimal,
        "keep_default_na": False,
        "na_values": dict.fromkeys(numeric, blank),
        "quoting": 3,  # csv.QUOTE_NONE
        "skip_blank_lines": False,
        **exact_numbers(),
    }
    try:
        frame: pd.DataFrame = pd.read_csv(io.BytesIO(rows), **options)
    except ValueError as error:
        raise BulkEngineGivesUp from error
    if len(frame) != rows.count(b"\n"):
        raise BulkEngineGivesUp
    return frame


def _fitted(cells: list[str], width: int, needed: int, layout: Layout, index: int) -> list[str]:
    """Cells of a row, as many as there are headings: blank ones fall away or are added."""
    while len(cells) > width and not cells[-1]:
        cells.pop()
    refusal = partial(TableError, source=layout.source, line=layout.lines[index])
    if len(cells) > width:
        problem = f"{len(cells)} fields under {width} column headings"
        remedy = "give every column a heading"
        if layout.separator == ",":
            remedy += ", and with decimal commas separate the columns by semicolons"
        raise refusal(problem, remedy)
    if layout.separator is None and len(cells) < width:
        problem = f"{counted(len(cells), 'field')} between blanks under {width} column headings"
        raise refusal(problem, "write NaN for a missing one, and headings without blanks")
    if len(cells) < needed:
        near = layout.rows[max(index - 1, 0) : index + 1]
        if any(row.count('"') % 2 for row in near):  # which one of them opens, and another closes
            raise refusal("a cell has a line break", "write it in one line")
        missing = layout.headings[needed - 1].text
        problem = f"{counted(len(cells), 'field')}, but {missing} is field {needed}"
        raise refusal(problem, "complete the row or delete it")
    return cells + [""] * (width - len(cells))


def _is_numeric(layout: Layout, index: int) -> bool:
    role = layout.headings[index].role
    return role in ACROSS or role in NUMERIC


def _column(layout: Layout, index: int, cells: Any, lines: Any, decimal: str) -> Column:
    heading = layout.headings[index]
    column = Column(
        role=heading.role or "",
        heading=heading.text,
        unit=heading.unit,
        cells=cells,
        lines=lines,
        source=layout.source,
        decimal=decimal,
    )
    if isinstance(cells, np.ndarray) or not _is_numeric(layout, index):
        return column
    column = with_decimal_degrees(column) if heading.role in _ANGLES else numbered(column)
    return column.without_unit()


def exact_numbers() -> dict[str, str]:
    r"""Options of `pandas.read_csv` by which each number becomes the float nearest to it.

    There are none from pandas 3.1 on, which has no other converter.

    Examples
    --------
    >>> import io
    >>> import pandas as pd
    >>> float(pd.read_csv(io.StringIO("K1\n1.3111044712102817"), **exact_numbers())["K1"][0])
    1.3111044712102817
    """
    import pandas as pd

    major, minor = map(int, pd.__version__.split(".")[:2])
    return {} if (major, minor) >= (3, 1) else {"float_precision": "round_trip"}
