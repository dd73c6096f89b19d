"""The voltmeter and the clerk: what is written down of a current."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hidden.design import Floats


@dataclass(frozen=True)
class Readout:
    """What happens to readings behind the sensor.

    Attributes
    ----------
    resolution : float
        Step of the display, 0 for none [mA].
    outlier, outlier_at : float, int
        What is added to one reading [mA], and which, from 0.
    swapped : tuple of int
        Two readings, from 0, that were written in each other's place; empty for none.
    """

    resolution: float = 0.0
    outlier: float = 0.0
    outlier_at: int = 0
    swapped: tuple[int, ...] = ()

    def written(self, current: Floats) -> Floats:
        """What the table says of each reading [mA]."""
        written = current.copy()
        written[self.outlier_at] += self.outlier
        if self.resolution:
            written = np.round(written / self.resolution) * self.resolution
        if self.swapped:
            written[list(self.swapped)] = written[list(self.swapped[::-1])]
        return written
