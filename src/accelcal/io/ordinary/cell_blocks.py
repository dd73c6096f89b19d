"""Plain cells of many tables at once: by pyarrow where it is installed, else by pandas.

Only text that both read as the general reader does gets this far: numbers without quotes, blanks
or decimal commas.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence, Set
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array, Ints, Mask
from accelcal.io.engines import BulkEngineGivesUp, read_frame
from accelcal.io.values.cells import written_otherwise
from accelcal.serials import serials_alike

_WHOLE = frozenset({"position", "stroke"})
_PLAIN = b"0123456789.,+-eE\n"
_LETTERS = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_/:()"
_LABEL = (_PLAIN + _LETTERS).translate(None, b",\n")
_NAME = b"[" + re.escape(_LABEL) + b"]++"
_NUMBER = rb"-?+(?:[0-9]++\.?+[0-9]*+|\.[0-9]++)(?:[eE][-+]?+[0-9]++)?+"


class CellBlock(NamedTuple):
    """Columns of many tables, one below the other."""

    numbers: dict[str, Array]  # columns of numbers by role
    codes: dict[str, Ints]  # columns of labels by role, as indices into `labels`
    labels: dict[str, list[str]]  # the labels of each of these columns

    def some(self, roles: Collection[str], rows: Ints | slice) -> CellBlock:
        """Return some of the rows, of the columns of some roles."""
        return CellBlock(
            {role: values[rows] for role, values in self.numbers.items() if role in roles},
            {role: codes[rows] for role, codes in self.codes.items() if role in roles},
            {role: names for role, names in self.labels.items() if role in roles},
        )

    def odd_labels(self, role: str, codes: Ints) -> Mask:
        """Mask of the labels that the general reader refuses, or may refuse beside another."""
        names = self.labels[role]
        odd = {"", *written_otherwise(names)}
        odd.update(*serials_alike(names) if role == "serial" else ())
        return np.isin(codes, [i for i, name in enumerate(names) if name in odd])

    def columns(self, roles: Collection[str]) -> list[NDArray[Any]]:
        """Return the columns of some roles, labels by their indices."""
        return [own[role] for own in (self.numbers, self.codes) for role in own if role in roles]


def read_engine(engine: str | None = None) -> str:
    """Load what to parse with: the engine that is asked for, else pyarrow where it is installed."""
    if engine is not None:
        return engine
    try:
        import pyarrow.csv  # noqa: F401
    except ImportError:
        import pandas  # noqa: F401

        return "pandas"
    return "pyarrow"


def parse_cells(body: bytes, roles: Sequence[str], labels: Set[str], engine: str) -> CellBlock:
    r"""Parse rows of plain cells.

    Cells are separated by commas, and each row is ended by a line feed. `labels` are the roles
    whose cells are text; the engine is ``"pyarrow"`` or ``"pandas"``. Raises BulkEngineGivesUp if a
    row has another number of cells, or a cell is not plain.

    Examples
    --------
    >>> block = parse_cells(b"a,1.5\nb,2\n", ["run", "output"], {"run"}, "pandas")
    >>> block.numbers["output"].tolist(), block.codes["run"].tolist(), block.labels["run"]
    ([1.5, 2.0], [0, 1], ['a', 'b'])
    """
    if body.translate(None, _PLAIN if labels.isdisjoint(roles) else _PLAIN + _LETTERS):
        raise BulkEngineGivesUp
    parse = _by_pyarrow if engine == "pyarrow" else _by_pandas
    return parse(body, roles, labels)


def is_plain(body: bytes, roles: Sequence[str], labels: Set[str]) -> bool:
    r"""Tell whether rows are such as `parse_cells` reads, and no cell is empty.

    Rows that are only rare, as with a number with a plus, are not.

    Examples
    --------
    >>> is_plain(b"a,1\n", ["run", "output"], {"run"}), is_plain(b"1\n", ["run", "output"], {"run"})
    (True, False)
    """
    return _rows_of(tuple(role in labels for role in roles)).fullmatch(body) is not None


@lru_cache(maxsize=100)
def _rows_of(is_label: tuple[bool, ...]) -> re.Pattern[bytes]:
    cells = b",".join(_NAME if label else _NUMBER for label in is_label)
    return re.compile(b"(?:" + cells + b"\n)++")


def cells_of_arrow(table: Any, roles: Sequence[str], labels: Set[str]) -> CellBlock:
    """Take the columns of an Arrow table, where they are as plain as those of `parse_cells`.

    The table has a row or more. Each number is the one of its shortest decimal form. Raises
    BulkEngineGivesUp if a cell is missing, a number has neither 64 bits nor is whole, or a label is
    not plain.
    """
    if table.num_columns != len(roles) or any(column.null_count for column in table.columns):
        raise BulkEngineGivesUp
    found = CellBlock({}, {}, {})
    for role, column in zip(roles, table.columns, strict=True):
        if role in labels:
            found.codes[role], found.labels[role] = _labels_of_arrow(column)
        else:
            found.numbers[role] = _numbers_of_arrow(column)
    return found


def _numbers_of_arrow(column: Any) -> Array:
    from pyarrow import types

    if not (types.is_float64(column.type) or types.is_integer(column.type)):
        raise BulkEngineGivesUp
    return _values_of_arrow(column.combine_chunks()).astype(np.float64, copy=False)


def _labels_of_arrow(column: Any) -> tuple[Ints, list[str]]:
    from pyarrow import string, types

    if types.is_integer(column.type):
        column = column.cast(string())
    if not types.is_dictionary(column.type):
        column = column.dictionary_encode()
    if not (
        types.is_string(column.type.value_type) or types.is_large_string(column.type.value_type)
    ):
        raise BulkEngineGivesUp
    whole = column.unify_dictionaries().combine_chunks()
    names = whole.dictionary.to_pylist()
    if None in names or "".join(names).encode().translate(None, _LABEL):
        raise BulkEngineGivesUp
    return _values_of_arrow(whole.indices).astype(np.int64), names


def _values_of_arrow(array: Any) -> NDArray[Any]:
    """Values of an array without gaps; `to_numpy` would load pandas, which takes longer."""
    return np.from_dlpack(array)


def _by_pyarrow(body: bytes, roles: Sequence[str], labels: Set[str]) -> CellBlock:
    import pyarrow as pa
    from pyarrow import csv

    whole = [role for role in roles if role in _WHOLE]
    types = dict.fromkeys(roles, pa.float64()) | dict.fromkeys(whole, pa.binary())
    types |= dict.fromkeys(labels, pa.dictionary(pa.int32(), pa.string()))
    try:
        table = csv.read_csv(
            pa.BufferReader(body),
            csv.ReadOptions(use_threads=False, block_size=len(body) + 1, column_names=list(roles)),
            csv.ParseOptions(quote_char=False, ignore_empty_lines=False),
            csv.ConvertOptions(column_types=types, null_values=[], strings_can_be_null=False),
            memory_pool=pa.system_memory_pool(),  # which keeps what is freed for the next block
        )
        numbers = {role: _numbers_of_text(table.column(role).combine_chunks()) for role in whole}
    except pa.ArrowInvalid as error:
        raise BulkEngineGivesUp from error
    others = [role for role in roles if role not in _WHOLE]
    cells = cells_of_arrow(table.select(others), others, labels)
    cells.numbers.update(numbers)
    return cells


def _numbers_of_text(cells: Any) -> Array:
    """Numbers, which mostly have one digit each: so they take less time."""
    import pyarrow as pa

    _, bounds, text = cells.buffers()
    if (np.diff(np.frombuffer(bounds, np.int32, len(cells) + 1)) == 1).all():
        digits = np.frombuffer(text, np.uint8, len(cells)) - np.uint8(ord("0"))
        if digits.max() <= 9:
            return digits.astype(np.float64)
    return _values_of_arrow(cells.cast(pa.string()).cast(pa.float64()))


def _by_pandas(body: bytes, roles: Sequence[str], labels: Set[str]) -> CellBlock:
    import pandas as pd

    row = b"," * (len(roles) - 1) + b"\n"
    if body.translate(None, _LABEL) != row * body.count(b"\n"):
        raise BulkEngineGivesUp
    places = range(len(roles))
    numeric = [i for i in places if roles[i] not in labels]
    frame = read_frame(body, ",", len(roles), places, numeric, ".")
    if frame[numeric].isna().to_numpy().any():
        raise BulkEngineGivesUp
    found = CellBlock({}, {}, {})
    for place, role in enumerate(roles):
        if role in labels:
            found.codes[role], names = pd.factorize(frame[place])
            found.labels[role] = names.tolist()
        else:
            found.numbers[role] = frame[place].to_numpy()
    return found
