"""Pictures of the budget of a stand, as ``budget.plot``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from accelcal.errors import InputError
from accelcal.model import SLOPES
from accelcal.plot.style import Pictures, canvases, own_panels, palette, styled
from accelcal.plot.ticks import LONGEST_TITLE, shortened
from accelcal.report.stand_budget import shares, shown_unit
from accelcal.report.typeset import typeset
from accelcal.results.stand_budget import StandBudget
from accelcal.shown_units import written

_DRAWN = ("K1", "k0", "k2", "k3", "delta", "delta_ip")
_BARS = 6
_COLUMNS = 3
_LONGEST_NAME = 30
_REST = "all others"
_LEAST = 1e-5
"""Part of the variance from which on a component has a bar."""


class StandBudgetPlot(Pictures[StandBudget]):
    """Pictures of the budget of a stand."""

    __slots__ = ()

    @styled
    def pareto(self, axes: Any = None) -> Any:
        """Draw what each component does to each coefficient, the largest first.

        Parameters
        ----------
        axes : array-like of Axes, optional
            As many axes as coefficients are drawn: K1, the error model and the slopes.

        Returns
        -------
        ndarray of Axes
            A Pareto chart for each coefficient.
        """
        budget = self.result
        places = _places(budget)
        if not places:
            raise InputError("no coefficient has an uncertainty; there is nothing to draw")
        axes = _panels(budget, len(places)) if axes is None else axes
        panels = canvases(axes, len(places), 1, (0.0, 0.0))
        colours = _colours(budget, places)
        for panel, place in zip(panels, places, strict=True):
            _panel(panel, budget, place, colours)
        return panels


def _places(budget: StandBudget) -> list[int]:
    """Coefficients that are drawn, in the order of the panels."""
    wanted = (*_DRAWN, *SLOPES)
    places = [
        i
        for i, own in enumerate(budget.coefficients)
        if own.symbol in wanted and not own.where and budget.standard_uncertainty[i] > 0.0
    ]
    return sorted(places, key=lambda i: wanted.index(budget.coefficients[i].symbol))


def _panels(budget: StandBudget, count: int) -> Any:
    axes = own_panels(count, min(_COLUMNS, count), (4.0, 2.5), around=0.6)
    stand = shortened(budget.stand, LONGEST_TITLE)
    axes[0].figure.suptitle(
        f"{stand}: bars are standard uncertainties by component, the line is their part of u² added"
        " up"
    )
    return axes


def _colours(budget: StandBudget, places: Sequence[int]) -> dict[str, str]:
    """A colour for each component, from those that matter most on."""
    most: dict[str, float] = {}
    for place in places:
        for name, share in shares(budget, place):
            most[name] = max(share, most.get(name, 0.0))
    ordered = sorted(most, key=lambda name: -most[name])
    named = dict(zip(ordered, palette().series, strict=False))
    return {name: named.get(name, palette().muted) for name in ordered}


def _panel(ax: Any, budget: StandBudget, place: int, colours: Mapping[str, str]) -> None:
    factor, plain = shown_unit(budget, place)
    unit = written(plain)
    bars = _bars(budget, place)
    u = factor * budget.standard_uncertainty[place]
    sizes = [u * np.sqrt(share) for _, share in bars]
    at = np.arange(len(bars))
    ax.bar(at, sizes, 0.7, color=[colours.get(name, palette().muted) for name, _ in bars])
    together = [u * part for part in np.cumsum([share for _, share in bars])]
    ax.plot(at, together, "o-", color=palette().ink, ms=3.0, lw=1.0)
    ax.axhline(u, color=palette().muted, lw=0.8, ls=":")
    ax.set_xticks(at, [shortened(name, _LONGEST_NAME) for name, _ in bars], rotation=30, ha="right")
    title = f"{typeset(budget.coefficients[place].symbol)}: u = {u:.3g} {unit}"
    ax.set(ylabel=unit, ylim=(0.0, 1.12 * u), title=title)
    ax.grid(visible=False, axis="x")
    percent = ax.secondary_yaxis(
        "right", functions=(lambda y: 100.0 * y / u, lambda p: 0.01 * p * u)
    )
    percent.set_yticks([0, 50, 100], ["0", "50", "100 %"], color=palette().muted)


def _bars(budget: StandBudget, place: int) -> list[tuple[str, float]]:
    """Components that count, the largest first, and the others together behind them."""
    found = [item for item in shares(budget, place) if item[1] > _LEAST]
    if len(found) <= _BARS:
        return found
    rest = sum(share for _, share in found[_BARS - 1 :])
    return [*found[: _BARS - 1], (_REST, rest)]
