"""The serial number of a file that is of one instrument: as its header line and column have it."""

from __future__ import annotations

import numpy as np

from accelcal.arguments.kinds import shown
from accelcal.errors import TableError
from accelcal.io.declarations import notes_of_serial
from accelcal.io.layout.parts import Layout
from accelcal.io.values.cells import Column, labels


def serial_of_file(
    layout: Layout, column: Column | None, given: str | None, remedy: str
) -> tuple[str | None, tuple[str, ...]]:
    """Tell the one serial number of a file.

    That of the caller takes the place of that of the file, and a note says so. The remedy tells
    what to do where the file has several.

    Raises
    ------
    TableError
        If the file has several, or a cell of the column is empty.
    """
    found = _lines_of_serials(layout, column)
    if len(found) > 1:
        problem = f"serials {shown(', '.join(found))} in one record"
        raise TableError(problem, remedy, source=layout.source, line=list(found.values())[1])
    written = next(iter(found), None)
    return given or written, notes_of_serial(given, written)


def _lines_of_serials(layout: Layout, column: Column | None) -> dict[str, int]:
    """Line of each serial number where it first stands."""
    header = layout.declared.get("serial")
    found = {header.value: header.line} if header and header.value else {}
    if column and any(column.cells):
        index, names = labels(column)
        first = np.unique(index, return_index=True)[1]
        found = dict(zip(names, column.lines[first].tolist(), strict=True)) | found
    return dict(sorted(found.items(), key=lambda own: own[1]))
