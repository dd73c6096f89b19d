"""Warnings of the records of a stack: the cells of a column, without making each calibration."""

from __future__ import annotations

from accelcal.archive.rows import JOINT
from accelcal.calibrate.stack import CalibrationStack

__all__ = ["warning_cells"]


def warning_cells(stack: CalibrationStack) -> list[str]:
    """Join the sentences of each table and its record.

    Parameters
    ----------
    stack : CalibrationStack
        R records of t tables, none of them alone.

    Returns
    -------
    list of str
        R * t cells, record after record.
    """
    warned = stack.warnings
    said = [JOINT.join(own) for own in warned.of_record]
    tables = zip(*warned.of_tables, strict=True)
    return [
        JOINT.join((*own, of_record)) if own else of_record
        for of_record, of_each in zip(said, tables, strict=True)
        for own in of_each
    ]
