"""Columns of the two frames of a batch: what each holds, in which unit, and their cells."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from accelcal.arrays import Array, Labels, Places
from accelcal.model import COEFFICIENTS, ERROR_TERMS, ERROR_UNITS, coefficient_unit
from accelcal.results.tabular import gate_column, gate_of_column

if TYPE_CHECKING:
    import pandas as pd

_GATES = (
    *("closure", "drift", "forward against back", "order of positions", "outlier"),
    *("proportions", "resolution", "units", "lack of fit", "agreement of tables"),
)
"""Gates of each table, in their order, and behind them the last two of the record."""

_PARTS = (
    ("", "{}"),
    ("_standard_uncertainty", "standard uncertainty of {}"),
    ("_expanded_uncertainty", "half width of the 95 % interval of {}"),
)


class FrameColumn(NamedTuple):
    """A column of a frame."""

    name: str  # its heading
    kind: str  # ``"text"``, ``"number"``, ``"whole"`` or ``"flag"``
    unit: str  # of its numbers; empty where they have none
    told: str  # what it holds, in a few words


def _of_quantity(name: str, unit: str) -> Iterator[FrameColumn]:
    for suffix, told in _PARTS:
        yield FrameColumn(name + suffix, "number", unit, told.format(name))
    told = f"effective degrees of freedom of that interval of {name}; empty where infinite"
    yield FrameColumn(f"{name}_dof", "number", "", told)


_WHERE = (
    FrameColumn("source", "text", "", "file or URL that the readings come from"),
    FrameColumn("line", "whole", "", "line of the source with the first reading"),
    FrameColumn("serial", "text", "", "serial number of the accelerometer"),
)

_OF_TABLE = (
    *_WHERE,
    FrameColumn("run", "text", "", "visit to a temperature"),
    FrameColumn("mounting", "text", "", "o+, o-, p+ or p-"),
    FrameColumn("date", "text", "", "date of the test, as written"),
    FrameColumn("lot", "text", "", "lot of the unit, from a line '# lot:' or a column"),
    FrameColumn("temperature_degC", "number", "degC", "mean temperature of the run"),
    FrameColumn("readings", "whole", "", "number of readings"),
    FrameColumn("dof", "whole", "", "readings minus coefficients"),
    FrameColumn("output_unit", "text", "", "unit of the output"),
    FrameColumn("residual_rms", "number", "output_unit", "root of the squared residuals over dof"),
    *(
        c
        for name in COEFFICIENTS
        for c in _of_quantity(name, coefficient_unit(name, "output_unit"))
    ),
    *(c for name in ERROR_TERMS.values() for c in _of_quantity(name, ERROR_UNITS[name])),
    FrameColumn("stands_for", "text", "", "what a coefficient holds besides itself, at few angles"),
    *(FrameColumn(gate_column(g), "text", "", f"gate {g}") for g in _GATES),
    FrameColumn(
        "warnings",
        "text",
        "",
        "what to know first, and what gates warn of, joined by ' | '",
    ),
    FrameColumn("notes", "text", "", "what the reader set aside or assumed, joined by ' | '"),
    FrameColumn("verdict", "text", "", "outcome against the data sheet, of the whole record"),
    FrameColumn("failed_limits", "text", "", "limits of the data sheet that failed"),
    FrameColumn("method", "text", "", "estimator"),
    FrameColumn("robust", "flag", "", "guarded against outliers"),
    FrameColumn("g_local_m_s2", "number", "m/s^2", "local gravity, where given"),
    FrameColumn("T0_degC", "number", "degC", "reference temperature"),
    FrameColumn("delta0_rad", "number", "rad", "fixture angle taken as given"),
    FrameColumn("software", "text", "", "name and version of what fitted"),
    FrameColumn("sha256", "text", "", "SHA-256 of the source; empty for a large table in parts"),
)

_OF_LAW = (
    *_WHERE,
    FrameColumn("mounting", "text", "", "mounting whose tables make the laws"),
    FrameColumn("date", "text", "", "date of the test, as written"),
    FrameColumn("coefficient", "text", "", "k0, K1 or delta at_T0, above or below; or hysteresis"),
    FrameColumn("value", "number", "unit", "its value"),
    FrameColumn("standard_uncertainty", "number", "unit", "its standard uncertainty"),
    FrameColumn("expanded_uncertainty", "number", "unit", "half width of its 95 % interval"),
    FrameColumn("dof", "number", "", "degrees of freedom of the interval; empty where infinite"),
    FrameColumn("unit", "text", "", "unit of the value"),
    FrameColumn("T0_degC", "number", "degC", "reference temperature"),
    FrameColumn("warnings", "text", "", "what is missing in the laws, and why"),
    FrameColumn("software", "text", "", "name and version of what fitted"),
)

ROWS: Mapping[str, FrameColumn] = {column.name: column for column in _OF_TABLE}
"""Columns of the frame of tables: a row a serial, run and mounting."""

LAWS: Mapping[str, FrameColumn] = {column.name: column for column in _OF_LAW}
"""Columns of the frame of temperature laws: a row a record and term."""

ERRORS = ("source", "message")
"""Columns of the list of what could not be read or fitted."""


Cells = Array | Labels[Any]
"""Cells of a column: numbers, NaN where there is none, or labels."""

Columns = dict[str, Cells]
"""Cells of a frame by the name of the column."""


def no_rows(kinds: Mapping[str, FrameColumn]) -> Columns:
    """Make a frame without rows."""
    return {
        name: np.zeros(0) if column.kind == "number" else Labels.of([])
        for name, column in kinds.items()
    }


def put_together(parts: Sequence[Columns], order: Places | None = None) -> Columns:
    """Put parts of a frame below each other.

    The parts, one or more, have the same columns. `order` has the place in that frame of each row
    that is wanted; by default all are, as they come.
    """
    return {name: _joined([part[name] for part in parts], order) for name in parts[0]}


def _joined(parts: Sequence[Cells], order: Places | None) -> Cells:
    rows = slice(None) if order is None else order
    labels = [part for part in parts if isinstance(part, Labels)]
    if labels:
        return Labels.joined(labels).taken(rows)
    return np.concatenate([part for part in parts if not isinstance(part, Labels)])[rows]


# -- in a notebook ---------------------------------------------------------------------------------


_IN_NOTEBOOK = (
    *("source", "serial", "run", "mounting", "date", "temperature_degC"),
    *("K1", "K1_expanded_uncertainty", "k0", "k0_expanded_uncertainty"),
    *("coefficient", "value", "expanded_uncertainty", "unit", "message"),
)
"""Columns of the frames that a notebook shows; K1 and k0 stand for the coefficients."""


def in_notebook(frame: pd.DataFrame) -> pd.DataFrame:
    """Take what a notebook shows of a frame: some columns, and of the gates those that warn."""
    shown, names = frame.filter(items=_IN_NOTEBOOK), frame.columns.to_series().map(gate_of_column)
    names = names[names != ""] + ", "
    if names.empty:
        return shown
    warned = (frame[names.index] == "warn").dot(names)
    return shown.assign(**{"gates that warn": warned.str.removesuffix(", ")})
