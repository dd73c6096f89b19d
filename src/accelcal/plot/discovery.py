"""Pictures of a discovery, as ``discovery.plot``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from accelcal.plot.pictures import Pictures

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from accelcal.record import TumbleRecord
    from accelcal.results.discovery import Discovery

__all__ = ["DiscoveryPlot"]


@dataclass(frozen=True, slots=True)
class DiscoveryPlot(Pictures):
    """Pictures of a discovery.

    Each method draws into the matplotlib axes that it is given, or makes a figure of its own, and
    returns the axes; ``ax.figure`` is the figure. `accelcal.plot.style.theme` chooses dark colours.

    Attributes
    ----------
    discovery : Discovery
        The discovery.

    Examples
    --------
    >>> import accelcal
    >>> record = accelcal.simulate(effects=[accelcal.effect("backlash").of(5e-5)], seed=1)
    >>> accelcal.discover(record).plot.gap().get_ylabel()
    'gap, rms [µg]'
    """

    discovery: Discovery

    def gap(self, ax: Axes | None = None) -> Axes:
        """Draw the gap between model and readings, effect by effect, fitted and held out.

        Parameters
        ----------
        ax : Axes, optional
            Axes to draw into.

        Returns
        -------
        Axes
            The dashed line is the noise of a reading.
        """
        from accelcal.plot.gap import gap

        return gap(self.discovery, ax)

    def where(self, ax: Axes | None = None) -> Axes:
        """Draw which factors of the test have the disagreement.

        Parameters
        ----------
        ax : Axes, optional
            Axes to draw into.

        Returns
        -------
        Axes
            Shares of the sum of squares, with the chance that each is noise.
        """
        from accelcal.plot.gap import where

        return where(self.discovery.where, self.discovery.alpha, ax)

    def signature(
        self, record: TumbleRecord, effect: str | None = None, ax: Axes | None = None
    ) -> Axes:
        """Draw the action of an effect over the residuals that it explains.

        Parameters
        ----------
        record : TumbleRecord
            The readings in which it was found.
        effect : str, optional
            Its id; the first one found without it.
        ax : Axes, optional
            Axes to draw into.

        Returns
        -------
        Axes
            Points are the readings less the model without this effect.

        Raises
        ------
        InputError
            If no such effect was found, or the record does not suit the discovery.
        """
        from accelcal.plot.signature import signature

        return signature(self.discovery, record, effect, ax)

    def changes(self, ax: Axes | None = None) -> Axes:
        """Draw what the effects change in the coefficients.

        Parameters
        ----------
        ax : Axes, optional
            Axes to draw into.

        Returns
        -------
        Axes
            Coefficients without and with the effects, in 95 % half widths of the fit without them;
            those are named unchanged that the effects leave as they were.
        """
        from accelcal.plot.gap import changes

        return changes(self.discovery, ax)
