"""Pictures of a comparison, as ``disagreement.plot``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from accelcal.plot.pictures import Pictures

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from accelcal.record import TumbleRecord
    from accelcal.results.calibration import Calibration
    from accelcal.results.disagreement import Disagreement

__all__ = ["DisagreementPlot"]


@dataclass(frozen=True, slots=True)
class DisagreementPlot(Pictures):
    """Pictures of a comparison.

    Each method draws into the matplotlib axes that it is given, or makes a figure of its own, and
    returns the axes; ``ax.figure`` is the figure. `accelcal.plot.style.theme` chooses dark colours.

    Attributes
    ----------
    disagreement : Disagreement
        The comparison.

    Examples
    --------
    >>> import accelcal
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> found = accelcal.compare(calibration, accelcal.simulate(seed=2))
    >>> found.plot.where().get_xlabel()
    'share of the disagreement [%]'
    """

    disagreement: Disagreement

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
        from accelcal.results.disagreement import ALPHA

        return where(self.disagreement.where, ALPHA, ax)

    def runs(self, axes: Any = None) -> Any:
        """Draw what has changed in each run since the calibration.

        Parameters
        ----------
        axes : array-like of Axes, optional
            Three axes to draw into.

        Returns
        -------
        ndarray of Axes, shape (3,)
            Changes of bias, scale factor and misalignment with 95 % intervals.
        """
        from accelcal.plot.coefficients import run_changes

        return run_changes(self.disagreement, axes)

    def residuals(
        self, calibration: Calibration, record: TumbleRecord, ax: Axes | None = None
    ) -> Axes:
        """Draw reading minus simulation by head angle, forward and back strokes apart.

        Parameters
        ----------
        calibration : Calibration
            The calibration that was compared.
        record : TumbleRecord
            The readings that were compared.
        ax : Axes, optional
            Axes to draw into.

        Returns
        -------
        Axes
            Points are readings; bars are their means by angle and direction with 95 % intervals.

        Raises
        ------
        InputError
            If the record does not suit the calibration.
        """
        from accelcal.plot.residuals import simulation_residuals

        return simulation_residuals(calibration, record, ax)
