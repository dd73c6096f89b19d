"""Outputs that are no readings: what loggers write for a missing one, and what is far too large."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from accelcal.arrays import Array, Ints
from accelcal.io.values.cells import Column

MARKERS = (
    *(999.0, 9999.0, 99999.0, 999999.0, 999.9, 999.99, 9999.9, 9999.99, 999.25),
    *(9.9e37, 9.91e37, 1e38, 1e20, 1e30, 3.4028235e38, float(np.finfo(np.float32).max)),
)
"""Sizes of what loggers write for a missing reading; those of voltmeters are by SCPI 1999, for an
overload and for what is not a number, and that of the 3458A, which is older."""

_FAR = 10.0
"""One of `MARKERS` is no reading where it is so many times the largest other output."""

FARTHEST = 1e4
"""Nor is any output, most likely, that is so many times the largest other one."""


def refuse_markers(columns: Iterable[Column], outputs: Array) -> None:
    """Refuse -9999 and the like, as loggers write for a missing reading, far outside the others."""
    marker = np.isin(np.abs(outputs), MARKERS)
    size = np.abs(outputs[~marker & ~np.isnan(outputs)]).max(initial=0.0)
    if not marker.any() or size == 0.0:
        return
    far = marker & (np.abs(outputs) / _FAR > size)  # no product, which could overflow
    for column, wrong in zip(columns, far.T, strict=True):
        problem = "{} looks like a marker of a missing reading"
        column.check(~wrong, problem, "leave the cell empty")


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
