"""The action of a discovered effect over the residuals that it explains."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.action import Action, action
from accelcal.plot.residuals import Readings
from accelcal.plot.style import canvas, entitled, palette, styled
from accelcal.report.lines import sentence
from accelcal.report.numbers import readable

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from accelcal.record import TumbleRecord
    from accelcal.results.discovery import Discovery

_ONE_OF = 0.9
"""Part of an action's squares that must follow a quantity for it to be drawn along that."""


class _Along(NamedTuple):
    """What the action is drawn along; where directions lie apart, each has its own line."""

    label: str
    value: Array
    jitter: float


@styled
def signature(
    discovery: Discovery, record: TumbleRecord, effect: str | None, ax: Axes | None
) -> Axes:
    """Draw `DiscoveryPlot.signature`."""
    found = action(discovery, record, effect)
    along = _along(found)
    ax = canvas(ax)
    colours, (factor, unit) = palette(), readable("g", found.residual)
    ax.axhline(0.0, color=colours.ink, lw=0.8)
    stroke = np.asarray(record.stroke)
    readings = Readings(along.value, stroke, factor * found.residual)
    acting = Readings(along.value, stroke, factor * found.change)
    for number, name, part in readings.directions():
        at = part.angle + along.jitter * (2 * number - 1)
        colour = colours.series[number]
        ax.scatter(at, part.value, s=10, alpha=0.45, lw=0, color=colour, label=name)
    if along.jitter:
        for number, name, part in acting.directions():
            at, line, _ = part.means()
            colour, shift = colours.series[number], along.jitter * (2 * number - 1)
            ax.plot(at + shift, line, color=colour, label=f"effect, {name}")
    else:
        at, line, _ = acting.means()
        ax.plot(at, line, color=colours.ink, label="effect")
    ax.set(xlabel=along.label, ylabel=f"reading − model without it [{unit}]")
    if along.label.startswith("head"):
        ax.set_xticks(np.arange(0.0, 361.0, 45.0))
    return entitled(ax, sentence(found.name), columns=4)


def _along(found: Action) -> _Along:
    """Head angle, temperature or time in the run, whichever the action follows; else the order."""
    c = found.conditions
    direction = (c.stroke % 2).astype(float)
    tried = (
        (_Along("head angle [°]", c.angle, 1.5), direction),
        (_Along("temperature − T0 [°C]", np.round(c.excess, 0), 0.4), direction),
        (_Along("time in the run [min]", np.round(c.run_time / 60.0), 0.0), direction),
        (_Along("stroke", c.stroke.astype(float), 0.0), np.zeros(c.stroke.size)),
    )
    for along, other in tried:
        if _followed(found.change, along.value, other) > _ONE_OF:
            return along
    return _Along("reading, in the order of measuring", c.number.astype(float), 0.0)


def _followed(change: Array, value: Array, other: Array) -> float:
    """Part of the squares of an action that the means over one quantity and another have."""
    _, group = np.unique(np.stack([value, other]), axis=1, return_inverse=True)
    group = group.ravel()
    if group.max() + 1 > 0.5 * change.size:
        return 0.0
    means = np.bincount(group, change) / np.bincount(group)
    whole = float(change @ change)
    return float(means[group] @ means[group]) / whole if whole > 0.0 else 0.0
