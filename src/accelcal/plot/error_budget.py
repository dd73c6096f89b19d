"""Pictures of an error budget, as ``budget.plot``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from accelcal.plot.pictures import Pictures
from accelcal.plot.style import SMALL, canvases, palette, styled
from accelcal.plot.ticks import LONGEST_TITLE, literal, shortened
from accelcal.report.error_budget import NO_RANDOM_ERROR, joint_variance, place
from accelcal.report.lines import sentence
from accelcal.report.typeset import typeset
from accelcal.results.error_budget import ErrorBudget
from accelcal.results.quantity import Document
from accelcal.shown_units import readable

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["ErrorBudgetPlot", "shares"]

Table = Mapping[str, list[float]]

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
        document = self.result.to_document()
        points = document["points"]
        width = max(9.0, min(5.0 + 0.8 * len(points), 16.0))
        own = axes is None
        panels = canvases(axes, 3, 1, (width, 9.0))
        handles = _draw(panels, points)
        figure = panels[0].figure
        if own:
            unit = shortened(document["serial"] or document["source"], LONGEST_TITLE)
            figure.suptitle(f"Error of the measured acceleration by (4), {unit}")
            figure.legend(handles=list(handles.values()), loc="outside right center")
        else:
            panels[0].legend(
                handles=list(handles.values()), loc="upper left", bbox_to_anchor=(1.0, 1)
            )
        return panels


def _draw(panels: Sequence[Axes], points: Sequence[Document]) -> dict[str, Any]:
    titles = ("systematic part", "bounds behind ± in (4), added", "shares of U (95 %), GUM")
    bounds = _parts(points, "bound")
    tables = _parts(points, "value"), bounds, shares(points)
    totals = ("systematic", "bound", "expanded_uncertainty")
    looks = _looks(tables)
    shown: dict[str, Any] = {}
    for ax, title, table, total in zip(panels, titles, tables, totals, strict=True):
        ax.grid(visible=False, axis="x")
        sums = np.array([point[total] for point in points])
        factor, unit = readable("g", sums, *table.values())
        scaled = {name: [factor * size for size in sizes] for name, sizes in table.items()}
        shown = _stack(ax, scaled, looks) | shown
        ink = palette().ink
        (shown["total"],) = ax.plot(factor * sums, "D", color=ink, ms=4, label="total")
        ax.set(title=sentence(title), ylabel=f"error [{unit}]")
        ax.axhline(0.0, color=ink, lw=0.8)
        if table is bounds and not bounds:
            ax.set(xlim=panels[0].get_xlim(), yticks=[])
            ax.text(0.5, 0.55, f"none, as {NO_RANDOM_ERROR}", transform=ax.transAxes, ha="center")
        _name_points(ax, points, last=ax is panels[-1])
    return shown


def _parts(points: Sequence[Document], key: str) -> dict[str, list[float]]:
    """Component -> its size at each point [g]; those that are zero everywhere are left out."""
    table: dict[str, list[float]] = {}
    for point in points:
        for part in point["components"]:
            table.setdefault(_label(part), []).append(part[key])
    return {name: sizes for name, sizes in table.items() if any(sizes)}


def shares(points: Sequence[Document]) -> dict[str, list[float]]:
    """Tell the share of the expanded uncertainty that each component has.

    Parameters
    ----------
    points : sequence of mapping
        The ``"points"`` of a budget.

    Returns
    -------
    dict of str to list of float
        Component -> its share at each point [g]; correlated ones have one together.
    """
    found: dict[str, list[float]] = {}
    for point in points:
        weight = _per_variance(point)
        found.setdefault(_COEFFICIENTS, []).append(weight * joint_variance(point))
        for part in point["components"]:
            if not part["correlated"]:
                share = weight * part["standard_uncertainty"] ** 2
                found.setdefault(_label(part), []).append(share)
    return {name: sizes for name, sizes in found.items() if any(sizes)}


def _label(part: Document) -> str:
    return literal(f"{typeset(part['symbol'])}  {part['name']}")


def _per_variance(point: Document) -> float:
    variance = point["standard_uncertainty"] ** 2
    return float(point["expanded_uncertainty"] / variance) if variance > 0.0 else 0.0


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


def _name_points(ax: Axes, points: Sequence[Document], *, last: bool) -> None:
    ax.tick_params(labelbottom=last)
    if len(points) <= _LABELLED:
        labels = [place(point).replace(", ", "\n").replace("degC", "°C") for point in points]
        labels = [label.replace("-", "−") for label in labels]
        ax.set_xticks(range(len(points)), labels, fontsize=SMALL)
    elif last:
        ax.set_xlabel("point, counted from 0 in the order of the table")
