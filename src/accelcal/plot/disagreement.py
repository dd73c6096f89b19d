"""Pictures of a comparison, as ``disagreement.plot``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from accelcal.discovery.new_record.compare import residuals_of
from accelcal.plot.coefficients import SYMBOLS, draw_runs, run_labels
from accelcal.plot.discovery import draw_where
from accelcal.plot.residuals import ReadingValues, draw_by_angle
from accelcal.plot.style import Pictures, canvas, canvases, entitled, palette, styled
from accelcal.results.agreement import ALPHA
from accelcal.results.disagreement import QUANTITIES, Disagreement

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from accelcal.record import TumbleRecord
    from accelcal.results.calibration import Calibration

__all__ = ["DisagreementPlot"]


class DisagreementPlot(Pictures[Disagreement]):
    """Pictures of a comparison.

    Examples
    --------
    >>> import accelcal
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> found = accelcal.compare(calibration, accelcal.simulate(seed=2))
    >>> found.plot.where().get_xlabel()
    'share of the disagreement [%]'
    """

    __slots__ = ()

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
        title = f"Simulation and measurement: {self.result.verdict}"
        return draw_where(self.result.where, ALPHA, ax, title)

    @styled
    def runs(self, axes: Any = None) -> Any:
        """Draw what has changed in each run since the calibration.

        Parameters
        ----------
        axes : array-like of Axes, optional
            Six axes to draw into.

        Returns
        -------
        ndarray of Axes, shape (6,)
            Changes of bias, scale factor, misalignment, k2, k3 and delta_ip with 95 % intervals.
        """
        panels = canvases(axes, 2, 3, (10.0, 5.2))
        names = run_labels(self.result.run_names, self.result.runs)
        for ax, name in zip(panels, QUANTITIES, strict=True):
            draw_runs(ax, [getattr(change, name) for change in self.result.runs], names)
            ax.axhline(0.0, color=palette().ink, lw=0.8)
            ax.set_title(f"Change of {SYMBOLS.get(name, name.replace('_', ' '))}")
        return panels

    @styled
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
            Fewer than three readings of an angle have the scatter of all angles together.

        Raises
        ------
        InputError
            If the record does not suit the calibration.
        """
        values = residuals_of(calibration, record)
        readings = ReadingValues(np.asarray(record.angle), np.asarray(record.stroke), values)
        ax = draw_by_angle(canvas(ax), readings, "reading − simulation")
        return entitled(ax, f"Reading − simulation, {len(record)} readings")
