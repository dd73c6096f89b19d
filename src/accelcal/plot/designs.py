"""Uncertainty against hours of compared tests, with the Pareto front, as ``comparison.plot``."""

from __future__ import annotations

from typing import Any

import numpy as np

from accelcal.arrays import Array
from accelcal.plot.style import Pictures, canvases, own_panels, palette, styled
from accelcal.plot.ticks import short_log_ticks
from accelcal.plural import counted
from accelcal.report.typeset import typeset
from accelcal.results.designs import DesignComparison, TestDesign
from accelcal.results.optimal_design import OptimalDesign
from accelcal.shown_units import in_small_unit, written

__all__ = ["DesignPlot"]

Looks = dict[str, tuple[str, str]]

_MEANINGS = {
    "K0": "bias",
    "K1": "scale factor",
    "K2": "second order",
    "K3": "third order",
    "M": "misalignment",
    "M_ip": "cross-coupling",
    "lam1": "bias by temperature",
    "beta1": "scale factor by temperature",
    "gam1": "misalignment by temperature",
}
_WIDE = 6.0
_NARROW = 0.1  # of the values: an axis that spans less would make much of what matters to nobody
_ACROSS = 3
_LETTER = (0.028, 0.055)  # of a panel: width and height of one in a label
_BESIDE = (0.02, 0.022)  # of a panel: from a point to its label
_POINT = (0.01, 0.013)  # of a panel: half width and height of a point
_LABELLED = 16  # tests; of more, only those on the front are named
_MARKERS = "os^"
_COLUMNS = 4
_OTHERS = "other tests"


class DesignPlot(Pictures[DesignComparison | OptimalDesign]):
    """Pictures of tests that `accelcal.design` or `accelcal.optimal_design` compared."""

    __slots__ = ()

    @styled
    def hours(self, axes: Any = None) -> Any:
        """Draw the uncertainty of each coefficient against the hours of each test.

        Parameters
        ----------
        axes : array-like of Axes, optional
            As many axes as coefficients are drawn.

        Returns
        -------
        ndarray of Axes
            A point is a test, its number that of the positions (where there is room for it), its
            colour and form tell strokes, levels and mountings; the line joins the tests that no
            quicker one equals.

        Examples
        --------
        >>> import accelcal
        >>> found = accelcal.design(
        ...     positions=[8], strokes=[2], temperatures=[(20.0,)], effects=False
        ... )
        >>> len(found.plot.hours())
        6
        """
        found = self.result
        comparison = found.comparison if isinstance(found, OptimalDesign) else found
        names = [name for name in _MEANINGS if name in comparison.names()]
        looks, labels = _looks(comparison), [design.stops for design in comparison.designs]
        if comparison is not found:
            labels[0] = "best"
        if axes is None:
            axes = _own(len(names), looks, comparison)
        panels = canvases(axes, len(names), 1, (0.0, 0.0))
        for ax, name in zip(panels, names, strict=True):
            _draw(ax, comparison, name, looks, labels)
        return panels


