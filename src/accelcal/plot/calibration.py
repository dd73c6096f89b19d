"""Pictures of a calibration, as ``calibration.plot``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from accelcal.plot import coefficients, residuals, temperature
from accelcal.plot.style import Pictures
from accelcal.results.calibration import Calibration

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["CalibrationPlot"]


class CalibrationPlot(Pictures[Calibration]):
    """Pictures of a calibration.

    Examples
    --------
    >>> import accelcal
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> calibration.plot.residuals().get_ylabel()
    'residual [µg]'
    """

    __slots__ = ()

    def residuals(self, ax: Axes | None = None, *, run: str | int | None = None) -> Axes:
        """Draw reading minus model by head angle, forward and back strokes apart.

        Parameters
        ----------
        ax : Axes, optional
            Axes to draw into.
        run : str or int, optional
            Label of one run; all of them without it.

        Returns
        -------
        Axes
            Points are readings; bars are their means by angle and direction with 95 % intervals.
            Fewer than three readings of an angle have the scatter of all angles together.

        Raises
        ------
        InputError
            If there is no such run.
        """
        return residuals.residuals(self.result, ax, run=run)

    def residual_map(self, ax: Axes | None = None) -> Axes:
        """Draw reading minus model as a heat map, head angle by stroke, run beside run.

        Parameters
        ----------
        ax : Axes, optional
            Axes to draw into.

        Returns
        -------
        Axes
            A column for each stroke of each run; hatched where there is no reading.
        """
        return residuals.residual_map(self.result, ax)

    def tumble(self, ax: Axes | None = None, *, run: str | int | None = None) -> Axes:
        """Draw reading minus model round the turn.

        Parameters
        ----------
        ax : Axes, optional
            Axes of ``projection="polar"`` to draw into.
        run : str or int, optional
            Label of one run; all of them without it.

        Returns
        -------
        Axes
            The bold circle is zero; means by angle with 95 % bands, forward and back.

        Raises
        ------
        InputError
            If there is no such run, or the axes are not polar.
        """
        return residuals.tumble(self.result, ax, run=run)

    def temperature(self, axes: Any = None) -> Any:
        """Draw the temperature laws of bias, scale factor and misalignment over their points.

        Parameters
        ----------
        axes : array-like of Axes, optional
            Six axes to draw into; three where there are no laws.

        Returns
        -------
        ndarray of Axes, shape (6,)
            Laws with 95 % bands and runs with 95 % intervals; below, the runs less the law, where
            arrows lead from run to run if a level is met again: the loop of hysteresis. Shape (3,),
            the runs alone, where there are no laws. Of several mountings that of the laws is drawn
            and named; `Calibration.of_mounting` takes another.
        """
        return temperature.temperature(self.result, axes)

    def budget(self, ax: Axes | None = None, *, run: str | int | None = None) -> Axes:
        """Draw where the uncertainty of each coefficient comes from.

        Parameters
        ----------
        ax : Axes, optional
            Axes to draw into.
        run : str or int, optional
            Label of a run; the one nearest to T0 without it.

        Returns
        -------
        Axes
            Shares of the variance by source of error; the standard uncertainty stands behind.

        Raises
        ------
        InputError
            If there is no such run.
        """
        return coefficients.budget(self.result, ax, run=run)

    def coefficients(self, axes: Any = None) -> Any:
        """Draw each coefficient run by run.

        Parameters
        ----------
        axes : array-like of Axes, optional
            Six axes to draw into.

        Returns
        -------
        ndarray of Axes, shape (6,)
            Values with 95 % intervals.
        """
        return coefficients.coefficients(self.result, axes)
