"""The lines of a calibration, made once for the terminal, the notebook and the page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

from accelcal.plural import counted, listed
from accelcal.report.numbers import matching_digits, significant
from accelcal.results.covariance import correlation_of
from accelcal.results.table import quotients_by_coefficients

if TYPE_CHECKING:
    from accelcal.arrays import Array
    from accelcal.compensate.at_temperature import MeanOfRuns
    from accelcal.results.calibration import Calibration
    from accelcal.results.quantity import Gate, Quantity
    from accelcal.results.table import TableCalibration
    from accelcal.results.temperature import TemperatureModel

# Name, symbol, coefficient of (1), factor and unit; the scale factor keeps its own unit.
SHOWN_COEFFICIENTS = (
    ("scale factor", "K1", "K1", 1.0, None),
    ("bias", "k0", "K0", 1e3, "mg"),
    ("second order", "k2", "K2", 1e6, "ug/g^2"),
    ("third order", "k3", "K3", 1e6, "ug/g^3"),
    ("misalignment", "delta", "M", 1e6, "urad"),
    ("cross-coupling", "delta_ip", "M_ip", 1e6, "ug/g^2"),
)
HEADINGS = ("", "", "value", "U (95 %)", "unit", "u", "U/u", "mostly from")
"""Of the rows of coefficients."""

LAW_HEADINGS = HEADINGS[:5]
"""Of the rows of temperature laws and fixture angles."""

_SOURCES = {"reading": "readings", "launch": "launches", "launch_sf": "launches"}
_SOURCES["resolution"] = "step"
_STRONG = 0.8
_DIGITS_OF_UNKNOWN = 4

_CAUSES = ("units", "order of positions", "outlier", "proportions", "agreement of tables")
"""Gates that name a fault of the record; what warns behind each may be a consequence of it."""

_REMEDIES = {
    "closure": "repeat the stroke",
    "drift": "wait until unit and chamber have settled, and repeat the run",
    "forward against back": "run accelcal discover, which tells backlash from hysteresis",
    "order of positions": "check the record of the test",
    "outlier": "correct it or leave its cell empty",
    "lack of fit": "run accelcal discover, or measure more positions",
}
"""Gate -> what to do about its warning, where the finding does not say it itself."""

_MOST_TABLES = 3
"""Tables of which one gate warns, each with a line of its own, before the rest are counted."""

_MOST_NAMED = 8
"""Of these rest, by their runs."""

LawRow = tuple[str, str, str, str, str]
"""Name, symbol, value, half width of the 95 % interval and unit."""


class CoefficientRow(NamedTuple):
    """One coefficient, ready to print."""

    name: str
    symbol: str
    meaning: str  # what it stands for, where that is not the coefficient alone
    # value, half width of the 95 % interval, and their unit
    value: str
    expanded: str
    unit: str
    # standard uncertainty in the same unit, and the coverage factor
    standard: str
    factor: str
    dominated_by: str  # the source of error that contributes most, with its share of the variance


def alarms(calibration: Calibration) -> list[str]:
    """List run, gate and finding of the gates that warn, before anyone believes the numbers."""
    return [sentence for _, _, sentence in _alarms(calibration)]


def first_alarms(calibration: Calibration) -> list[str]:
    """List `alarms`; of a gate that warns of more tables the first, and of which others."""
    of_gate: dict[str, list[tuple[str, str]]] = {}
    for name, title, sentence in _alarms(calibration):
        of_gate.setdefault(name, []).append((title, sentence))
    told = []
    for name, found in of_gate.items():
        if len(found) <= _MOST_TABLES:
            told += [sentence for _, sentence in found]
        else:
            others = [title for title, _ in found[1:]]
            number = counted(len(others), "other table")
            told += [found[0][1], f"{name}: warns of {number} too: {listed(others, _MOST_NAMED)}"]
    return told


def _alarms(calibration: Calibration) -> Iterator[tuple[str, str, str]]:
    """Gate, table and sentence of each warning; what to do is said once, behind the first."""
    left = dict(_REMEDIES)
    strokes = max(len({*table.residuals.stroke}) for table in calibration.tables)
    if strokes > 2 and not calibration.robust:  # of two strokes none is the odd one
        left["outlier"] += "; --robust reduces its effect"
    for title, gate in _warning(calibration):
        told = f"{title}{', ' if title else ''}{gate.name}: {gate.finding}"
        remedy = left.pop(gate.name, "")
        yield gate.name, title, f"{told}; {remedy}" if remedy else told


def _warning(calibration: Calibration) -> list[tuple[str, Gate]]:
    """Title of a table, and a gate of it or of the record that warns; causes come first."""
    found = [(table_title(t), gate) for t in calibration.tables for gate in t.gates]
    found += [("", gate) for gate in calibration.gates]
    warning = [(title, gate) for title, gate in found if gate.verdict == "warn"]
    rank = {name: place for place, name in enumerate(_CAUSES)}
    return sorted(warning, key=lambda one: rank.get(one[1].name, len(rank)))


def without_uncertainty(calibration: Calibration) -> list[str]:
    """Say of which tables, or coefficients, nothing tells how far the values are off."""
    found: dict[str, list[str]] = {}
    for table in calibration.tables:
        if table.coefficients["K1"].standard_uncertainty is None:
            found.setdefault(_bare(table), []).append(table_title(table))
    return [
        f"the uncertainty of {what}{', '.join(tables)} is unknown: the values may be off by any"
        f" amount; {_NO_BOUND if what else _REPEAT}"
        for what, tables in found.items()
    ]


_REPEAT = "repeat strokes, or give the columns std and n"
_NO_BOUND = "nothing in these readings bounds it, as the notes say"


def _bare(table: TableCalibration) -> str:
    """Name the coefficients without an uncertainty, where others have one."""
    found = {symbol: table.quantities[symbol] for _, symbol, *_ in SHOWN_COEFFICIENTS}
    told = {name: q for name, q in found.items() if q.value is not None}
    bare = [name for name, q in told.items() if q.standard_uncertainty is None]
    return f"{listed(bare)} of " if len(bare) < len(told) else ""


def table_title(table: TableCalibration) -> str:
    """Name a table by its run, and by its mounting where that is not the usual one."""
    return f"run {table.run}{mounting_unless_named(table) if table.mounting != 'o+' else ''}"


def mounting_unless_named(table: TableCalibration) -> str:
    """Tell the mounting of a table, with a blank before it, unless its run is called so."""
    return "" if table.run.endswith(f" {table.mounting}") else f" {table.mounting}"


def coefficient_rows(table: TableCalibration) -> list[CoefficientRow]:
    """Make the lines of one table: scale factor first, then the error model."""
    return [_row(table, *shown) for shown in SHOWN_COEFFICIENTS]


def _row(
    table: TableCalibration,
    name: str,
    symbol: str,
    coefficient: str,
    factor: float,
    unit: str | None,
) -> CoefficientRow:
    quantity, meaning = table.quantities[symbol], table.meaning(symbol)
    unit = unit or quantity.unit
    if quantity.value is None:
        return CoefficientRow(name, symbol, "", "not determined", "", unit, "", "", "")
    standard, expanded = quantity.standard_uncertainty, quantity.expanded_uncertainty
    known = expanded is not None
    value, half_width = matching_digits(quantity.value, expanded, factor)
    return CoefficientRow(
        name=name,
        symbol=symbol,
        meaning="" if meaning == symbol else meaning,
        value=value if known else _few_digits(factor * quantity.value),
        expanded=half_width,
        unit=unit,
        standard="unknown" if standard is None else _short(factor * standard),
        factor=f"{expanded / standard:.2f}" if standard and expanded is not None else "",
        dominated_by=_dominating(table.budget.get(coefficient, {})) if known else "",
    )


_LAWS = (  # name, symbol, law, part, factor, unit; the scale factor keeps its own unit
    ("bias at T0", "k0N", "k0", "at_T0", 1e3, "mg"),
    ("  slope above", "lam1", "k0", "above", 1e6, "ug/degC"),
    ("  slope below", "lam2", "k0", "below", 1e6, "ug/degC"),
    ("scale factor at T0", "K1N", "K1", "at_T0", 1.0, None),
    ("  slope above", "beta1", "K1", "above", 1e6, "ppm/degC"),
    ("  slope below", "beta2", "K1", "below", 1e6, "ppm/degC"),
    ("misalignment at T0", "deltaN", "delta", "at_T0", 1e6, "urad"),
    ("  slope above", "gam1", "delta", "above", 1e6, "urad/degC"),
    ("  slope below", "gam2", "delta", "below", 1e6, "urad/degC"),
)


def temperature_laws(calibration: Calibration) -> list[tuple[str, list[LawRow]]]:
    """Make the lines of the temperature laws of each axis along the shaft that has some.

    Of each, whose they are where the tables have several mountings, and `temperature_rows`.
    """
    several = len({table.mounting for table in calibration.tables}) > 1
    models = (calibration.temperature_model, calibration.second_axis_model)
    found = zip(calibration.mountings_of_laws, models, strict=True)
    return [
        (f" of mounting {mounting}" if several else "", temperature_rows(calibration, model))
        for mounting, model in found
        if model
    ]


def temperature_rows(calibration: Calibration, model: TemperatureModel) -> list[LawRow]:
    """Make the lines of the temperature laws of one axis."""
    own = calibration.tables[0].coefficients["K1"].unit
    rows = [
        law_row(name, symbol, getattr(model.laws[law], part), factor, unit or own)
        for name, symbol, law, part, factor, unit in _LAWS
    ]
    known = model.hysteresis is not None
    name = "bias (heated - cooled)/2" if known else "hysteresis of bias"  # its sign is told
    return [*rows, law_row(name, "h_T", model.hysteresis, 1e6, "ug")]


def law_row(name: str, symbol: str, quantity: Quantity | None, factor: float, unit: str) -> LawRow:
    """Make a line of a quantity, which is None where not determined."""
    if quantity is None or quantity.value is None:
        return name, symbol, "not determined", "", unit
    shown = matching_digits(quantity.value, quantity.expanded_uncertainty, factor)
    return name, symbol, *shown, unit


def rows_of_mean(found: MeanOfRuns) -> list[LawRow]:
    """Make a line of each coefficient of the mean of several runs at one level."""
    rows = []
    for name, symbol, _, factor, unit in SHOWN_COEFFICIENTS:
        own = found.coefficients[symbol]
        rows.append(law_row(name, found.first.meaning(symbol), own, factor, unit or own.unit))
    return rows


def _few_digits(value: float) -> str:
    """A value of unknown uncertainty, in digits that promise little."""
    return significant(value, _DIGITS_OF_UNKNOWN) if value else "0"


def _short(value: float) -> str:
    """Two significant digits, in at most eight characters."""
    return significant(value, 2) if value == 0.0 or value >= 1e-4 else f"{value:.1e}"


def _dominating(budget: Mapping[str, float]) -> str:
    total = sum(part**2 for part in budget.values())
    if not total > 0.0:
        return ""
    source, size = max(budget.items(), key=lambda item: item[1])
    return f"{_SOURCES.get(source, source)} {100 * size**2 / total:.0f} %"


def residual_grid(
    table: TableCalibration,
) -> tuple[list[int], list[tuple[float, list[float | None]]]]:
    """Arrange residuals by stroke and head angle [deg]; None where there is no reading [g]."""
    found = residuals_by_angle(table)
    strokes = sorted(set(table.residuals.stroke))
    return strokes, [(angle, [own.get(k) for k in strokes]) for angle, own in found.items()]


def residuals_by_angle(table: TableCalibration) -> dict[float, dict[int, float]]:
    """Bring residuals in order: head angle [deg] -> stroke -> residual [g]."""
    residuals, found = table.residuals, dict[float, dict[int, float]]()
    readings = zip(residuals.angle_deg, residuals.stroke, residuals.value, strict=True)
    for angle, stroke, value in readings:
        found.setdefault(angle, {})[stroke] = value
    return {angle: dict(sorted(found[angle].items())) for angle in sorted(found)}


def correlations(table: TableCalibration) -> tuple[list[str], Array]:
    """Take K1 and the estimated parts of the error model with their correlations."""
    import numpy as np

    own = table.covariance_names
    names = [symbol for _, symbol, name, *_ in SHOWN_COEFFICIENTS if name in own]
    if not names:
        return names, table.correlation
    rows = {"K1": np.equal(own, "K1").astype(float), **quotients_by_coefficients(table)}
    jacobian = np.array([rows[name] for name in names])
    return names, correlation_of(jacobian @ table.covariance @ jacobian.T)


def strong_correlations(table: TableCalibration) -> list[str]:
    """Name in a sentence the pairs of coefficients that are strongly correlated, if any."""
    names, found = correlations(table)
    pairs = [
        f"{one} with {other} {found[i, j]:+.2f}"
        for (i, one), (j, other) in combinations(enumerate(names), 2)
        if abs(found[i, j]) > _STRONG
    ]
    return [f"strongly correlated: {', '.join(pairs)}"] if pairs else []
