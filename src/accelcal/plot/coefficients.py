"""Coefficients run by run, what has changed in each run, and where their uncertainty comes from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from accelcal.plot.style import SMALL, blank, canvas, canvases, entitled, palette, styled
from accelcal.plot.ticks import name_ticks, shortened
from accelcal.report.calibration_rows import SHOWN_COEFFICIENTS
from accelcal.report.numbers import matching_digits, significant
from accelcal.results.table import nearest_table
from accelcal.results.tables_in_use import tables_in_use
from accelcal.results.usable import tables_of_run
from accelcal.shown_units import readable

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from accelcal.results.calibration import Calibration
    from accelcal.results.disagreement import RunChange
    from accelcal.results.quantity import Quantity
    from accelcal.results.table import TableCalibration

_SHOWN = [row[:3] for row in SHOWN_COEFFICIENTS]  # name, symbol, coefficient whose budget it has
SYMBOLS = {"K1": "$K_1$", "k0": "$k_0$", "k2": "$k_2$", "k3": "$k_3$"}
SYMBOLS |= {"delta": r"$\delta$", "delta_ip": r"$\delta_{ip}$"}
"""Of coefficients, as TeX."""

_MOST_NAMED = 8
_LETTERS = 32  # of all names below a panel, where some are longer than "20 (2)"
_SHORT = 6
_LONGEST = 30
_SEEN = 0.2  # percent; less is no bar that anyone sees


@styled
def coefficients(calibration: Calibration, axes: Any) -> Any:
    """Draw `CalibrationPlot.coefficients`."""
    panels = canvases(axes, 2, 3, (10.0, 5.2))
    names = run_labels(_run_names(calibration.tables), calibration.tables)
    for ax, (name, symbol, _) in zip(panels, _SHOWN, strict=True):
        draw_runs(ax, [table.quantities[symbol] for table in calibration.tables], names)
        ax.set_title(f"{name.capitalize()} {SYMBOLS[symbol]}")
    return panels


def _run_names(tables: Sequence[TableCalibration]) -> list[str]:
    """Labels of the runs, with the mounting where there are several."""
    several = len({table.mounting for table in tables}) > 1
    return [f"{table.run} {table.mounting}" if several else table.run for table in tables]


def run_labels(names: Sequence[str], runs: Sequence[TableCalibration | RunChange]) -> list[str]:
    """Names of runs, each short and over its temperature where this is known."""
    known = [run.temperature_degC for run in runs]
    levels = ["" if t is None else f"\n{t:.0f}".replace("-", "−") for t in known]
    count, longest = min(len(names), _MOST_NAMED), max(map(len, names))
    most = min(7, _LETTERS // count) if longest > _SHORT else longest
    return [shortened(name, most) + level for name, level in zip(names, levels, strict=True)]


def draw_runs(ax: Axes, found: Sequence[Quantity], names: Sequence[str]) -> None:
    """Values with their intervals, side by side."""
    values = np.array([q.value for q in found], dtype=float)  # NaN for None
    half = np.array([q.expanded_uncertainty for q in found], dtype=float)
    if not np.isfinite(values).any():
        blank(ax, "not determined")
        return
    factor, unit = readable(next(q.unit for q in found if q.value is not None), values)
    ax.errorbar(
        np.arange(values.size),
        factor * values,
        factor * np.nan_to_num(half),
        ls="",
        marker="o",
        ms=4.5 if values.size < 20 else 3.0,
        color=palette().series[0],
    )
    ax.set(ylabel=f"value ± U (95 %) [{unit}]", xlim=(-0.6, values.size - 0.4))
    ax.ticklabel_format(axis="y", useOffset=False)
    name_ticks(ax.xaxis, range(len(names)), names, _MOST_NAMED)
    ax.set_xlabel("run, temperature [°C]" if any("\n" in name for name in names) else "run")
    if values.size == 1:
        _tell(ax, factor * values[0], factor * half[0], unit)


def _tell(ax: Axes, value: float, half: float, unit: str) -> None:
    text, wide = matching_digits(value, half)
    told = f"{text} ± {wide} {unit}" if np.isfinite(half) else f"{text} {unit}, U unknown"
    ax.text(0.5, 0.95, told, ha="center", va="top", fontsize=SMALL, transform=ax.transAxes)
    span = 2.6 * half if np.isfinite(half) and half > 0.0 else abs(value) or 1.0
    ax.set_ylim(value - span, value + span)


# -- uncertainty -----------------------------------------------------------------------------------

_SOURCES = {
    "reading": "readings",
    "head": "head positions",
    "launch": "launches, bias",
    "launch_sf": "launches, scale factor",
    "temperature": "temperature",
}


@styled
def budget(calibration: Calibration, ax: Axes | None, *, run: str | int | None) -> Axes:
    """Draw `CalibrationPlot.budget`."""
    used = tables_in_use(calibration)
    table = (
        used.main
        if run is None
        else nearest_table(tables_of_run(calibration, run), used.temperature)
    )
    shown = [row for row in _SHOWN if any(table.budget.get(row[2], {}).values())]
    ax = canvas(ax, (7.2, 3.4))
    ax.grid(visible=False, axis="y")
    _stack(ax, [table.budget[row[2]] for row in shown])
    ax.set_yticks(range(len(shown)), [f"{name} {SYMBOLS[symbol]}" for name, symbol, _ in shown])
    ax.invert_yaxis()
    for place, (_, symbol, _) in enumerate(shown):
        told = f"u = {_uncertainty(table, symbol)}"
        ax.text(101.5, place, told, va="center", fontsize=SMALL)
    ax.set(xlim=(0.0, 100.0), xlabel="share of the variance [%]")
    if not shown:
        blank(ax, "no uncertainty is known")
    named = shortened(table.run, _LONGEST)
    return entitled(ax, f"Where the uncertainty comes from, run {named}", columns=4)


def _stack(ax: Axes, parts: Sequence[Any]) -> None:
    """A bar for each coefficient, of the squares of its parts."""
    totals = np.array([sum(size**2 for size in sources.values()) for sources in parts])
    start = np.zeros(len(parts))
    sources = [name for name in _SOURCES if any(part.get(name) for part in parts)]
    sources += sorted({name for part in parts for name in part} - set(_SOURCES))
    for number, source in enumerate(sources):
        share = 100.0 * np.array([part.get(source, 0.0) ** 2 for part in parts]) / totals
        if share.max() < _SEEN:
            continue
        colour = palette().series[number % len(palette().series)]
        name = _SOURCES.get(source, source)
        ax.barh(range(len(parts)), share, 0.62, start, color=colour, label=name)
        start = start + share


def _uncertainty(table: TableCalibration, symbol: str) -> str:
    """Standard uncertainty of a coefficient, that of the scale factor over it."""
    quantity = table.quantities[symbol]
    size, unit = quantity.standard_uncertainty, quantity.unit
    if size is None:
        return "unknown"
    if symbol == "K1":
        size, unit = size / abs(quantity.value or 1.0), "1"
    factor, unit = readable(unit, size)
    return f"{significant(factor * size, 2)} {unit}"
