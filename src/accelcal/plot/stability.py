"""Pictures of a stability test, as ``stability.plot``."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from accelcal.arguments.kinds import expect
from accelcal.errors import InputError
from accelcal.plot.style import Pictures, blank, canvas, canvases, palette, styled
from accelcal.plot.ticks import LONGEST_TITLE, short_log_ticks, shortened
from accelcal.results.stability import Stability
from accelcal.shown_units import readable, time_unit
from accelcal.stability.noise_terms import TERMS
from accelcal.stability.record import Launch, StabilityRecord

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["StabilityPlot", "both"]

_MOST_POINTS = 150
_MOST_NAMED = 6
_LONGEST_NAME = 16


class StabilityPlot(Pictures[Stability]):
    """Pictures of a stability test."""

    __slots__ = ()

    @styled
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
        ax, found = canvas(ax, (5.6, 4.2)), self.result.allan
        ax.set_title("Overlapping Allan deviation")
        if not found.tau_s:
            return blank(ax, "not determined")
        factor, unit = readable(self.result.unit, found.deviation)
        tau = np.array(found.tau_s)
        low, middle, high = (
            factor * np.array(x) for x in (found.lower, found.deviation, found.upper)
        )
        colours = palette()
        name = f"measured, {100 * found.level:.0f} % band"
        ax.fill_between(tau, low, high, color=colours.series[0], alpha=0.2, lw=0)
        ax.loglog(tau, middle, "o-", ms=4, color=colours.series[0], label=name)
        for number, (symbol, term) in enumerate(self.result.noise_terms.items(), start=1):
            if term.value is not None:
                line = factor * term.value * np.sqrt(TERMS[symbol].variance(tau))
                near = (line > 0.5 * low.min()) & (line < 2.0 * high.max())
                colour, label = colours.series[number], f"{TERMS[symbol].name} {symbol}"
                ax.plot(tau[near], line[near], "--", lw=1.1, color=colour, label=label)
        ax.set(xlabel="averaging time [s]", ylabel=f"deviation [{unit}]")
        _plain_numbers(ax)
        ax.legend(loc="best")
        return ax

    @styled
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
        found, launches = self.result, self.result.launches
        resting = _resting(record, len(launches))
        size, name = time_unit(max((launch.duration_s for launch in launches), default=1.0))
        factor, unit = readable(found.unit, [e.fluctuation.value or 0.0 for e in launches])
        centre = math.fsum(launch.level for launch in launches) / max(len(launches), 1)
        named = 1 < len(launches) <= _MOST_NAMED
        ax, series = canvas(ax, (5.6, 4.2)), palette().series
        for number, (shown, launch) in enumerate(zip(launches, resting, strict=True)):
            colour = series[number % len(series)]
            time, output = _thinned(launch.time, launch.output / (found.scale_factor or 1.0))
            ax.plot(time / size, factor * (output - centre), color=colour, lw=0.7, alpha=0.5)
            ends = launch.time[[0, -1]]
            line = shown.level + (shown.drift.value or 0.0) * ends - centre
            label = f"launch {shortened(shown.label, _LONGEST_NAME)}" if named else None
            ax.plot(ends / size, factor * line, color=colour, lw=2.0, label=label)
        ax.set(
            xlabel=f"time since the start of the launch [{name}]", ylabel=f"bias change [{unit}]"
        )
        ax.set_title("Bias in each launch, with its trend line")
        if named:
            ax.legend(loc="best", ncols=2)
        return ax


def _resting(record: StabilityRecord, analysed: int) -> list[Launch]:
    """The launches of a record that were analysed: those at rest."""
    expect(record, StabilityRecord)
    resting = [launch for launch in record.launches if launch.is_at_rest]
    if len(resting) != analysed:
        raise InputError(
            f"{len(resting)} launches at rest in the record, and {analysed} in the analysis; give"
            " the record that was analysed"
        )
    return resting


@styled
def both(stability: Stability, record: StabilityRecord) -> Any:
    """Draw the bias in time and the Allan deviation side by side.

    Parameters
    ----------
    stability : Stability
        The analysis.
    record : StabilityRecord
        The record that was analysed.

    Returns
    -------
    ndarray of Axes, shape (2,)
        In a figure of their own.
    """
    panels = canvases(None, 1, 2, (11.0, 4.6))
    unit = shortened(stability.serial or stability.source, LONGEST_TITLE)
    panels[0].figure.suptitle(f"Stability of {unit}")
    stability.plot.record(record, panels[0])
    stability.plot.allan(panels[1])
    return panels


def _plain_numbers(ax: Axes) -> None:
    """Label logarithmic axes with 1, 2, 5, 10 where they are short, else with decades."""
    for axis in (ax.xaxis, ax.yaxis):
        low, high = sorted(axis.get_view_interval())
        short_log_ticks(axis, (1, 2, 5) if math.log10(high / low) < 3.0 else (1,))


def _thinned(time: Any, output: Any) -> tuple[Any, Any]:
    """Means over short spans, so that a long record is no blot."""
    width = max(math.ceil(time.size / _MOST_POINTS), 1)
    whole = time.size // width * width
    return tuple(values[:whole].reshape(-1, width).mean(axis=1) for values in (time, output))
