"""Pictures of what several units tell of their stand, as ``stand.plot``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from accelcal.results.stand_discovery import StandDiscovery

__all__ = ["StandPlot"]


@dataclass(frozen=True, slots=True)
class StandPlot:
    """Pictures of a stand.

    Each method draws into the matplotlib axes that it is given, or makes a figure of its own, and
    returns the axes; ``ax.figure`` is the figure. `accelcal.plot.style.theme` chooses dark colours.

    Attributes
    ----------
    stand : StandDiscovery
        What was discovered.
    """

    stand: StandDiscovery

    def head(self, ax: Axes | None = None) -> Axes:
        """Draw the errors of the head positions.

        Parameters
        ----------
        ax : Axes, optional
            Axes to draw into.

        Returns
        -------
        Axes
            True minus nominal angle with 95 % intervals.
        """
        from accelcal.plot.head_and_units import head

        return head(self.stand, ax)

    def sizes(self, effect: str | None = None, ax: Axes | None = None) -> Axes:
        """Draw the size of an effect, unit by unit.

        Parameters
        ----------
        effect : str, optional
            Its id; the first one found without it.
        ax : Axes, optional
            Axes to draw into.

        Returns
        -------
        Axes
            Sizes with 95 % intervals, and the common size where all units share it.

        Raises
        ------
        InputError
            If no such effect was found.
        """
        from accelcal.plot.head_and_units import sizes

        return sizes(self.stand, effect, ax)
