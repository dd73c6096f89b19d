"""Outputs that are no readings, as loggers write for a missing one, and what no temperature is."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from accelcal.arguments.temperatures import NO_TEMPERATURE, outside_tests
from accelcal.arrays import Array, Ints, Mask
from accelcal.errors import TableError
from accelcal.io.values.cells import Column, numbers
from accelcal.units import celsius, scale_of

_NINES = (999.0, 9999.0, 99999.0, 999999.0, 999.9, 999.99, 9999.9, 9999.99, 999.25)
"""Sizes of what loggers write for a missing reading."""

_LARGEST = 1e20
"""Outputs from here on are markers: 9.9e37 and 9.91e37 of voltmeters by SCPI 1999, 1e38 of the
3458A, the largest number of 32 bits, or one of these with a digit lost."""

_FAR = 10.0
"""A marker is no reading where it is so many times the largest other output."""

FARTHEST = 1e4
"""Nor is any output, most likely, that is so many times the largest other one."""


def all_outputs(count: int) -> str:
    """Say that all outputs are something.

    Examples
    --------
    >>> all_outputs(1), all_outputs(3)
    ('the only output is', 'all 3 outputs are')
    """
    return "the only output is" if count == 1 else f"all {count} outputs are"


def are_markers(outputs: Array) -> Mask:
    """Tell which outputs are written as loggers and voltmeters do for a missing reading.

    Examples
    --------
    >>> are_markers(np.array([-9999.0, 9.9e37, 1.35, np.nan])).tolist()
    [True, True, False, False]
    """
    size = np.abs(outputs)
    if not (size >= min(_NINES)).any():
        return np.zeros(size.shape, dtype=bool)
    return np.asarray(np.isin(size, _NINES) | (size >= _LARGEST))


def refuse_markers(columns: Iterable[Column], outputs: Array) -> None:
    """Refuse -9999 and the like, as loggers write for a missing reading, far outside the others."""
    marker = are_markers(outputs)
    size = np.abs(outputs[~marker & ~np.isnan(outputs)]).max(initial=0.0)
    if not marker.any() or size == 0.0:
        return
    far = marker & (np.abs(outputs) / _FAR > size)  # no product, which could overflow
    for column, wrong in zip(columns, far.T, strict=True):
        problem = "{} looks like a marker of a missing reading"
        column.check(~wrong, problem, "leave the cell empty")


def refuse_constant(output: Array, source: str, line: Ints, why: str) -> None:
    """Refuse outputs that are all the same; a text says why they cannot be."""
    if (output == output[0]).all():
        problem = f"{all_outputs(output.size)} {output[0]:g}"
        remedy = f"check the voltmeter and the output column; {why}"
        raise TableError(problem, remedy, source=source, line=int(line[0]))


def notes_of_far(output: Array, line: Ints) -> list[str]:
    """Name an output that is far larger than all others, as one that has lost its decimal mark."""
    size = np.abs(output)
    with np.errstate(over="ignore"):
        if size.max() <= (0.5 * size).sum():  # as nearly always
            return []
    at = int(np.argmax(size))
    others = np.delete(size, at).max(initial=0.0)
    if not size[at] / FARTHEST > others > 0.0:
        return []
    told = f"output {output[at]:g} (line {line[at]})"
    return [f"{told} is more than {FARTHEST:,g} times all others: is it a reading?"]


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
