"""Pictures of two calibrations, as ``comparison.plot``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from accelcal.plot.style import Pictures, canvas, entitled, palette, styled
from accelcal.report.calibration_comparison import shown_changes
from accelcal.report.typeset import typeset
from accelcal.results.calibration_comparison import CalibrationComparison
from accelcal.units import MICRO

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["CalibrationComparisonPlot"]

_WITHIN, _BEYOND = "within U: $|E_n| \\leq 1$", "beyond U: $|E_n| > 1$"

_FAR = 5.0
"""Normalised error beyond which the axis is logarithmic outside -2 to 2."""

_VERY_FAR = 20.0
"""Normalised error from which only its powers of ten have room for a label."""


class CalibrationComparisonPlot(Pictures[CalibrationComparison]):
    """Pictures of two calibrations.

    Examples
    --------
    >>> import accelcal
    >>> old, new = (accelcal.fit(accelcal.simulate(seed=seed)) for seed in (1, 2))
    >>> found = accelcal.compare_calibrations(old, new)
    >>> found.plot.coefficients().get_xlabel()
    'normalised error $E_n$'
    """

    __slots__ = ()

    @styled
    def coefficients(self, ax: Axes | None = None) -> Axes:
        """Draw E_n of each coefficient.

        Parameters
        ----------
        ax : Axes, optional
            Axes to draw into.

        Returns
        -------
        Axes
            The coefficients agree within the band from -1 to 1.
        """
        drawn, colours = canvas(ax, (6.4, 4.6)), palette()
        changes = shown_changes(self.result)
        scores = np.array([own.normalised_error for _, own in changes], dtype=float)
        places = np.arange(scores.size)
        drawn.axvspan(-1.0, 1.0, color=colours.series[2], alpha=0.2, lw=0, label=_WITHIN)
        drawn.axvline(0.0, color=colours.ink, lw=0.8)
        apart = np.abs(scores) > 1.0
        drawn.plot(scores[~apart], places[~apart], "o", color=colours.series[0])
        drawn.plot(scores[apart], places[apart], "o", color=colours.series[1], label=_BEYOND)
        farthest = np.nanmax(np.abs(scores))
        drawn.set_xlabel("normalised error $E_n$")
        if farthest > _FAR:  # else one hides how all others lie
            drawn.set_xlabel("normalised error $E_n$, logarithmic beyond ±2")
            drawn.set_xscale("symlog", linthresh=2.0, linscale=2.0)
            drawn.locator_params(axis="x", subs=(1.0, 2.0, 5.0) if farthest < _VERY_FAR else (1.0,))
            drawn.xaxis.set_major_formatter("{x:g}")
        drawn.set_yticks(places, [f"{name} {typeset(own.coefficient)}" for name, own in changes])
        drawn.invert_yaxis()
        drawn.legend(loc="best")
        verdict = self.result.verdict
        return entitled(drawn, f"New − old calibration over its U (95 %): {verdict}")

    @styled
    def indicated(self, ax: Axes | None = None) -> Axes:
        """Draw how the indicated acceleration changes along the input axis.

        Parameters
        ----------
        ax : Axes, optional
            Axes to draw into.

        Returns
        -------
        Axes
            The change with the 95 % band that holds in the whole range at once.
        """
        drawn, colours = canvas(ax), palette()
        found = self.result.indicated
        a_i = np.array([own.a_i for own in found])
        value = MICRO * np.array([own.difference.value for own in found], dtype=float)
        half = MICRO * np.array([own.band for own in found])
        drawn.fill_between(
            a_i, value - half, value + half, color=colours.series[0], alpha=0.25, lw=0
        )
        drawn.plot(a_i, value, color=colours.series[0])
        drawn.axhline(0.0, color=colours.ink, lw=0.8)
        drawn.set(xlabel="acceleration along the input axis [g]", ylabel="new − old [µg]")
        return entitled(drawn, "Change of the indicated acceleration, 95 % for the whole range")
