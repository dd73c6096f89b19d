"""Pictures of an error budget, as ``budget.plot``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from accelcal.arrays import Array
from accelcal.plot.style import SMALL, Pictures, canvases, palette, styled
from accelcal.plot.ticks import LONGEST_TITLE, literal, shortened
from accelcal.report.error_budget import NO_RANDOM_ERROR, joint_variance, place
from accelcal.report.lines import sentence
from accelcal.report.typeset import typeset
from accelcal.results.error_budget import ErrorBudget, ErrorComponent
from accelcal.shown_units import readable

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["ErrorBudgetPlot"]

Table = Mapping[str, Array]

_COEFFICIENTS = "all coefficients together"
_LABELLED = 16  # bars; of more, the axis has numbers only
_HATCHES = ("", "////", "....")


class ErrorBudgetPlot(Pictures[ErrorBudget]):
    """Pictures of an error budget."""

    __slots__ = ()

    @styled
    def stack(self, axes: Any = None) -> Any:
        """Draw the components on top of one another, a bar a point.

        Parameters
        ----------
        axes : array-like of Axes, optional
            Three axes to draw into.

        Returns
        -------
        ndarray of Axes, shape (3,)
            Systematic parts, bounds of (4), and shares of the expanded uncertainty.

        Notes
        -----
        A component of standard uncertainty u_i has the share U u_i^2 / u_c^2 of the expanded
        uncertainty U, so that the shares add up to U. The errors of the coefficients are correlated
        and cancel in part, so they have one share together.
        """
        budget = self.result
        width = max(9.0, min(5.0 + 0.8 * budget.a_i.size, 16.0))
        own = axes is None
        panels = canvases(axes, 3, 1, (width, 9.0))
        handles = _draw(panels, budget)
        figure = panels[0].figure
        if own:
            unit = shortened(budget.serial or budget.source, LONGEST_TITLE)
            figure.suptitle(f"Error of the measured acceleration by (4), {unit}")
            figure.legend(handles=list(handles.values()), loc="outside right center")
        else:
            panels[0].legend(
                handles=list(handles.values()), loc="upper left", bbox_to_anchor=(1.0, 1)
            )
        return panels


def _draw(panels: Sequence[Axes], budget: ErrorBudget) -> dict[str, Any]:
    titles = ("systematic part", "bounds behind ± in (4), added", "shares of U (95 %), GUM")
    bounds = _felt({_label(part): part.bound for part in budget.components})
    values = _felt({_label(part): part.value for part in budget.components})
    tables = values, bounds, _shares(budget)
    totals = budget.systematic, budget.bound, budget.expanded_uncertainty
    looks = _looks(tables)
    shown: dict[str, Any] = {}
    for ax, title, table, sums in zip(panels, titles, tables, totals, strict=True):
        ax.grid(visible=False, axis="x")
        factor, unit = readable("g", sums, *table.values())
        scaled = {name: factor * sizes for name, sizes in table.items()}
        shown = _stack(ax, scaled, looks) | shown
        ink = palette().ink
        (shown["total"],) = ax.plot(factor * sums, "D", color=ink, ms=4, label="total")
        ax.set(title=sentence(title), ylabel=f"error [{unit}]")
        ax.axhline(0.0, color=ink, lw=0.8)
        if table is bounds and not bounds:
            ax.set(xlim=panels[0].get_xlim(), yticks=[])
            ax.text(0.5, 0.55, f"none, as {NO_RANDOM_ERROR}", transform=ax.transAxes, ha="center")
        _name_points(ax, budget, last=ax is panels[-1])
    return shown


def _felt(table: Table) -> dict[str, Array]:
    """Components with their sizes at each point, without those that are zero everywhere."""
    return {name: sizes for name, sizes in table.items() if sizes.any()}


def _shares(budget: ErrorBudget) -> dict[str, Array]:
    """Component -> its share of the expanded uncertainty; correlated ones have one together [g]."""
    variance = budget.standard_uncertainty**2
    nothing = np.zeros_like(variance)
    weight = np.divide(budget.expanded_uncertainty, variance, out=nothing, where=variance > 0.0)
    alone = (part for part in budget.components if part.symbol not in budget.correlated)
    own = {_label(part): weight * part.standard_uncertainty**2 for part in alone}
    return _felt({_COEFFICIENTS: weight * joint_variance(budget), **own})


def _label(part: ErrorComponent) -> str:
    return literal(f"{typeset(part.symbol)}  {part.name}")


def _stack(ax: Axes, table: Table, looks: Mapping[str, Mapping[str, str]]) -> dict[str, Any]:
    """Stack the positive parts upwards and the negative ones downwards."""
    bars: dict[str, Any] = {}
    tops: dict[tuple[int, bool], float] = {}
    for name, sizes in table.items():
        bases = [tops.get((i, size < 0.0), 0.0) for i, size in enumerate(sizes)]
        bars[name] = ax.bar(range(len(sizes)), sizes, 0.7, bases, label=name, lw=0, **looks[name])  # type: ignore[arg-type]
        for i, (base, size) in enumerate(zip(bases, sizes, strict=True)):
            tops[i, size < 0.0] = base + size
    return bars


def _looks(tables: Sequence[Table]) -> dict[str, dict[str, str]]:
    """A colour, and behind the last colour a hatch, for each component, the same in all panels."""
    names = dict.fromkeys(name for table in tables for name in table)
    series, paper = palette().series, palette().paper
    return {
        name: {
            "color": series[number % len(series)],
            "hatch": _HATCHES[number // len(series) % len(_HATCHES)],
            "edgecolor": paper,
        }
        for number, name in enumerate(names)
    }


def _name_points(ax: Axes, budget: ErrorBudget, *, last: bool) -> None:
    ax.tick_params(labelbottom=last)
    points = range(budget.a_i.size)
    if len(points) <= _LABELLED:
        labels = [place(budget, i).replace(", ", "\n").replace("degC", "°C") for i in points]
        labels = [label.replace("-", "−") for label in labels]
        ax.set_xticks(points, labels, fontsize=SMALL)
    elif last:
        ax.set_xlabel("point, counted from 0 in the order of the table")
