"""Pictures of what several units tell of their stand, as ``stand.plot``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from accelcal.arguments.options import check_text
from accelcal.errors import InputError
from accelcal.plot.style import Pictures, blank, canvas, entitled, palette, styled
from accelcal.plot.ticks import literal, name_ticks, shortened
from accelcal.report.lines import sentence
from accelcal.results.stand_discovery import StandDiscovery
from accelcal.shown_units import readable

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from accelcal.results.stand_discovery import StandEffect

__all__ = ["StandPlot"]

_MOST_NAMED = 16
_LONGEST_NAME = 24


class StandPlot(Pictures[StandDiscovery]):
    """Pictures of a stand."""

    __slots__ = ()

    @styled
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
        ax = canvas(ax)
        ax.set_title("Errors of the head positions")
        head = self.result.head
        if not head:
            return blank(ax, "head uncertainty not declared")
        angles = [position.angle_deg for position in head]
        values = np.array([position.error.value or 0.0 for position in head])
        half = np.array([position.error.expanded_uncertainty or 0.0 for position in head])
        factor, unit = readable("rad", values, half)
        ax.axhline(0.0, color=palette().ink, lw=0.8)
        ax.errorbar(angles, factor * values, factor * half, marker="o", ls="")
        ax.set(xlabel="head angle [°]", ylabel=f"true − nominal, 95 % interval [{unit}]")
        ax.set_xticks(np.arange(0.0, 361.0, 45.0))
        return ax

    @styled
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
        item = _effect(self.result, effect)
        known = {unit: q for unit, q in item.sizes.items() if q.value is not None}
        values = np.array([q.value for q in known.values()], dtype=float)
        half = np.array([q.expanded_uncertainty or 0.0 for q in known.values()])
        factor, unit = readable(next((q.unit for q in known.values()), "1"), values, half)
        ax = canvas(ax, (max(4.6, min(2.4 + 0.5 * len(known), 10.0)), 3.6))
        common = next(iter(item.parameters.values()), None)
        if common is not None and common.value is not None:
            wide = factor * (common.expanded_uncertainty or 0.0)
            middle = factor * common.value
            ax.axhspan(middle - wide, middle + wide, color=palette().series[1], alpha=0.18, lw=0)
            ax.axhline(middle, color=palette().series[1], label="all units together, 95 % band")
        ax.axhline(0.0, color=palette().ink, lw=0.8)
        places, names = range(len(known)), [shortened(unit, _LONGEST_NAME) for unit in known]
        ax.errorbar(places, factor * values, factor * half, marker="o", ls="", label="unit, 95 %")
        name_ticks(ax.xaxis, places, names, _MOST_NAMED, rotation=35, ha="right")
        ax.set(xlabel="unit", ylabel=f"size [{unit}]")
        return entitled(ax, f"{literal(sentence(item.name))}: {item.verdict}")


def _effect(stand: StandDiscovery, effect: str | None) -> StandEffect:
    check_text(effect=effect)
    found = {item.id: item for item in stand.effects}
    if not found:
        raise InputError("no effect was found over the units; there are no sizes to show")
    chosen = next(iter(found)) if effect is None else effect
    if chosen not in found:
        raise InputError(f"effect {chosen!r} was not found; the stand has {', '.join(found)}")
    return found[chosen]
