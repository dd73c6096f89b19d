"""Results as texts and as tidy tables, frames with the units of their columns."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["TabularResult", "frame_of"]


class TabularResult(ABC):
    """A result that is a tidy table."""

    __slots__ = ()

    _COLUMNS: ClassVar[Sequence[str]] = ()
    """Keys of `rows`, of a result that may have none."""

    @abstractmethod
    def rows(self) -> list[dict[str, Any]]:
        """List what was found, a flat dictionary a row."""

    def to_frame(self) -> pd.DataFrame:
        """Tabulate the result.

        Returns
        -------
        pandas.DataFrame
            A line each of `rows`. ``frame.attrs["units"]`` maps columns to units; ``"unit"`` is the
            unit in the column ``unit`` of the same line. The column ``coefficient`` has the symbols
            of (1) and (2), ``quantity`` other names.
        """
        return frame_of(self.rows(), self._COLUMNS)

    def __str__(self) -> str:
        """Text by ``text`` of the module of `accelcal.report` that is called as this one."""
        own = import_module(type(self).__module__.replace(".results.", ".report."))
        text: str = own.text(self)
        return text

    def _repr_html_(self) -> str:
        from accelcal.report.notebook import in_notebook

        return in_notebook(self)


_SUFFIXES = {
    "_degC": "degC",
    "_rad": "rad",
    "_deg": "deg",
    "_m_s2": "m/s^2",
    "_s": "s",
    "_g": "g",
    "hours": "h",
}
_LIMITS = ("lower", "upper", "minimum", "maximum", "monte_carlo_low", "monte_carlo_high")
COLUMNS_OF_A_SIZE = (
    "value",
    "standard_uncertainty",
    "unit",
    "expanded_uncertainty",
    "dof",
    "p_value",
)
"""Columns of the size of an effect and of its chance, as `rows` of a discovery have them."""

_OF_A_QUANTITY = (
    "value",
    "standard_uncertainty",
    "expanded_uncertainty",
    "line",
    "floor",
    *_LIMITS,
)
_OTHER_NUMBERS = ("dof", "p_value", "E_n", "positions")
_DATES = ("date", "first", "last", "k0_last_jump_before", "K1_last_jump_before")


def frame_of(
    rows: Sequence[Mapping[str, Any]], columns: Sequence[str] = (), **units: str
) -> pd.DataFrame:
    """Make a frame of rows with the same keys; `columns` are these of a frame without any.

    Numbers are numbers, texts are texts, dates ``datetime64``, also where none is known.
    ``frame.attrs["units"]`` maps columns to units; ``"unit"`` means the unit in that column of the
    same row. `units` are those of columns whose names do not tell them.

    Examples
    --------
    >>> frame = frame_of([{"temperature_degC": 20.0, "value": 3e-3, "unit": "g"}])
    >>> frame.attrs["units"]
    {'temperature_degC': 'degC', 'value': 'unit'}
    """
    import pandas as pd

    frame = pd.DataFrame(list(rows), columns=None if rows else list(columns))
    known: dict[str, str] = {}
    for column in map(str, frame.columns):
        if column in _OF_A_QUANTITY and "unit" in frame.columns:
            known[column] = "unit"
        for suffix, unit in _SUFFIXES.items():
            if column.endswith(suffix):
                known.setdefault(column, unit)
    numbers, text = {*known, *units, *_OTHER_NUMBERS}, pd.Series([""]).dtype
    unknown = [name for name in frame if frame[name].isna().all()]
    kinds = {name: "float64" if name in numbers else text for name in unknown}
    kinds |= {name: "datetime64[us]" for name in _DATES if name in frame}
    frame = frame.astype(kinds)  # NaN in place of None, which neither compares nor adds
    frame.attrs["units"] = known | units
    return frame


_BEGIN = "gate_"


def gate_column(gate: str) -> str:
    """Name of the column of a gate.

    Examples
    --------
    >>> gate_column("lack of fit")
    'gate_lack_of_fit'
    """
    return _BEGIN + gate.replace(" ", "_")


def gate_of_column(column: str) -> str:
    """Gate of a column; empty where the column is of none."""
    name = column.removeprefix(_BEGIN)
    return "" if name == column else name.replace("_", " ")
