"""Pictures of a unit's history, as ``history.plot``."""

from __future__ import annotations

from datetime import date
from typing import TYPE_CHECKING, Any

import numpy as np

from accelcal.numerics.probability import NORMAL_FACTOR
from accelcal.plot.style import Pictures, canvases, entitled, palette, styled
from accelcal.plot.ticks import LONGEST_TITLE, shortened
from accelcal.report.findings import p_value
from accelcal.results.unit_history import History
from accelcal.shown_units import readable

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from accelcal.results.unit_history import Trend

__all__ = ["HistoryPlot"]


class HistoryPlot(Pictures[History]):
    """Pictures of a unit's history."""

    __slots__ = ()

    @styled
    def trends(self, axes: Any = None) -> Any:
        """Draw bias and scale factor by date, with their lines and jumps.

        Parameters
        ----------
        axes : array-like of Axes, optional
            Two axes to draw into.

        Returns
        -------
        ndarray of Axes, shape (2,)
            Calibrations with 95 % intervals; thin bars add the scatter beyond what is stated.
        """
        panels = canvases(axes, 2, 1, (7.6, 6.2))
        for ax, trend in zip(panels, self.result.trends, strict=True):
            _draw(ax, trend)
        panels[-1].set_xlabel("date")
        if axes is None:
            unit = shortened(self.result.serial or "a unit", LONGEST_TITLE)
            panels[0].figure.suptitle(f"History of {unit}")
        return panels


def _draw(ax: Axes, trend: Trend) -> None:
    colours = palette()
    dates = np.array([date.fromisoformat(point.date) for point in trend.points])
    values = np.array([point.measured.value for point in trend.points], dtype=float)
    line = np.array([point.line for point in trend.points])
    stated = np.array([p.measured.expanded_uncertainty or 0.0 for p in trend.points])
    middle = trend.reference if trend.symbol == "K1" else 0.0
    factor, unit = readable(trend.points[0].measured.unit, values, stated)
    whole = np.hypot(stated, NORMAL_FACTOR * trend.scatter)
    drawn: Any = {"ls": "", "color": colours.series[0]}
    ax.errorbar(dates, factor * values, factor * whole, lw=0.7, capsize=0, alpha=0.7, **drawn)
    label = "calibration, 95 % (thin: with the scatter)"
    ax.errorbar(dates, factor * values, factor * stated, marker="o", label=label, **drawn)
    _draw_line(ax, trend, dates, factor * line)
    symbol = "$k_0$" if trend.symbol == "k0" else "$K_1$, change"
    ax.set_ylabel(f"{symbol} [{unit}]")
    _date_ticks(ax)
    told = "" if not middle else f" from {middle:.7g} {trend.reference_unit}"
    entitled(ax, f"{trend.name.capitalize()}{told}")


def _draw_line(ax: Axes, trend: Trend, dates: Any, line: Any) -> None:
    colours = palette()
    breaks = [[point.date for point in trend.points].index(jump.before) for jump in trend.jumps]
    for number, part in enumerate(np.split(np.arange(dates.size), breaks)):
        label = "line" if number == 0 else None
        ax.plot(dates[part], line[part], color=colours.series[1], label=label)
    for number, jump in enumerate(trend.jumps):
        span = date.fromisoformat(jump.after), date.fromisoformat(jump.before)
        label = _jumps_told(trend) if number == 0 else None
        ax.axvspan(*span, color=colours.series[3], alpha=0.25, lw=0, label=label)  # type: ignore[arg-type]


def _jumps_told(trend: Trend) -> str:
    count, largest = len(trend.jumps), p_value(max(jump.p_value for jump in trend.jumps))
    return f"jump, {largest}" if count == 1 else f"{count} jumps, the least sure {largest}"


def _date_ticks(ax: Axes) -> None:
    from matplotlib.dates import AutoDateLocator, ConciseDateFormatter

    locator = AutoDateLocator(maxticks=8)  # type: ignore[no-untyped-call]
    ax.xaxis.set_major_locator(locator)
    ax.xaxis.set_major_formatter(ConciseDateFormatter(locator))  # type: ignore[no-untyped-call]
