"""Columns of the verdicts of gates in the frame of a batch."""

from __future__ import annotations

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
