"""The gap that a discovery closes, where the disagreement is, and what changes."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from accelcal.plot.style import SMALL, canvas, entitled, palette, styled
from accelcal.report.findings import p_value
from accelcal.report.numbers import readable

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from accelcal.results.discovery import Discovery
    from accelcal.results.findings import Change, Share

_LONGEST_NAME = 16


@styled
def gap(discovery: Discovery, ax: Axes | None) -> Axes:
    """Draw `DiscoveryPlot.gap`."""
    steps, fitted, held_out = zip(*_steps(discovery), strict=True)
    noise = next((s.value for s in discovery.noise if s.name == "reading"), None)
    known = [size for size in (*fitted, *held_out, noise) if size is not None]
    factor, unit = readable("g", known)
    ax = canvas(ax, (max(4.6, 2.6 + 1.5 * len(steps)), 3.6))
    ax.grid(visible=False, axis="x")
    _descent(ax, factor, fitted, 0, "o-", "fitted readings")
    _descent(ax, factor, held_out, 1, "s--", "held-out readings")
    if noise is not None:
        ax.axhline(factor * noise, color=palette().muted, ls=":", label="noise of a reading")
    names = [textwrap.fill(step, _LONGEST_NAME) for step in steps]
    ax.set_xticks(range(len(steps)), names)
    ax.set(
        ylabel=f"gap, rms [{unit}]",
        xlim=(-0.5, len(steps) - 0.5),
        ylim=(0.0, 1.18 * factor * max(known)),
    )
    return entitled(ax, "Gap between model and readings")


def _steps(discovery: Discovery) -> Iterator[tuple[str, float, float | None]]:
    """What is done step by step, and the gap then of fitted and held-out readings [g]."""
    yield "model alone", discovery.before.rms, discovery.before.heldout_rms
    if discovery.faults:
        yield "faults of the readings mended", *discovery.mended
    for effect in discovery.effects:
        yield f"+ {effect.name}", effect.gap_after, effect.heldout_after


def _descent(
    ax: Axes, factor: float, sizes: Sequence[float | None], number: int, line: str, label: str
) -> None:
    values = [np.nan if size is None else factor * size for size in sizes]
    ax.plot(range(len(values)), values, line, color=palette().series[number], label=label)


# -- where -----------------------------------------------------------------------------------------


@styled
def where(found: Sequence[Share], alpha: float, ax: Axes | None) -> Axes:
    """Draw the shares of the factors from the largest down; believed are those below alpha."""
    shares = sorted(found, key=lambda item: -item.share)
    colours = palette()
    ax = canvas(ax, (6.4, max(1.6 + 0.28 * len(shares), 2.2)))
    ax.grid(visible=False, axis="y")
    sure = [share.p_value < alpha for share in shares]
    sizes = [100.0 * share.share for share in shares]
    for believed, name in ((True, f"p < {alpha:g}"), (False, "may be noise")):
        rows = [i for i, one in enumerate(sure) if one == believed]
        colour = colours.series[0] if believed else colours.muted
        if rows:
            ax.barh(rows, [sizes[i] for i in rows], 0.62, color=colour, label=name)
    most = max(sizes, default=1.0)
    for place, share in enumerate(shares):
        chance = p_value(share.p_value)
        ax.text(sizes[place] + 0.015 * most, place, chance, va="center", fontsize=SMALL)
    ax.set_yticks(range(len(shares)), [_in_words(share.factor) for share in shares])
    ax.invert_yaxis()
    ax.set(xlabel="share of the disagreement [%]", xlim=(0.0, 1.25 * most or 1.0))
    ax.set_xticks([tick for tick in ax.get_xticks() if tick <= 100.0])
    return entitled(ax, "Where model and readings disagree")


def _in_words(factor: str) -> str:
    return factor.replace("*", " × ")


# -- changes ---------------------------------------------------------------------------------------

_UNCHANGED = 0.02
"""An effect that moves a coefficient by less, over its half width, leaves it as it was."""


@styled
def changes(discovery: Discovery, ax: Axes | None) -> Axes:
    """Draw `DiscoveryPlot.changes`."""
    shown = [
        change
        for change in discovery.coefficients
        if None not in (change.before.value, change.after.value)
        and change.before.expanded_uncertainty
    ]
    ax = canvas(ax, (6.4, max(1.7 + 0.3 * len(shown), 2.2)))
    ax.grid(visible=False, axis="y")
    ax.axvspan(-1.0, 1.0, color=palette().muted, alpha=0.18, lw=0, label="without, 95 % interval")
    label: str | None = "with the effects, 95 % interval"
    for place, (moved, wide) in enumerate(map(_moved, shown)):
        if max(abs(moved), abs(wide - 1.0)) < _UNCHANGED:
            ax.text(0.0, place, "unchanged", ha="center", va="center", fontsize=SMALL)
            continue
        colour = palette().series[1]
        ax.errorbar(moved, place, xerr=wide, marker="o", ls="", color=colour, label=label)
        label = None
    ax.set_yticks(range(len(shown)), [change.coefficient for change in shown])
    ax.set_ylim(len(shown) - 0.4, -0.6)
    ax.set(xlabel="change, over the 95 % half width without the effects [1]")
    low, high = ax.get_xlim()
    ax.set_xlim(min(low, -3.0), max(high, 3.0))  # or the band from -1 to 1 could fill the picture
    return entitled(ax, "What the effects change in the coefficients")


def _moved(change: Change) -> tuple[float, float]:
    """Change of a coefficient and its new half width, over its half width without the effects."""
    before, after = change.before, change.after
    unit = before.expanded_uncertainty or 1.0
    moved = (after.value or 0.0) - (before.value or 0.0)
    return moved / unit, (after.expanded_uncertainty or 0.0) / unit
