"""Cells of a column: text to numbers and labels, each refusal with its line."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from functools import partial
from itertools import chain, compress
from typing import NamedTuple

import numpy as np

from accelcal.arguments.kinds import shown
from accelcal.arrays import Array, Ints, Mask
from accelcal.errors import TableError
from accelcal.io.values.thousands import first_in_groups, without_blanks
from accelcal.io.words.headings import read_heading
from accelcal.io.words.vocabulary import (
    MISSING,
    UNITS_OF,
    has_unit,
    is_missing,
    is_unit_of,
    with_hyphen,
)
from accelcal.units import celsius, is_same_unit

_REMEDIES = {
    "position": "write its number J; head angles have the heading 'angle'",
    "clamping": "write a number",
    "stroke": "write its number; words such as forward and back stand in a column direction",
    "temperature": "write a number, or 'unknown' where it is not known",
    "time": "write seconds, a clock time as 14:30:00, or both as 2024-05-31T14:30:00",
    "angle": "write head angles in degrees, as 22.5 or 22\u00b030'",
}
"""Column -> what its cells should be, where one is no number."""

_NUMBER_AND_UNIT = re.compile(r"([+-]?[0-9.,]+(?:[eE][+-]?[0-9]+)?)\s*(.*)")

_PARTED = re.compile(r"[0-9]{1,4}([./-])[0-9]{1,2}\1[0-9]{2,4}(?![0-9])")
"""A date whose numbers may be its day, month and year in any order."""

_DIGIT = re.compile("[0-9]")
_IN_G = re.compile(r"[-+\u2212\u2013]?[01](?:[.,]0)? ?g")
"""A position told by the acceleration there."""

_FEWEST_ROWS = 16
"""Rows from which on numbers that count them are told from others."""

_WHOLE = re.compile(r"0*([0-9]+)(?:\.0*)?")


class Column(NamedTuple):
    """One column of the table."""

    role: str  # what it holds
    heading: str  # its heading as written
    unit: str | None  # unit of its heading or cells
    cells: Sequence[str] | Array  # text, or numbers where the engine has read them already
    lines: Ints  # line of each cell
    source: str
    decimal: str = "."  # decimal mark, ``"."`` or ``","``

    def take(self, keep: Mask) -> Column:
        """Keep the cells where `keep` is true."""
        if keep.all():
            return self
        cells = self.cells
        chosen = cells[keep] if isinstance(cells, np.ndarray) else [*compress(cells, keep)]
        return self._replace(cells=chosen, lines=self.lines[keep])

    def without_unit(self, is_unit: Callable[[str], bool] | None = None) -> Column:
        """Take off the unit that every cell carries, as in ``1.25 mA``; it becomes the column's.

        `is_unit` tells a unit, right or wrong, of the column; by default that of its role.
        """
        first = next((cell for cell in self.cells if not is_missing(str(cell))), "")
        _, unit = number_and_unit(str(first), ".")
        if not unit or not (is_unit or partial(is_unit_of, self.role))(unit):
            return self
        allowed = UNITS_OF.get(self.role)
        if allowed and not has_unit(self.role, unit):
            problem, remedy = f"{{}} is in {unit}", f"give it in {allowed[0]}"
            raise self.refuse(list(self.cells).index(first), problem, remedy)
        if self.unit and not is_same_unit(self.unit, unit):
            problem, remedy = f"{{}} under a heading in {self.unit}", "use one unit in a column"
            raise self.refuse(list(self.cells).index(first), problem, remedy)
        cells = [self._bare(i, unit) for i in range(len(self.cells))]
        return self._replace(unit=unit, cells=cells)

    def _bare(self, index: int, unit: str) -> str:
        cell = str(self.cells[index])
        number, own = number_and_unit(cell, ".")
        if own == unit:
            return number
        if is_missing(cell):
            return cell
        raise self.refuse(index, f"{{}} after cells in {unit}", "use one unit in a column")

    def refuse(self, index: int, problem: str, remedy: str) -> TableError:
        """Error about one cell; ``{}`` in the problem stands for the column and the cell."""
        cell = self.cells[index]
        # beside a cell, a heading that is a number would read as one
        name = f"column {self.heading}" if self.heading[:1].isdigit() else self.heading
        what = f"{name} {shown(str(cell))}" if cell != "" else name
        line = int(self.lines[index])
        return TableError(problem.format(what), remedy, source=self.source, line=line)

    def check(self, good: Mask, problem: str, remedy: str) -> None:
        """Refuse the first cell where `good` is false."""
        if not good.all():
            raise self.refuse(int(np.argmin(good)), problem, remedy)


def numbered(column: Column) -> Column:
    """Take the words off positions or strokes such as ``Pos. 1`` or ``k2``, where all have them.

    Examples
    --------
    >>> numbered(Column("stroke", "k", None, ["Hub 1", ""], np.arange(2), "a.csv")).cells
    ['1', '']
    """
    if column.role not in ("position", "stroke") or str(column.cells[0])[:1].isdecimal():
        return column
    told = [read_heading(str(cell)) for cell in column.cells]
    if any(own.role != f"{column.role}s" and not is_missing(own.text) for own in told):
        return column
    return column._replace(cells=["" if own.of is None else f"{own.of:g}" for own in told])


def are_words(column: Column) -> bool:
    """Tell whether no cell of a column is a number, and one is a word or an acceleration."""
    cells = [] if isinstance(column.cells, np.ndarray) else [*map(str, column.cells)]
    told = [cell for cell in cells if not is_missing(cell)]
    return bool(told) and all(_IN_G.fullmatch(cell) or not _DIGIT.search(cell) for cell in told)


def number_and_unit(text: str, decimal: str) -> tuple[str, str]:
    """Split a number from the unit behind it.

    The number has a decimal point, and may be no number yet; it is empty where the text does not
    begin as one.

    Examples
    --------
    >>> number_and_unit("0,5 arcsec", ","), number_and_unit("-2", "."), number_and_unit("no", ".")
    (('0.5', 'arcsec'), ('-2', ''), ('', ''))
    """
    match = _NUMBER_AND_UNIT.fullmatch(with_hyphen(text))
    number, unit = match.groups() if match else ("", "")
    return number.replace(",", ".") if decimal == "," else number, unit


def numbers(column: Column) -> Array:
    """Numbers of a column, NaN where a cell is missing; temperatures in degC.

    Raises TableError at the first cell that is not a finite number.
    """
    cells = column.cells
    values = cells if isinstance(cells, np.ndarray) else np.array(_floats(column))
    column.check(~np.isinf(values), "{} is infinite or too large", "write a finite number")
    return celsius(values, column.unit) if column.role == "temperature" else values


def counts_rows(values: Array) -> bool:
    """Tell whether numbers are 1, 2, 3, ... or 0, 1, 2, ... from row to row, of 16 rows or more.

    Examples
    --------
    >>> counts_rows(np.arange(20.0)), counts_rows(np.arange(5.0))
    (True, False)
    """
    rows = np.arange(values.size) + values[0]
    return bool(values.size >= _FEWEST_ROWS and values[0] in (0, 1) and (values == rows).all())


def complete_numbers(column: Column) -> Array:
    """Numbers of a column, of which none is missing.

    Raises TableError at the first cell that is missing or no finite number.
    """
    values = numbers(column)
    column.check(~np.isnan(values), "{} is missing", "complete the row or delete it")
    return values


def whole_numbers(column: Column, rule: str) -> Ints:
    """Whole numbers of a column, 0 where a cell is missing.

    The rule tells what would be right. Raises TableError at the first cell that is not a whole
    number, 1 or more.
    """
    values = numbers(column)
    missing = np.isnan(values)
    good = missing | ((values >= 1) & (values == np.floor(values)) & (values < 2**31))
    column.check(good, "{} is not a whole number from 1", rule)
    return np.where(missing, 0.0, values).astype(np.int64)


def labels(column: Column) -> tuple[Ints, tuple[str, ...]]:
    """Labels of a column, in order of first appearance.

    Returns the index of the label of each cell, and the labels. Raises TableError at the first cell
    that is empty, or a number that is written in two ways.
    """
    cells = [str(cell) for cell in column.cells]
    place = {name: index for index, name in enumerate(dict.fromkeys(cells))}
    if "" in place:
        raise column.refuse(cells.index(""), "{} is empty", f"write the {column.role} in every row")
    for name, other in written_otherwise(place).items():
        remedy = f"write each {column.role} in one way"
        raise column.refuse(cells.index(name), f"{{}} is {shown(other)} in another row", remedy)
    return np.array([place[cell] for cell in cells], dtype=np.int64), tuple(place)


def written_otherwise(labels: Collection[str]) -> dict[str, str]:
    """Find labels that are the number of another one, as programs write it that know no label.

    Each label with a point or with zeros before it, and the one without.

    Examples
    --------
    >>> written_otherwise(["1", "2", "1.0", "007", "7", "03", "2.10"])
    {'1.0': '1', '007': '7'}
    """
    plain = {name: match[1] for name in labels if (match := _WHOLE.fullmatch(name))}
    return {name: number for name, number in plain.items() if name != number and number in plain}


def _floats(column: Column) -> list[float]:
    cells: list[str] = list(column.cells)
    other = "," if column.decimal == "." else "."
    text = "".join(cells)
    if not (other in text or "_" in text):
        with suppress(ValueError):  # all are plain numbers, in most tables
            return [float(cell.replace(column.decimal, ".")) for cell in cells]
    values = []
    for index, cell in enumerate(cells):
        try:
            values.append(_float(cell, column.decimal, other))
        except ValueError:
            raise _not_a_number(column, index) from None
    return values


def refuse_thousands(columns: Sequence[Column]) -> None:
    """Refuse outputs whose decimal mark is one of thousands.

    The columns are of the same rows; what the engine has read already does not count.
    """
    written = [own for own in columns if not isinstance(own.cells, np.ndarray)]
    place = first_in_groups(chain.from_iterable(own.cells for own in written))
    if place is not None:
        which, row = divmod(place, len(written[0].cells))
        column = written[which]
        problem = f"{{}} is one of numbers without decimals or with three: {column.decimal!r} is no"
        remedy = "write numbers without thousands marks"
        raise column.refuse(row, f"{problem} decimal mark", remedy)


def _float(cell: str, decimal: str, other: str) -> float:
    if cell.casefold() in MISSING:
        return math.nan
    if other in cell or "_" in cell:
        raise ValueError(cell)
    number = with_hyphen(cell.replace(decimal, "."))
    try:
        return float(number)
    except ValueError:
        return float(without_blanks(number))


def _not_a_number(column: Column, index: int) -> TableError:
    cell = str(column.cells[index])
    if cell.casefold() == column.heading.casefold():
        remedy = "keep one table in a file, or tell several apart by a column serial or run"
        return column.refuse(index, "the column headings stand here again", remedy)
    if column.role == "time" and _PARTED.match(cell):
        remedy = "write it as 2024-05-31T14:30:00, where nobody takes the day for the month"
        return column.refuse(index, "{} is no date that can be read", remedy)
    if re.fullmatch(r"[+-]?[0-9]*[.,][0-9.,]*", cell):
        problem = f"{{}} does not fit the decimal mark {column.decimal!r}"
        remedy = "write numbers without thousands marks and with one decimal mark"
        return column.refuse(index, problem, remedy)
    if column.role == "position" and _IN_G.fullmatch(cell):
        remedy = "write a column angle: +1 g is 0 deg, -1 g is 180, and 0 g is 90 or 270"
        return column.refuse(index, "{} is no number of a position", remedy)
    usual = "write a number, or nothing where it is missing"
    return column.refuse(index, "{} is not a number", _REMEDIES.get(column.role, usual))
