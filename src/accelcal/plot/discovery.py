"""Pictures of a discovery, as ``discovery.plot``."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from accelcal.arrays import Array, Ints
from accelcal.discovery.in_use.action import Action, action
from accelcal.model import symbol_of
from accelcal.numerics.grouping import grouped
from accelcal.plot.residuals import ReadingValues
from accelcal.plot.style import SMALL, Pictures, canvas, entitled, palette, styled
from accelcal.plot.ticks import literal
from accelcal.report.discovery import with_doubts
from accelcal.report.findings import p_value, parts_of_disagreement
from accelcal.report.lines import sentence
from accelcal.report.typeset import typeset
from accelcal.results.discovery import Discovery
from accelcal.shown_units import readable

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from accelcal.record import TumbleRecord
    from accelcal.results.findings import Change, Share

__all__ = ["DiscoveryPlot"]

_LONGEST_NAME = 16

_UNCHANGED = 0.02
"""An effect that moves a coefficient by less, over its half width, leaves it as it was."""

_ONE_OF = 0.9
"""Part of an action's squares that must follow a quantity for it to be drawn along that."""


class DiscoveryPlot(Pictures[Discovery]):
    """Pictures of a discovery.

    Examples
    --------
    >>> import accelcal
    >>> record = accelcal.simulate(effects=[accelcal.effect("backlash").of(5e-5)], seed=1)
    >>> accelcal.discover(record).plot.gap().get_ylabel()
    'gap, rms [µg]'
    """

    __slots__ = ()

    @styled
    def gap(self, ax: Axes | None = None) -> Axes:
        """Draw the gap between model and readings, effect by effect, fitted and held out.

        Parameters
        ----------
        ax : Axes, optional
            Axes to draw into.

        Returns
        -------
        Axes
            The dashed line is the noise of a reading.
        """
        steps, fitted, held_out = zip(*_steps(self.result), strict=True)
        noise = next((s.value for s in self.result.noise if s.name == "reading"), None)
        known = [size for size in (*fitted, *held_out, noise) if size is not None]
        factor, unit = readable("g", known)
        ax = canvas(ax, (max(4.6, 2.6 + 1.5 * len(steps)), 3.6))
        ax.grid(visible=False, axis="x")
        _descent(ax, factor, fitted, 0, "o-", "fitted readings")
        _descent(ax, factor, held_out, 1, "s--", "readings left out")
        if noise is not None:
            ax.axhline(factor * noise, color=palette().muted, ls=":", label="noise of a reading")
        names = [textwrap.fill(literal(step), _LONGEST_NAME) for step in steps]
        ax.set_xticks(range(len(steps)), names)
        ax.set(
            ylabel=f"gap, rms [{unit}]",
            xlim=(-0.5, len(steps) - 0.5),
            ylim=(0.0, 1.18 * factor * max(known)),
        )
        return entitled(ax, "Gap between model and readings")

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
        return draw_where(self.result.where, self.result.alpha, ax)

    @styled
    def signature(
        self, record: TumbleRecord, effect: str | None = None, ax: Axes | None = None
    ) -> Axes:
        """Draw the action of an effect over the residuals that it explains.

        Parameters
        ----------
        record : TumbleRecord
            The readings in which it was found.
        effect : str, optional
            Its id; the first one found without it.
        ax : Axes, optional
            Axes to draw into.

        Returns
        -------
        Axes
            Points are the readings less the model without this effect.

        Raises
        ------
        InputError
            If no such effect was found, or the record does not suit the discovery.
        """
        found = action(self.result, record, effect)
        along = _along(found, self.result.T0_degC)
        ax = canvas(ax)
        colours, (factor, unit) = palette(), readable("g", found.residual)
        ax.axhline(0.0, color=colours.ink, lw=0.8)
        stroke = np.asarray(record.stroke)
        acting = ReadingValues(along.value, stroke, factor * found.change)
        groups = [(n, name, along.group == n) for n, name in enumerate(along.names)]
        groups = [one for one in groups if one[2].any()]
        for number, name, own in groups:
            at = along.value[own] + along.jitter * (2 * number - 1)
            left, colour = factor * found.residual[own], colours.series[number]
            ax.scatter(at, left, s=10, alpha=0.45, lw=0, color=colour, label=name)
        for number, name, own in groups if along.apart else ():
            at, line, _ = acting.of(own).means()
            shift = along.jitter * (2 * number - 1)
            label = f"effect, {name}" if len(groups) < 3 else None  # of many, points tell colours
            ax.plot(at + shift, line, color=colours.series[number], label=label)
        if not along.apart:
            at, line, _ = acting.means()
            ax.plot(at, line, color=colours.ink, label="effect")
        ax.set(xlabel=along.label, ylabel=f"reading − model without it [{unit}]")
        if along.label.startswith("head"):
            ax.set_xticks(np.arange(0.0, 361.0, 45.0))
        return entitled(ax, literal(sentence(found.name)), columns=4)

    @styled
    def changes(self, ax: Axes | None = None) -> Axes:
        """Draw what the effects change in the coefficients.

        Parameters
        ----------
        ax : Axes, optional
            Axes to draw into.

        Returns
        -------
        Axes
            Coefficients without and with the effects, in 95 % half widths of the fit without them;
            those are named unchanged that the effects leave as they were.
        """
        shown = [
            change
            for change in self.result.coefficients
            if None not in (change.before.value, change.after.value)
            and change.before.expanded_uncertainty
        ]
        ax = canvas(ax, (6.4, max(1.7 + 0.3 * len(shown), 2.2)))
        ax.grid(visible=False, axis="y")
        ax.axvspan(
            -1.0, 1.0, color=palette().muted, alpha=0.18, lw=0, label="without, 95 % interval"
        )
        label: str | None = "with the effects, 95 % interval"
        for place, (moved, wide) in enumerate(map(_moved, shown)):
            if max(abs(moved), abs(wide - 1.0)) < _UNCHANGED:
                ax.text(0.0, place, "unchanged", ha="center", va="center", fontsize=SMALL)
                continue
            colour = palette().series[1]
            ax.errorbar(moved, place, xerr=wide, marker="o", ls="", color=colour, label=label)
            label = None
        symbols = [typeset(symbol_of(change.coefficient)) for change in shown]
        ax.set_yticks(range(len(shown)), symbols)
        ax.set_ylim(len(shown) - 0.4, -0.6)
        ax.set(xlabel="change over U (95 %) without the effects [1]")
        low, high = ax.get_xlim()
        ax.set_xlim(
            min(low, -3.0), max(high, 3.0)
        )  # or the band from -1 to 1 could fill the picture
        return entitled(ax, "What the effects change in the coefficients")


