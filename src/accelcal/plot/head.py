"""Pictures of a head, as ``head.plot``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from accelcal.numerics.probability import NORMAL_FACTOR
from accelcal.plot.style import Pictures, canvas, entitled, palette, styled
from accelcal.results.head_calibration import HeadCalibration
from accelcal.shown_units import readable

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["HeadPlot"]


class HeadPlot(Pictures[HeadCalibration]):
    """Pictures of a head."""

    __slots__ = ()

    @styled
    def errors(self, ax: Axes | None = None) -> Axes:
        """Draw the error of each position with its 95 % interval.

        Parameters
        ----------
        ax : Axes, optional
            Axes to draw into.

        Returns
        -------
        Axes
            Errors, true minus nominal, by the graduation. A band shows what was declared of a
            position before any reading.
        """
        head, colours = self.result, palette()
        half = np.array([each.expanded_uncertainty for each in head.quantities()], dtype=float)
        factor, unit = readable("rad", head.errors, half)
        ax = canvas(ax, (6.4, 3.8))
        if head.declared_uncertainty_rad is not None:
            band = factor * NORMAL_FACTOR * head.declared_uncertainty_rad
            name = "declared, 95 %"
            ax.axhspan(-band, band, color=colours.series[1], alpha=0.15, lw=0, label=name)
        ax.axhline(0.0, color=colours.muted, lw=0.8)
        ax.errorbar(
            head.angles_deg,
            factor * np.array(head.errors),
            factor * half,
            marker="o",
            ls="",
            color=colours.series[0],
            label="error, 95 %",
        )
        ax.set(xlabel="graduation of the head [deg]", ylabel=f"true minus nominal [{unit}]")
        ax.set_xticks(np.arange(0.0, 361.0, 45.0))
        entitled(ax, f"Errors of {len(head.errors)} positions")
        return ax
