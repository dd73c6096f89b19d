"""Readings at the mean temperature of their run: as they are, or brought there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array


class AtRest(NamedTuple):
    """Readings of R records at the mean temperatures of their runs.

    Attributes
    ----------
    outputs : tuple of ndarray, shape (R, n)
        Readings of each table; other than before where they moved [output unit].
    unfelt : ndarray, shape (R, tables)
        Share of the recorded scatter, as a variance, that the accelerometer did not feel.
    said : sequence of tuple of str
        What was done with each record, and which of its tables move still.
    """

    outputs: tuple[Array, ...]
    unfelt: Array
    said: Sequence[tuple[str, ...]]

    @classmethod
    def of(cls, outputs: Sequence[Array]) -> AtRest:
        """Leave the readings as they are."""
        records = len(outputs[0])
        return cls(tuple(outputs), np.ones((records, len(outputs))), [()] * records)
