"""Rows of results as pandas frames, with the unit of each column."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

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
_OF_A_QUANTITY = (
    "value",
    "standard_uncertainty",
    "expanded_uncertainty",
    "line",
    "floor",
    *_LIMITS,
)


def frame_of(rows: Sequence[Mapping[str, Any]], **units: str) -> pd.DataFrame:
    """Make a frame of rows.

    Parameters
    ----------
    rows : sequence of mapping
        A row each, with the same keys.
    **units : str
        Units of columns whose names do not tell them.

    Returns
    -------
    pandas.DataFrame
        ``frame.attrs["units"]`` maps columns to units; ``"unit"`` means the unit in that column of
        the same row.

    Examples
    --------
    >>> frame = frame_of([{"temperature_degC": 20.0, "value": 3e-3, "unit": "g"}])
    >>> frame.attrs["units"]
    {'temperature_degC': 'degC', 'value': 'unit'}
    """
    import pandas as pd

    frame = pd.DataFrame(list(rows))
    known: dict[str, str] = {}
    for column in map(str, frame.columns):
        if column in _OF_A_QUANTITY and "unit" in frame.columns:
            known[column] = "unit"
        for suffix, unit in _SUFFIXES.items():
            if column.endswith(suffix):
                known.setdefault(column, unit)
    numbers = (frame[name] for name in {*known, *units, "dof"} if name in frame)
    unknown = {column.name: float for column in numbers if column.isna().all()}
    frame = frame.astype(unknown)  # NaN in place of None, which neither compares nor adds
    frame.attrs["units"] = known | units
    return frame
