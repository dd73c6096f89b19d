"""The serial number of a file that is of one instrument: as its header line and column have it."""

from __future__ import annotations

from accelcal.arguments.kinds import shown
from accelcal.io.cells import Column, labels
from accelcal.io.declarations import notes_of_serial
from accelcal.io.layout import Layout


def serial_of_file(
    layout: Layout, column: Column | None, given: str | None, remedy: str
) -> tuple[str | None, tuple[str, ...]]:
    """Tell the one serial number of a file.

    Parameters
    ----------
    layout : Layout
        The table.
    column : Column or None
        Its column of serial numbers.
    given : str or None
        The serial number that the caller declares, which takes the place of that of the file.
    remedy : str
        What to do where the file has several.

    Returns
    -------
    serial : str or None
        The serial number; None where nothing tells it.
    notes : tuple of str
        That the file has another one, where it is so.

    Raises
    ------
    TableError
        If the file has several, or a cell of the column is empty.
    """
    names = labels(column)[1] if column and any(column.cells) else ()
    header = layout.declared.get("serial")
    found = tuple(dict.fromkeys((*names, *((header.value,) if header and header.value else ()))))
    if len(found) > 1:
        raise layout.refuse(f"serials {shown(', '.join(found))} in one record", remedy)
    written = found[0] if found else None
    return given or written, notes_of_serial(given, written)
