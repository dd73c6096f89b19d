"""Temperatures as records have them, how well they tell the mean of a run, and readings at it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arrays import Array


class RecordedTemperatures(NamedTuple):
    """Temperatures of R records of one plan."""

    # shape (R, n): temperatures of the readings of each table, those unknown at their mean [degC]
    readings: Sequence[Array]
    levels: Array  # shape (R, tables): mean temperature of each table; NaN where unknown [degC]
    reference: Array  # shape (R,): T0; NaN where there is none [degC]

    @property
    def rise(self) -> Array:
        """Level of each table above T0, shape (R, tables) [degC]."""
        return self.levels - self.reference[:, None]

    @property
    def span(self) -> Array:
        """Range of the readings' temperatures in each table, shape (R, tables) [degC]."""
        return np.stack([np.ptp(own, axis=1) for own in self.readings], axis=1)

    @property
    def away(self) -> Array:
        """Most by which a reading's temperature is away from its level, as `span` [degC]."""
        pairs = zip(self.readings, self.levels.T, strict=True)
        return np.stack([np.abs(own - level[:, None]).max(axis=1) for own, level in pairs], axis=1)


class AtRest(NamedTuple):
    """Readings of R records at the mean temperatures of their runs."""

    # shape (R, n): readings of each table; other than before where they moved [output unit]
    outputs: tuple[Array, ...]
    # shape (R, tables): share of the recorded scatter, as a variance, that the accelerometer did
    # not feel
    unfelt: Array
    # what was done with each record, and which of its tables move still
    said: Sequence[tuple[str, ...]]

    @classmethod
    def of(cls, outputs: Sequence[Array]) -> AtRest:
        """Leave the readings as they are."""
        records = len(outputs[0])
        return cls(tuple(outputs), np.ones((records, len(outputs))), [()] * records)


def stacked_temperature_uncertainty(
    temperatures: Sequence[Array], declared: float | None, share: ArrayLike = 1.0
) -> tuple[Array, Array]:
    """Uncertainty of the mean temperature of each run of many records, and its degrees of freedom.

    It is the declared one, but not less than that of the mean of what was recorded, of shape (R, n)
    for each table; both are of shape (R, tables). Where the declared one counts, its degrees of
    freedom are infinite. Of the recorded scatter, as a variance, the accelerometer did not feel the
    share, of shape (R, tables) or less.

    Notes
    -----
    The mean of n temperatures of scatter s has the standard uncertainty s / sqrt(n). A temperature
    that stands unchanged over several readings was taken once.
    """
    changes = [np.count_nonzero(own[:, 1:] != own[:, :-1], axis=1) for own in temperatures]
    taken = 1.0 + np.stack(changes, axis=1)
    scatter = np.zeros_like(taken)  # where all are equal; std would give a rounding error
    for table, own in enumerate(temperatures):
        moves = taken[:, table] > 1.0
        if moves.any():
            scatter[moves, table] = own[moves].std(axis=1, ddof=1)
    seen = scatter * np.sqrt(np.asarray(share) / taken)
    least = declared or 0.0
    return np.maximum(seen, least), np.where(seen > least, np.maximum(taken - 1.0, 1.0), np.inf)
