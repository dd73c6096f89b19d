"""Temperatures of a table: in degC, whatever scale its heading, its cells or a header line name."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from accelcal.arguments.temperatures import NO_TEMPERATURE, outside_tests
from accelcal.arrays import Array, Ints
from accelcal.io.values.cells import Column, numbers
from accelcal.units import celsius, scale_of


def temperatures_of(column: Column) -> Array:
    """Temperatures of a column, NaN where they are not known [degC].

    Raises TableError at the first cell that is empty, no number, or hardly a temperature of a test.
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

    Raises TableError at the first.
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


LONE = 5.0
"""A temperature stands alone where it is as many times the range of all others away from them."""

FARTHEST_ALIKE = 1.0
"""A temperature this near to another is not alone, as thermometers may have steps [degC]."""

FEWEST_OTHERS = 8
"""Rows of a run of whose temperatures one may be told to stand alone."""


def notes_of_lone(temperature: Array, run: Ints, line: Ints, labels: Sequence[str]) -> list[str]:
    """Name a temperature that is far from all others of its run, as one with a wrong digit.

    Temperatures are in degC, and `run` counts the labels.

    Examples
    --------
    >>> temperature, line = np.array([20.0] * 8 + [29.5]), np.arange(2, 11)
    >>> for note in notes_of_lone(temperature, np.zeros(9, dtype=int), line, ["1"]):
    ...     print(note)
    temperature 29.5 degC (line 10) is far from all others of run 1, 20 to 20 degC: is it right?
    """
    ends = np.cumsum(np.bincount(run, minlength=len(labels)))[:-1]
    runs = np.split(np.argsort(run, kind="stable"), ends)
    pairs = zip(runs, labels, strict=True)
    return [said for own, label in pairs for said in _lone_of(temperature[own], line[own], label)]


def _lone_of(temperature: Array, line: Ints, label: str) -> Iterator[str]:
    rows, first = np.unique(line, return_index=True)
    if rows.size <= FEWEST_OTHERS:
        return
    order = first[np.argsort(temperature[first])]
    own = temperature[order]
    for at, others in ((0, own[1:]), (-1, own[:-1])):
        away, span = abs(own[at] - others[at]), others[-1] - others[0]
        if away > max(LONE * span, FARTHEST_ALIKE):
            yield (
                f"temperature {own[at]:.10g} degC (line {line[order[at]]}) is far from all others"
                f" of run {label}, {others[0]:.10g} to {others[-1]:.10g} degC: is it right?"
            )
