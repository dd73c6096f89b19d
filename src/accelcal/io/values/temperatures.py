"""Temperatures of a table: in degC, whatever scale its heading, its cells or a header line name."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from accelcal.arguments.temperatures import NO_TEMPERATURE, outside_tests
from accelcal.arrays import Array
from accelcal.io.values.cells import Column, numbers
from accelcal.units import celsius, scale_of


def temperatures_of(column: Column) -> Array:
    """Temperatures of a column, NaN where they are not known [degC].

    Raises
    ------
    TableError
        At the first cell that is empty, no number, or hardly a temperature of a test.
    """
    values = numbers(column)
    blank = np.isnan(values)
    if not isinstance(column.cells, np.ndarray):
        blank = np.array([cell == "" for cell in column.cells])
    column.check(~blank, "{} is empty", "write it in every row, 'unknown' where it is not known")
    refuse_other_temperatures(column, values)
    return values


def refuse_other_temperatures(column: Column, values: Array) -> None:
    """Refuse what is hardly a temperature in degC, such as one of another scale or a marker.

    Raises
    ------
    TableError
        At the first.
    """
    right = "write temperatures in degC, or with their unit, as in T [K]"
    if scale_of(column.unit) != "degC":
        right = f"they are in {column.unit}, by their heading or cells: correct the unit"
    column.check(~outside_tests(values), f"{{}} {NO_TEMPERATURE}", right)


def notes_of_scale(column: Column | None) -> Iterator[str]:
    """Say of which scale temperatures were converted, with the first one before and after.

    Examples
    --------
    >>> cells, lines = ["unknown", "296.45"], np.arange(2)
    >>> list(notes_of_scale(Column("temperature", "T [K]", "K", cells, lines, "a.csv")))
    ['temperatures are converted from K to degC, the first from 296.45 K to 23.3 degC']
    """
    if column is None or scale_of(column.unit) == "degC":
        return
    values, unit = numbers(column._replace(unit=None)), column.unit
    known = values[~np.isnan(values)]
    if known.size:
        first = f"{known[0]:.10g} {unit} to {float(celsius(known[0], unit)):.10g} degC"
        yield f"temperatures are converted from {unit} to degC, the first from {first}"
