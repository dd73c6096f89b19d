"""Temperature laws with their bands, over the values of the runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.compensate.propagation import law_and_band
from accelcal.effects.conditions import LEVEL_CHANGE
from accelcal.plot.style import SMALL, blank, canvases, entitled, palette, styled
from accelcal.results.calibration import Calibration
from accelcal.results.quantity import Quantity
from accelcal.results.table import TableCalibration
from accelcal.shown_units import readable

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MOST_ARROWS = 12

_NO_DIFFERENCE = 1e-6
"""Part of the half width of a run's interval that is no difference from the law."""


class _Panel(NamedTuple):
    """One law: its name, title, label and unit, and how a run tells it."""

    name: str
    title: str
    label: str
    unit: str
    of: Callable[[TableCalibration], Quantity]


class _Points(NamedTuple):
    """Values of the runs with their 95 % half widths, in the order of the runs."""

    temperature: Array
    value: Array
    half_width: Array


@styled
def temperature(calibration: Calibration, axes: Any) -> Any:
    """Draw `CalibrationPlot.temperature`."""
    tables = _tables(calibration)
    change = partial(_relative, reference=_reference(calibration, tables))
    kinds = (
        _Panel("k0", "Bias $k_0$", "$k_0$", "g", lambda table: table.error_model["k0"]),
        _Panel("K1", "Scale factor $K_1$", "change of $K_1$", "1", change),
        _Panel("delta", r"Misalignment $\delta$", r"$\delta$", "rad", calibration.misalignment),
    )
    rows = 2 if calibration.temperature_model else 1
    panels = canvases(axes, rows, 3, (10.5, 2.2 + 2.0 * rows))
    for number, kind in enumerate(kinds):
        points = _points(tables, kind.of)
        _draw(panels[number], kind, points, calibration)
        entitled(panels[number], kind.title, columns=2)
        if rows == 2:
            _draw_difference(panels[number + 3], kind, points, calibration)
    return panels


def _tables(calibration: Calibration) -> list[TableCalibration]:
    """Tables that the laws are made from: those of the mounting that most are in."""
    main = calibration.main_mounting
    return [
        table
        for table in calibration.tables
        if table.mounting == main and table.temperature_degC is not None
    ]


def _in_one_of_several(calibration: Calibration) -> str:
    """Mounting that the laws are made from, where there are others."""
    several = len({table.mounting for table in calibration.tables}) > 1
    return f" in {calibration.main_mounting}" if several else ""


def _reference(calibration: Calibration, tables: Sequence[TableCalibration]) -> float:
    """Scale factor that the others are told from: K1N, or where there is none the first run's."""
    model = calibration.temperature_model
    if model and model.K1.at_T0 and model.K1.at_T0.value:
        return model.K1.at_T0.value
    values = [table.coefficients["K1"].value for table in tables]
    return next((value for value in values if value), 1.0)


def _relative(table: TableCalibration, reference: float) -> Quantity:
    """Scale factor as a change from the reference, over it."""
    found = table.coefficients["K1"]
    wide = found.expanded_uncertainty
    return Quantity(
        None if found.value is None else found.value / reference - 1.0,
        None,
        "1",
        None if wide is None else wide / abs(reference),
    )


def _points(
    tables: Sequence[TableCalibration], of: Callable[[TableCalibration], Quantity]
) -> _Points:
    found = [(table.temperature_degC, of(table)) for table in tables]
    known = [(t, q.value, q.expanded_uncertainty) for t, q in found if q.value is not None]
    numbers = np.array(known, dtype=float).reshape(-1, 3)
    return _Points(*numbers.T)


def _draw(ax: Axes, kind: _Panel, points: _Points, calibration: Calibration) -> None:
    at = _temperatures(calibration, points)
    law = _law(calibration, kind.name, at)
    factor, unit = readable(kind.unit, points.value, points.half_width, *(law or ()))
    if law is not None:
        _draw_law(ax, at, factor * law[0], factor * law[1], "law, 95 % band")
    _draw_runs(ax, points, factor, f"run{_in_one_of_several(calibration)}, 95 %")
    if not points.value.size:
        ax.text(0.5, 0.5, "not determined", ha="center", transform=ax.transAxes)
    ax.set(xlabel="temperature [°C]", ylabel=f"{kind.label} [{unit}]")


