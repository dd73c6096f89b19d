"""Outputs that are no readings: what loggers write for a missing one, and what is far too large."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from accelcal.arrays import Array, Ints, Mask
from accelcal.errors import TableError
from accelcal.io.values.cells import Column
from accelcal.io.words.wording import all_outputs

_NINES = (999.0, 9999.0, 99999.0, 999999.0, 999.9, 999.99, 9999.9, 9999.99, 999.25)
"""Sizes of what loggers write for a missing reading."""

_LARGEST = 1e20
"""Outputs from here on are markers: 9.9e37 and 9.91e37 of voltmeters by SCPI 1999, 1e38 of the
3458A, the largest number of 32 bits, or one of these with a digit lost."""

_FAR = 10.0
"""A marker is no reading where it is so many times the largest other output."""

FARTHEST = 1e4
"""Nor is any output, most likely, that is so many times the largest other one."""


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
