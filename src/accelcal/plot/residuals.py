"""Residuals by head angle, as a map of angle and stroke, and round the turn; means by angle."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from accelcal.arrays import Array, Ints
from accelcal.head_angles import head_positions
from accelcal.numerics.grouping import distinct, grouped
from accelcal.numerics.probability import LEVEL, student_quantile
from accelcal.plot.style import SMALL, canvas, entitled, palette, styled
from accelcal.plot.ticks import literal, name_ticks, shortened
from accelcal.report.calibration_rows import mounting_unless_named
from accelcal.results.usable import tables_of_run
from accelcal.shown_units import readable

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from accelcal.results.calibration import Calibration
    from accelcal.results.table import TableCalibration


@dataclass(frozen=True, slots=True, eq=False)
class ReadingValues:
    """A value for each reading of a tumble test."""

    angle: Array  # shape (n,): head angle [deg]
    stroke: Ints  # shape (n,): stroke; odd ones run forward
    value: Array  # shape (n,): such as a residual [g]

    def directions(self) -> Iterator[tuple[int, str, ReadingValues]]:
        """Iterate over what was read forward and what back, with its number and name."""
        for number, name in enumerate(("forward", "back")):
            here = self.stroke % 2 == 1 - number
            if here.any():
                yield number, name, self.of(here)

    def of(self, here: Array) -> ReadingValues:
        """Take some of the readings."""
        return ReadingValues(self.angle[here], self.stroke[here], self.value[here])

    def means(self) -> tuple[Array, Array, Array]:
        """Head angles, mean at each, and half width of its 95 % interval by Student.

        Three readings of an angle or more have a scatter of their own; fewer have that of all
        angles together. NaN where this has less than two degrees of freedom, too.
        """
        angles, members = (found := grouped(self.angle)).key, found.members
        own = [self.value[places] for places in found.parts]
        means = np.array([part.mean() for part in own])
        squares = np.array([part.var() * part.size for part in own])
        dof = members - 1
        few = dof < _LEAST_DOF
        squares[few], dof[few] = squares.sum(), dof.sum()
        factors = np.array([student_quantile(LEVEL, d) if d >= _LEAST_DOF else np.nan for d in dof])
        return angles, means, factors * np.sqrt(squares / np.maximum(dof, 1) / members)


_MARKERS = (">", "<")
_LEAST_DOF = 2  # of a scatter that tells an interval; Student's factor of one is 12.7
_APART = 2.0  # deg of a mean from its head angle, forward one side and back the other
_BESIDE = 1.8  # deg of the readings from their mean, whose interval would hide them
_ROOM = 10.0  # deg that both directions take, with what is free up to the next angle
_ONE_POSITION = 0.1  # deg; encoders read angles of one position that are closer
_MOST_NAMED = 12  # angles or runs that have each its own label
_CROWDED = 400  # points; more of them are drawn fainter
_MOST_ROWS = 720  # angles of a map; more of them, as an encoder measures them, share whole degrees
_PIXELS = 3000  # points or cells; more of them are drawn as pixels even in SVG and PDF


@styled
def residuals(calibration: Calibration, ax: Axes | None, *, run: str | int | None) -> Axes:
    """Draw `CalibrationPlot.residuals`."""
    tables = tables_of_run(calibration, run)
    ax = draw_by_angle(canvas(ax), _readings(tables), "residual")
    return entitled(ax, _title("Residuals by head angle", tables, run))


def draw_by_angle(ax: Axes, readings: ReadingValues, what: str) -> Axes:
    """Draw means by angle and direction with 95 % intervals, and the readings beside them."""
    colours, (factor, unit) = palette(), readable("g", readings.value)
    faint = 0.45 if readings.value.size < _CROWDED else 0.15
    ax.axhline(0.0, color=colours.ink, lw=0.8)
    narrowed = _narrowed(readings.angle)
    for number, name, part in readings.directions():
        side = narrowed * (2 * number - 1)
        marked: Any = {"color": colours.series[number], "marker": _MARKERS[number]}
        value, pixels = factor * part.value, part.value.size > _PIXELS
        at = part.angle + side * (_APART + _BESIDE)
        ax.scatter(at, value, s=11, alpha=faint, lw=0, rasterized=pixels, **marked)
        angles, means, half = part.means()
        told = np.isfinite(half)
        error = np.where(told, factor * half, 0.0)
        interval = ", 95 % interval" if told.any() else ""
        ax.errorbar(
            angles + side * _APART,
            factor * means,
            error,
            ls="",
            rasterized=3 * means.size > _PIXELS,  # a marker, a line and its ends
            label=f"{name}: readings, mean{interval}",
            **marked,
        )
    _name_angles(ax, readings.angle)
    ax.set(xlabel="head angle [°]", ylabel=f"{what} [{unit}]")
    ax.margins(y=0.08)
    return ax


def _narrowed(angles: Array) -> float:
    """Factor of the distances from an angle, by which both directions stay clear of the next."""
    gaps = np.diff(np.unique(angles))
    return float(gaps[gaps > _ONE_POSITION].min(initial=_ROOM)) / _ROOM


def _name_angles(ax: Axes, angles: Any) -> None:
    whole = 45.0 if np.ptp(angles) > 180.0 else 15.0
    low, high = whole * np.floor(np.min(angles) / whole), whole * np.ceil(np.max(angles) / whole)
    ax.set_xticks(np.arange(low, high + 1.0, whole))


def _readings(tables: Sequence[TableCalibration]) -> ReadingValues:
    parts = [table.residuals for table in tables]
    return ReadingValues(
        np.array([angle for part in parts for angle in part.angle_deg], dtype=float),
        np.array([stroke for part in parts for stroke in part.stroke], dtype=int),
        np.array([value for part in parts for value in part.value], dtype=float),
    )


def _title(what: str, tables: Sequence[TableCalibration], run: str | int | None) -> str:
    if run is not None:
        return f"{what}, run {shortened(str(run), 30)}"
    return what if len(tables) == 1 else f"{what}, {len(tables)} tables"


# -- map -------------------------------------------------------------------------------------------


@styled
def residual_map(calibration: Calibration, ax: Axes | None) -> Axes:
    """Draw `CalibrationPlot.residual_map`."""
    tables = calibration.tables
    rows = _rows({angle for table in tables for angle in table.residuals.angle_deg})
    angles = sorted(set(rows.values()))
    blocks = [_grid(table, rows) for table in tables]
    widths = [block.shape[1] for block in blocks]
    height = min(max(2.2 + 0.18 * len(angles), 3.0), 7.0)
    ax = canvas(ax, (min(max(4.5 + 0.06 * sum(widths), 5.2), 9.0), height))
    _heat_map(ax, np.hstack(blocks) if angles else np.full((1, 1), np.nan))
    name_ticks(ax.yaxis, np.arange(len(angles)) + 0.5, [f"{a:g}" for a in angles], _MOST_NAMED)
    shared = len(angles) < len(rows)
    ax.set_ylabel("head angle, in whole degrees [°]" if shared else "head angle [°]")
    _name_runs(ax, tables, widths)
    ax.set_title("Residuals by head angle and stroke", pad=8.0)
    return ax


def _rows(angles: Collection[float]) -> dict[float, float]:
    """Row of each head angle; of too many, those of a whole degree share one."""
    shared = len(angles) > _MOST_ROWS
    return {angle: float(round(angle)) if shared else angle for angle in angles}


def _heat_map(ax: Axes, cells: Array) -> None:
    """Draw residuals as colours, hatched where there is none, with the scale beside."""
    from matplotlib.colors import LinearSegmentedColormap

    colours, (factor, unit) = palette(), readable("g", cells)
    largest = factor * float(np.nanmax(np.abs(cells), initial=0.0)) or 1.0
    low, high = colours.series[:2]
    shades = LinearSegmentedColormap.from_list("residual", (low, colours.middle, high))
    ax.grid(visible=False)
    ax.patch.set(hatch="////", edgecolor=colours.muted, facecolor=colours.grid)
    drawn: Any = {"vmin": -largest, "vmax": largest, "rasterized": cells.size > _PIXELS}
    image = ax.pcolormesh(factor * cells, cmap=shades, **drawn)
    bar = ax.figure.colorbar(image, ax=ax, pad=0.02, label=f"residual [{unit}]")
    bar.outline.set_edgecolor(colours.muted)
    bar.ax.tick_params(labelsize=SMALL, colors=colours.ink)


def _grid(table: TableCalibration, rows: Mapping[float, float]) -> Any:
    """Mean residuals by angle of a row and stroke; NaN where there is no reading."""
    found, angles = table.residuals, distinct(np.array([*rows.values()]))
    strokes = distinct(np.array(found.stroke or [1]))
    row = np.searchsorted(angles, [rows[angle] for angle in found.angle_deg])
    column = np.searchsorted(strokes, found.stroke)
    sums = np.zeros((max(angles.size, 1), strokes.size))
    count = np.zeros_like(sums)
    np.add.at(sums, (row, column), found.value)
    np.add.at(count, (row, column), 1.0)
    return np.divide(sums, count, out=np.full_like(sums, np.nan), where=count > 0.0)


def _name_runs(ax: Axes, tables: Sequence[TableCalibration], widths: Sequence[int]) -> None:
    """Strokes below and lines between runs where there is room, and the runs above."""
    ends = np.cumsum([0, *widths])
    for end in ends[1:-1] if len(tables) <= _MOST_NAMED else ():
        ax.axvline(end, color=palette().ink, lw=0.8)
    room = sum(widths) <= 2 * _MOST_NAMED
    strokes = [str(k) for width in widths for k in range(1, width + 1)]
    ax.set_xticks(np.arange(ends[-1]) + 0.5 if room else [], strokes if room else [])
    ax.set_xlabel("stroke (odd forward, even back)" if room else "strokes of each run, in order")
    if len(tables) == 1:
        return
    above = ax.secondary_xaxis("top")
    centres = (ends[:-1] + ends[1:]) / 2
    sides = len({table.mounting for table in tables}) > 1
    names = [_level(table, mounting_unless_named(table) if sides else "") for table in tables]
    name_ticks(above.xaxis, centres, names, 8, fontsize=SMALL)
    above.tick_params(length=0, colors=palette().ink)
    above.spines["top"].set_visible(False)


def _level(table: TableCalibration, side: str) -> str:
    """Run, mounting and temperature of a table, as far as they are to be told."""
    run = f"run {literal(table.run)}" if len(table.run) <= 8 else shortened(table.run, 12)
    if table.temperature_degC is None:
        return run + side
    return f"{run}{side}\n{table.temperature_degC:.0f} °C".replace("-", "−")


# -- round the turn --------------------------------------------------------------------------------


@styled
def tumble(calibration: Calibration, ax: Axes | None, *, run: str | int | None) -> Axes:
    """Draw `CalibrationPlot.tumble`."""
    tables = tables_of_run(calibration, run)
    readings, colours = _readings(tables), palette()
    factor, unit = readable("g", readings.value)
    ax = canvas(ax, (4.8, 4.8), polar=True)
    ax.set_theta_zero_location("N")  # type: ignore[attr-defined]
    ax.set_theta_direction(-1)  # type: ignore[attr-defined]
    turn = np.radians(np.linspace(0.0, 360.0, 181))
    ax.plot(turn, np.zeros(turn.size), color=colours.ink, lw=1.1, label="zero")
    for number, name, part in readings.directions():
        colour, marker = colours.series[number], _MARKERS[number]
        angles, means, half = _closed(part)
        th, middle = np.radians(angles), factor * means
        wide = factor * np.nan_to_num(half)
        ax.fill_between(th, middle - wide, middle + wide, color=colour, alpha=0.18, lw=0)
        ax.plot(th, middle, color=colour, marker=marker, ms=4, label=f"{name}, 95 % band")
    largest = factor * float(np.abs(readings.value).max(initial=0.0)) or 1.0
    _rings(ax, largest, unit)
    ax.set_title(_title("Residuals round the turn", tables, run), pad=16.0)
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.08), ncols=3)
    return ax


def _closed(readings: ReadingValues) -> Array:
    """Means of a closed turn: a return to the start is another reading of it, as 0 and 360 deg."""
    turn = np.array(replace(readings, angle=head_positions(readings.angle)).means())
    again = turn[:, turn[0] == 0.0] + np.array([[360.0], [0.0], [0.0]])
    return np.hstack([turn, again])


def _rings(ax: Axes, largest: float, unit: str) -> None:
    """Rings of equal residual, each with its value, around the circle of zero."""
    from matplotlib.ticker import MaxNLocator

    ax.set_ylim(-2.2 * largest, 1.1 * largest)
    tried = MaxNLocator(4).tick_values(-largest, largest)
    rings = [ring for ring in tried if 0.0 < abs(ring) <= 1.1 * largest]
    names = [f"{ring:+g} {unit}".replace("-", "−") for ring in rings]
    ax.set_yticks(rings, names, fontsize=SMALL, ha="center")
    ax.set_rlabel_position(22.5)  # type: ignore[attr-defined]
    ax.set_xticks(np.radians(np.arange(0.0, 360.0, 45.0)))
    ax.spines["polar"].set_visible(False)