def _steps(discovery: Discovery) -> Iterator[tuple[str, float, float | None]]:
    """What is done step by step, and the gap then of fitted readings and of those left out [g]."""
    yield "model alone", discovery.before.rms, discovery.before.heldout_rms
    if discovery.faults:
        yield "faults of the readings mended", *discovery.mended
    for effect in discovery.effects:
        yield f"+ {with_doubts(discovery, effect)}", effect.gap_after, effect.heldout_after


def _descent(
    ax: Axes, factor: float, sizes: Sequence[float | None], number: int, line: str, label: str
) -> None:
    values = factor * np.array(sizes, dtype=float)  # NaN for None
    ax.plot(range(values.size), values, line, color=palette().series[number], label=label)


def _moved(change: Change) -> tuple[float, float]:
    """Change of a coefficient and its new half width, over its half width without the effects."""
    before, after = change.before, change.after
    unit = before.expanded_uncertainty or 1.0
    moved = (after.value or 0.0) - (before.value or 0.0)
    return moved / unit, (after.expanded_uncertainty or 0.0) / unit


@styled
def draw_where(
    found: Sequence[Share],
    alpha: float,
    ax: Axes | None,
    title: str = "Where model and readings disagree",
) -> Axes:
    """Draw the parts of the disagreement as the report lists them; believed are p below alpha."""
    names, shares, chances = zip(*parts_of_disagreement(found), strict=True)
    colours = palette()
    ax = canvas(ax, (6.4, max(1.6 + 0.28 * len(shares), 2.2)))
    ax.grid(visible=False, axis="y")
    sure = [chance is not None and chance < alpha for chance in chances]
    sizes = [100.0 * share for share in shares]
    for believed, name in ((True, f"p < {alpha:g}"), (False, "may be noise")):
        rows = [i for i, one in enumerate(sure) if one == believed]
        colour = colours.series[0] if believed else colours.muted
        if rows:
            ax.barh(rows, [sizes[i] for i in rows], 0.62, color=colour, label=name)
    most = max(sizes, default=1.0)
    for place, chance in enumerate(chances):
        said = "" if chance is None else p_value(chance)
        ax.text(sizes[place] + 0.015 * most, place, said, va="center", fontsize=SMALL)
    ax.set_yticks(
        range(len(shares)), [textwrap.fill(name.replace("*", " × "), 22) for name in names]
    )
    ax.invert_yaxis()
    ax.set(xlabel="share of the disagreement [%]", xlim=(0.0, 1.25 * most or 1.0))
    ax.set_xticks([tick for tick in ax.get_xticks() if tick <= 100.0])
    return entitled(ax, title)


class _Along(NamedTuple):
    """What the action is drawn along, in groups; where these lie apart, each has its own line."""

    label: str
    value: Array
    group: Ints
    names: Sequence[str]
    jitter: float = 0.0
    apart: bool = True


def _along(found: Action, T0_degC: float) -> _Along:
    """Head angle, temperature or time in the run, whichever the action follows; else the order."""
    c = found.conditions
    one_way = (c.stroke % 2 == 0).astype(int), ("forward", "back")
    levels = grouped(np.round(c.excess, 0))
    names = [f"{T0_degC + excess:g} °C".replace("-", "−") for excess in levels.key]
    at_levels = levels.cell, names[: len(palette().series)]
    minutes = np.round(c.run_time / 60.0)
    tried = (
        _Along("head angle [°]", c.angle, *one_way, jitter=1.5),
        _Along("temperature − T0 [°C]", np.round(c.excess, 0), *one_way, jitter=0.4),
        _Along("head angle [°]", c.angle, *at_levels),
        _Along("time in the run [min]", minutes, *one_way, apart=False),
        _Along("stroke", c.stroke.astype(float), *one_way, apart=False),
    )
    for along in tried:
        groups = [along.group.astype(float)] if along.label != "stroke" else []
        if found.follows(along.value, *groups) > _ONE_OF and along.group.max() < len(along.names):
            return along
    order = c.number.astype(float)
    return _Along("reading, in the order of measuring", order, *one_way, apart=False)
