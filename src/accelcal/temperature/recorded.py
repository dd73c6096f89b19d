"""Temperatures as records have them: reading by reading, table by table, and what they refer to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array


class RecordedTemperatures(NamedTuple):
    """Temperatures of R records of one plan.

    Attributes
    ----------
    readings : sequence of ndarray, shape (R, n)
        Temperatures of the readings of each table, those unknown at their mean [degC].
    levels : ndarray, shape (R, tables)
        Mean temperature of each table; NaN where unknown [degC].
    reference : ndarray, shape (R,)
        T0; NaN where there is none [degC].
    """

    readings: Sequence[Array]
    levels: Array
    reference: Array

    @property
    def rise(self) -> Array:
        """Level of each table above T0, shape (R, tables) [degC]."""
        return self.levels - self.reference[:, None]

    @property
    def span(self) -> Array:
        """Range of the readings' temperatures in each table, shape (R, tables) [degC]."""
        return np.stack([np.ptp(own, axis=1) for own in self.readings], axis=1)
