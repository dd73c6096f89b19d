"""Pictures of many units through their recalibrations, as ``fleet.plot``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.errors import InputError
from accelcal.plot.style import Pictures, canvases, entitled, palette, styled
from accelcal.plot.ticks import shortened
from accelcal.plural import listed
from accelcal.results.fleet_history import DOUBT, FleetHistory, UnitOfFleet
from accelcal.shown_units import in_small_unit, written

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["FleetHistoryPlot"]

_FEW = 10
"""Units that have their serial numbers along the axis."""

_LETTERS = 80
"""Letters that have room along the axis."""

_NAMED = 5
"""Units that are named of each kind."""

_LONGEST_NAME = 24
"""Letters of such a name."""

_FAR = 8.0
"""Times the median of drift and interval that a drift within the axes has at most."""

_ROOM = 1.3
"""Height of the axes over what the drifts themselves and a usual interval take."""


class FleetHistoryPlot(Pictures[FleetHistory]):
    """Pictures of many units through their recalibrations."""

    __slots__ = ()

    @styled
    def drifts(self, axes: Any = None) -> Any:
        """Draw the drifts of all units, sorted.

        Parameters
        ----------
        axes : array-like of Axes, optional
            Two axes to draw into.

        Returns
        -------
        ndarray of Axes, shape (2,)
            Drifts of bias and scale factor of units that may wander, with their 95 % intervals; the
            longest may leave the axes. Units far outside are marked at the edge and named.

        Raises
        ------
        InputError
            If no unit has a drift.
        """
        units = [unit for unit in self.result.units if unit.trends]
        if not units:
            raise InputError("no unit has enough calibrations for a drift to draw")
        panels = canvases(axes, 2, 1, (7.6, 6.2))
        for place, (ax, name) in enumerate(zip(panels, ("bias", "scale factor"), strict=True)):
            _draw(ax, units, place, name)
        panels[-1].set_xlabel(f"units by their drift, of {len(units)}")
        return panels


def _draw(ax: Axes, units: list[UnitOfFleet], place: int, name: str) -> None:
    colours = palette()
    units = sorted(units, key=lambda unit: unit.trends[place].drift_of_a_walk.value or 0.0)
    trends = [unit.trends[place] for unit in units]
    factor, unit = in_small_unit(trends[0].drift.unit.removesuffix("/year"))
    drifts = [trend.drift_of_a_walk for trend in trends]
    value = factor * np.array([own.value for own in drifts], dtype=float)
    wide = factor * np.array([own.expanded_uncertainty for own in drifts], dtype=float)
    jumped = np.array([bool(trend.jumps) for trend in trends])
    size = np.abs(value)
    far = size > _FAR * np.median(size + wide)
    largest = _ROOM * (size[~far].max() + np.median(wide))
    beyond = (size > wide) & ~jumped
    for chosen, colour, label in (
        (~beyond & ~jumped, colours.muted, "drift, 95 %"),
        (beyond, colours.series[3], f"beyond its U: {_names(units, beyond, 'drift', size)}"),
        (jumped, colours.series[1], f"with a jump: {_names(units, jumped, 'jump', size)}"),
    ):
        if chosen.any():
            shown = np.flatnonzero(chosen) + 1, value[chosen], wide[chosen]
            drawn: Any = {"ls": "", "marker": "o", "ms": 3, "lw": 0.8, "capsize": 0}
            ax.errorbar(*shown, color=colour, label=label, **drawn)
    if far.any():
        places, edge = np.flatnonzero(far) + 1, np.copysign(0.96 * largest, value[far])
        label = f"outside the axes: {_names(units, far, 'drift', size)}"
        ax.plot(places, edge, ls="", marker="D", ms=5, mfc="none", mec=colours.ink, label=label)
    ax.set_ylim(-largest, largest)
    ax.set_ylabel(f"drift [{written(unit)}/year]")
    if len(units) <= _FEW:
        most = _LETTERS // len(units)
        serials = [shortened(own.serial, most) for own in units]
        ax.set_xticks(range(1, len(units) + 1), serials)
    entitled(ax, name.capitalize(), columns=1)


def _names(units: list[UnitOfFleet], chosen: Mask, finding: str, size: Array) -> str:
    """Serial numbers of chosen units: the largest first, behind them those that are in doubt."""
    doubtful = np.array([finding + DOUBT in unit.attention for unit in units])
    places = np.flatnonzero(chosen)
    order = places[np.lexsort((-size[places], doubtful[places]))].tolist()
    names = [
        f"{shortened(units[place].serial, _LONGEST_NAME)}{DOUBT * bool(doubtful[place])}"
        for place in order
    ]
    return listed(names, _NAMED)