def _own(count: int, looks: Looks, found: DesignComparison) -> Any:
    """Make a figure of its own, with a legend below."""
    handles = _legend(looks, found)
    axes = own_panels(count, _ACROSS, (4.0, 3.1), around=0.5 + 0.2 * -(-len(handles) // _COLUMNS))
    figure = axes[0].figure
    figure.suptitle(
        "Expected standard uncertainty u by hours of testing; numbers: positions in a turn"
    )
    figure.legend(handles=handles, loc="outside lower center", ncols=_COLUMNS)
    return axes


def _draw(ax: Any, found: DesignComparison, name: str, looks: Looks, labels: list[str]) -> None:
    """Fill one panel: a point for each test, and the line of the front."""
    front = found.front(name)
    unit, factor, named = "", 1.0, []
    for place, design in enumerate(found.designs):
        forecast = design.forecast(name)
        if forecast is None:
            continue
        factor, unit = in_small_unit(forecast.unit)
        x, y = design.hours, factor * forecast.standard_uncertainty
        marker, colour = looks.get(_kind(design)) or looks[_OTHERS]
        inside = "none" if forecast.stands_for else colour
        ax.plot(x, y, marker, ms=5.5, mfc=inside, mec=colour, zorder=3)
        if place in front or len(found.designs) <= _LABELLED:
            named.append((labels[place], x, y))
    on_front = [(found.designs[i].hours, found.designs[i].forecast(name)) for i in front]
    line = [(x, factor * f.standard_uncertainty) for x, f in on_front if f is not None]
    ax.plot(*np.reshape(line, (-1, 2)).T, "-", color=palette().muted, lw=2.0, alpha=0.6, zorder=1)
    if name in found.targets:
        _target(ax, factor * found.targets[name])
    title = f"{typeset(name)}, {_MEANINGS[name]}"
    ax.set(title=title, xlabel="hours", ylabel=f"u [{written(unit)}]")
    _scales(ax)
    _name(ax, named)


def _name(ax: Any, named: list[tuple[str, float, float]]) -> None:
    """Write beside each point what it is: within the panel, above it or below, if there is room."""
    at = np.array([(x, y) for _, x, y in named]).reshape(-1, 2)
    places = ax.transAxes.inverted().transform(ax.transData.transform(at))
    taken = [place + np.array([[-1.0], [1.0]]) * _POINT for place in places]
    for (label, x, y), place in zip(named, places, strict=True):
        left = place[0] > 0.5
        rooms = {below: _room(label, place, left=left, below=below) for below in (False, True)}
        free = [below for below, room in rooms.items() if not _overlap(room, taken)]
        if not free:
            continue
        below = free[0]
        taken.append(rooms[below])
        ax.annotate(
            label,
            (x, y),
            (-4 if left else 4, -4 if below else 4),
            ha="right" if left else "left",
            va="top" if below else "bottom",
            textcoords="offset points",
            fontsize=8,
        )


def _room(label: str, place: Array, *, left: bool, below: bool) -> Array:
    """Lower left and upper right corner of a label [of a panel], rows."""
    size = np.array([_LETTER[0] * len(label), _LETTER[1]])
    towards = np.array([-1.0 if left else 1.0, -1.0 if below else 1.0])
    near = place + towards * _BESIDE
    return np.sort([near, near + towards * size], axis=0)


def _overlap(room: Array, taken: list[Array]) -> bool:
    return any(((room[0] < other[1]) & (other[0] < room[1])).all() for other in taken)


def _target(ax: Any, limit: float) -> None:
    ax.axhline(limit, color=palette().ink, ls="--", lw=1.0)
    ax.annotate(
        "target",
        (1.0, limit),
        (-4, 3),
        ha="right",
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
        fontsize=8,
    )


def _scales(ax: Any) -> None:
    """Make axes logarithmic where the values span so much; else ticks are easier to read."""
    ax.margins(0.1)
    for axis, which in ((ax.xaxis, "x"), (ax.yaxis, "y")):
        low, high = sorted(axis.get_data_interval())
        if low > 0.0 and high / low > _WIDE:
            ax.set(**{f"{which}scale": "log"})
            short_log_ticks(axis, (1, 2, 5), digits=3)
        else:
            ax.ticklabel_format(axis=which, useOffset=False)
            middle, half = (low + high) / 2.0, 0.6 * (high - low)
            half = max(half, _NARROW * abs(middle) / 2.0)
            ax.set(**{f"{which}lim": (middle - half, middle + half)})


def _kind(design: TestDesign) -> str:
    """What the colour tells."""
    levels = ", ".join(f"{t:g}" for t in design.temperatures).replace("-", "−")
    strokes = counted(design.strokes, "stroke")
    return f"{strokes} at {levels} °C, {' '.join(design.mountings)}"


def _looks(found: DesignComparison) -> Looks:
    """Marker and colour of each kind of test; those beyond the last pair look alike."""
    kinds = dict.fromkeys(_kind(design) for design in found.designs)
    pairs = [(marker, colour) for marker in _MARKERS for colour in palette().series]
    looks = dict(zip(kinds, pairs, strict=False))
    return looks if len(looks) == len(kinds) else {**looks, _OTHERS: ("o", palette().muted)}


def _legend(looks: Looks, found: DesignComparison) -> list[Any]:
    from matplotlib.lines import Line2D

    shown = looks.items()
    kinds = [Line2D([], [], marker=m, ls="", color=c, label=kind) for kind, (m, c) in shown]
    muted = palette().muted
    front = Line2D([], [], color=muted, lw=2.0, label="Pareto front: no quicker test is as good")
    if not any(f.stands_for for design in found.designs for f in design.forecasts):
        return [*kinds, front]
    hollow = Line2D([], [], marker="o", ls="", mfc="none", color=muted, label="of a sum, see text")
    return [*kinds, front, hollow]
