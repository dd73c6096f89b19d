"""Visits to attitudes, and the noise of a channel that those tell in which it points up or down.

An error of the attitude does not act on a channel along gravity, so what repeated visits to such an
attitude scatter by is the noise of the channel alone: with what changes from visit to visit, and
without the errors of attitudes, which are most of what is left elsewhere.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Labels
from accelcal.numerics.decimal_steps import decimal_steps
from accelcal.triad.record import TriadRecord, names_of, places_of

_ALONG = 0.01
"""Share of an error of the attitude, in its square, that a channel feels at most: 6 deg."""


class Noise(NamedTuple):
    """Noise of a channel in one visit [output unit^2]."""

    variance: float  # of the output
    rounding: float  # that of rounding, which all visits to an attitude may have in common
    dof: float  # degrees of freedom; 0 where nothing tells it


class Visits(NamedTuple):
    """Rows that follow each other in one attitude, averaged.

    Attributes
    ----------
    output : ndarray, shape (v, 3)
        Outputs [output unit].
    up : ndarray, shape (v, 3)
        Acceleration along the axes of the block [g].
    share : ndarray, shape (n,)
        What the variance of a visit is worth in the mean of all rows of each attitude.
    steps : ndarray, shape (3,)
        Decimal step in which the outputs come [output unit].
    """

    output: Array
    up: Array
    share: Array
    steps: Array

    @classmethod
    def of(cls, record: TriadRecord) -> Visits:
        """Find the visits of a record whose attitudes are known, a row each.

        Examples
        --------
        >>> up = np.eye(3)[[0, 0, 1, 2, 0]]
        >>> found = Visits.of(TriadRecord(np.arange(15.0).reshape(5, 3), up))
        >>> found.output[:, 0].tolist(), found.share.round(3).tolist()
        ([1.5, 6.0, 9.0, 12.0], [0.556, 1.0, 1.0])
        """
        if record.up is None:
            raise ValueError("visits of attitudes that are not known")
        number = Labels.of(names_of(record)).code
        start = np.flatnonzero(np.diff(number, prepend=-1))
        rows = np.diff(start, append=len(number))
        output, up = (np.add.reduceat(a, start) / rows[:, None] for a in (record.output, record.up))
        whole, squares = (np.bincount(number[start], weights=rows**power) for power in (1, 2))
        return cls(output, up, np.asarray(squares / whole**2), decimal_steps(record.output.T))

    def noise(self, sensitivity: Array) -> list[Noise]:
        """Noise of the channels, with S of y = b + S a, by visits in which each is up or down."""
        felt = self.up @ sensitivity.T
        along = np.abs(felt) >= np.sqrt(1.0 - _ALONG) * np.linalg.norm(sensitivity, axis=1)
        left = self.output - felt
        rounding = (self.steps**2 / 12.0).tolist()
        found = [_scatter(left[own, i], self.up[own]) for i, own in enumerate(along.T)]
        return [
            Noise(squares / max(dof, 1.0), step, dof)
            for (squares, dof), step in zip(found, rounding, strict=True)
        ]


def _scatter(values: Array, up: Array) -> tuple[float, float]:
    """Sum of squares about the means of directions, and its degrees of freedom."""
    place = np.array(places_of(up), dtype=np.intp)
    number = np.bincount(place)
    off = values - (np.bincount(place, weights=values) / np.maximum(number, 1))[place]
    return float(off @ off), float(values.size - number.size)
