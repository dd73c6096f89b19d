"""Pictures of a stability test, as ``stability.plot``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from accelcal.results.stability import Stability
    from accelcal.stability.record import StabilityRecord

__all__ = ["StabilityPlot"]


@dataclass(frozen=True, slots=True)
class StabilityPlot:
    """Pictures of a stability test.

    Each method draws into the matplotlib axes that it is given, or makes a figure of its own, and
    returns the axes; ``ax.figure`` is the figure. `accelcal.plot.style.theme` chooses dark colours.

    Attributes
    ----------
    stability : Stability
        The analysis.
    """

    stability: Stability

    def allan(self, ax: Axes | None = None) -> Axes:
        """Draw the overlapping Allan deviation with its band, and the noise terms in it.

        Parameters
        ----------
        ax : Axes, optional
            Axes to draw into.

        Returns
        -------
        Axes
            Logarithmic axes.
        """
        from accelcal.plot.allan import allan

        return allan(self.stability, ax)

    def record(self, record: StabilityRecord, ax: Axes | None = None) -> Axes:
        """Draw the bias in each launch with its trend line.

        Parameters
        ----------
        record : StabilityRecord
            The record that was analysed.
        ax : Axes, optional
            Axes to draw into.

        Returns
        -------
        Axes
            Time since the start of each launch, and bias less the mean of all launches.
        """
        from accelcal.plot.allan import bias_in_time

        return bias_in_time(self.stability, record, ax)