def _draw_difference(ax: Axes, kind: _Panel, points: _Points, calibration: Calibration) -> None:
    """Draw the runs less the law, where the loop of hysteresis is seen."""
    at = _temperatures(calibration, points)
    law, own = (_law(calibration, kind.name, place) for place in (at, points.temperature))
    ax.set(xlabel="temperature [°C]")
    if law is None or own is None:
        blank(ax, "no law determined").set_xlabel("")
        return
    apart = points._replace(value=points.value - own[0])
    factor, unit = readable(kind.unit, apart.value, points.half_width, law[1])
    _draw_law(ax, at, 0.0 * law[0], factor * law[1], None)
    if returns_to_a_level(calibration):
        _arrows(ax, apart, factor)
    _draw_runs(ax, apart, factor, None)
    if (np.abs(apart.value) < _NO_DIFFERENCE * points.half_width).all():
        told: Any = {"size": SMALL, "color": palette().muted, "transform": ax.transAxes}
        ax.text(0.0, 1.02, "as many unknowns as levels: always 0", **told)
    ax.set_ylabel(f"run − law [{unit}]")


def _draw_law(ax: Axes, at: Array, middle: Array, half: Array, label: str | None) -> None:
    colour = palette().series[0]
    ax.fill_between(at, middle - half, middle + half, color=colour, alpha=0.18, lw=0)
    ax.plot(at, middle, color=colour, label=label)


def _draw_runs(ax: Axes, points: _Points, factor: float, label: str | None) -> None:
    half = factor * np.nan_to_num(points.half_width)
    drawn: Any = {"ls": "", "marker": "o", "color": palette().series[1], "label": label}
    ax.errorbar(points.temperature, factor * points.value, half, **drawn)


def _temperatures(calibration: Calibration, points: _Points) -> Array:
    """Where a law is drawn: all along, and at T0, where it has its break."""
    low, high = _span(points)
    reference = calibration.T0_degC
    broken = [] if reference is None else [np.clip(reference, low, high)]
    return np.unique(np.concatenate([np.linspace(low, high, 61), broken]))


def returns_to_a_level(calibration: Calibration) -> bool:
    """Tell whether the runs come back to a level, so that the way there can be told apart."""
    levels = np.array([table.temperature_degC for table in _tables(calibration)], dtype=float)
    return bool((np.diff(np.sort(levels)) < LEVEL_CHANGE).any())


def _span(points: _Points) -> tuple[float, float]:
    if not points.temperature.size:
        return 0.0, 1.0
    low, high = float(points.temperature.min()), float(points.temperature.max())
    wide = 0.04 * (high - low) or 1.0
    return low - wide, high + wide


def _law(calibration: Calibration, name: str, at: Array) -> tuple[Array, Array] | None:
    """Law at some temperatures, and half width of its 95 % band; None where not determined."""
    model, reference = calibration.temperature_model, calibration.T0_degC
    if model is None or reference is None:
        return None
    return law_and_band(model, name, at - reference)


def _arrows(ax: Axes, points: _Points, factor: float) -> None:
    """Lead from run to run, so that heating and cooling can be told apart."""
    known = np.isfinite(points.value)  # matplotlib draws no arrow that begins or ends at NaN
    x, y = points.temperature[known], factor * points.value[known]
    if x.size > _MOST_ARROWS:
        return
    for i in range(x.size - 1):
        ax.annotate(
            "",
            (x[i + 1], y[i + 1]),
            (x[i], y[i]),
            arrowprops={
                "arrowstyle": "-|>",
                "color": palette().muted,
                "lw": 0.8,
                "alpha": 0.8,
                "shrinkA": 3,
                "shrinkB": 3,
            },
        )
