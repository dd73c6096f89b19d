"""The results of a certificate in units of the SI, and the conditions that they hold for."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from decimal import Decimal
from itertools import combinations_with_replacement
from typing import NamedTuple
from xml.etree.ElementTree import Element

from accelcal.certificate.administrative import software
from accelcal.certificate.xml import dcc, named, number, rich, si
from accelcal.compensate.at_temperature import MeanOfRuns, means_of_runs
from accelcal.io.toml.laboratory import NOT_STATED
from accelcal.model import SLOPES
from accelcal.results.calibration import Calibration
from accelcal.results.fixture_angle import FixtureAngle
from accelcal.results.quantity import Quantity
from accelcal.results.table import TableCalibration
from accelcal.results.temperature import TemperatureModel
from accelcal.units import conversion_factor

_METRES = r"\metre\second\tothe{-2}"


def influence_conditions(calibration: Calibration) -> Element:
    """Make ``dcc:influenceConditions``; ``not stated`` where nothing is."""
    stated = [table.temperature_degC for table in calibration.tables]
    levels = list(dict.fromkeys(level for level in stated if level is not None))
    local = calibration.g_local_m_s2
    gravity = _condition("local gravity", [] if local is None else [local], _METRES)
    return dcc(
        "influenceConditions",
        dcc("influenceCondition", named("local gravity"), dcc("data", gravity)),
        dcc("influenceCondition", named("temperature"), dcc("data", temperature_quantity(levels))),
    )


def temperature_quantity(levels: Sequence[float]) -> Element:
    """Make a quantity of the temperatures of a test [degC]."""
    return _condition("temperature", levels, r"\degreecelsius")


def _condition(name: str, values: Sequence[float], unit: str) -> Element:
    """One value as it is, several as a list."""
    if not values:
        return dcc("quantity", named(name), rich("noQuantity", NOT_STATED))
    tag, ending = ("real", "") if len(values) == 1 else ("realListXMLList", "XMLList")
    written = " ".join(map(number, values))
    found = si(tag, si(f"value{ending}", written), si(f"unit{ending}", unit))
    return dcc("quantity", named(name), found)


_NAMES = {
    "K0": "bias",
    "K1": "scale factor",
    "K2": "second-order nonlinearity",
    "K3": "third-order nonlinearity",
    "M": "effective misalignment times scale factor",
    "M_ip": "cross-coupling",
    "k0": "bias over scale factor",
    "k2": "second-order nonlinearity over scale factor",
    "k3": "third-order nonlinearity over scale factor",
    "delta": "effective misalignment",
    "delta_ip": "cross-coupling over scale factor",
    "delta_io": "cross-coupling over scale factor",
    "delta0": "fixture angle",
    "delta_free": "misalignment without the fixture angle",
}
_OF_LAWS = {
    **{f"{law} at_T0": f"{_NAMES[law]} at T0 {law}N" for law in ("k0", "K1", "delta")},
    **{
        f"{law} {side}": f"slope of the {_NAMES[law]} {side} T0 {symbol}"
        for symbol, (law, side) in SLOPES.items()
    },
    "hysteresis": "hysteresis of the bias h_T",
}
"""Names of `TemperatureModel.quantities`; slopes of the scale factor are relative to it."""

_PROBABILITY = "0.95"


def measurement_results(calibration: Calibration) -> Element:
    """Make ``dcc:measurementResults``.

    A result for each table, one for the mean of runs at one level and one for the temperature laws
    of each axis along the shaft, and one for each axis whose misalignment both sides have freed
    from the fixture angle.
    """
    results = [_table(table, calibration) for table in calibration.tables]
    results += [_mean(mean, calibration) for mean in means_of_runs(calibration)]
    for model, whose in (
        (calibration.temperature_model, ""),
        (calibration.second_axis_model, ", of the other axis along the shaft"),
    ):
        results += [] if model is None else [_laws(model, calibration, whose)]
    results += [_reversal(found, calibration) for found in calibration.fixture_angle]
    return dcc(
        "measurementResults",
        dcc(
            "measurementResult",
            named("tumble test in the gravity field"),
            dcc("usedMethods", _method(calibration)),
            dcc("usedSoftware", software(calibration)),
            influence_conditions(calibration),
            dcc("results", *results),
        ),
    )


def _method(calibration: Calibration) -> Element:
    robust = ", made safe against outliers" if calibration.robust else ""
    effects = ", ".join(item.id for item in calibration.effects)
    told = f" Effects that it took out of the readings: {effects}." if effects else ""
    return dcc(
        "usedMethod",
        named("multi-position tumble test"),
        rich("description", f"Estimator: {calibration.method}{robust}.{told}"),
        dcc("norm", "IEEE 1293"),
    )


def _table(table: TableCalibration, calibration: Calibration) -> Element:
    temperature = table.temperature_degC
    where = "" if temperature is None else f", {temperature:.6g} degC"
    data = [] if temperature is None else [temperature_quantity([temperature])]
    data += [
        _quantity(name, quantity, calibration, table.meaning(name))
        for name, quantity in table.quantities.items()
    ]
    title = f"run {table.run}, mounting {table.mounting}{where}"
    return _result(title, "coefficients", data, _covariance(table, calibration))


def _mean(mean: MeanOfRuns, calibration: Calibration) -> Element:
    told = {symbol: (symbol, mean.first.meaning(symbol)) for symbol in mean.coefficients}
    if mean.first.mounting[0] in {found.axis for found in calibration.fixture_angle}:
        told["delta"] = ("delta_free", "delta_free")
    data = [
        _quantity(name, mean.coefficients[symbol], calibration, meaning)
        for symbol, (name, meaning) in told.items()
    ]
    return _result(f"mean of {mean.runs}", "mean of runs", data)


def _laws(model: TemperatureModel, calibration: Calibration, whose: str) -> Element:
    data = [_quantity(name, quantity, calibration, name) for name, quantity in model.quantities()]
    title = f"temperature laws about T0 = {calibration.T0_degC:.6g} degC{whose}"
    return _result(title, "temperature laws", data)


def _reversal(found: FixtureAngle, calibration: Calibration) -> Element:
    """Fixture angle, and misalignment and cross-coupling without it at each level."""
    data = [_quantity("delta0", found.angle, calibration, "delta0")]
    symbol = "delta_ip" if found.axis == "o" else "delta_io"
    for i, (celsius, free) in enumerate(zip(found.temperatures, found.misalignments, strict=True)):
        data += [] if celsius is None else [temperature_quantity([celsius])]
        data.append(_quantity("delta_free", free, calibration, "delta_free"))
        data += [_quantity(symbol, own, calibration, symbol) for own in found.couplings[i : i + 1]]
    title = f"terms freed from the fixture angle by mountings {found.axis}+ and {found.axis}-"
    return _result(title, "both sides of one axis", data)


def _result(title: str, what: str, data: list[Element], more: Element | None = None) -> Element:
    return dcc("result", named(title), dcc("data", dcc("list", named(what), *data), more))


def _quantity(name: str, quantity: Quantity, calibration: Calibration, meaning: str) -> Element:
    title = _OF_LAWS.get(name) or f"{_NAMES[name]} {name}"
    if meaning != name:
        title += f", which stands for {meaning}"
    if quantity.value is None:
        return dcc("quantity", named(title), rich("noQuantity", "not determined"))
    found = _in_si(quantity.unit, calibration.g_local_m_s2)
    if found is None:
        told = [f"{number(quantity.value)} {quantity.unit}", *_told_uncertainty(quantity)]
        return dcc("quantity", named(title), rich("noQuantity", "; ".join(told)))
    unit, factor = found
    real = si(
        "real",
        si("label", name),
        si("value", number(quantity.value * factor)),
        si("unit", unit),
        _uncertainty(quantity, factor),
    )
    return dcc("quantity", named(title), real)


def _told_uncertainty(quantity: Quantity) -> Iterator[str]:
    """The uncertainty in words, beside a value whose unit the SI does not know."""
    if quantity.standard_uncertainty is not None:
        yield f"standard uncertainty {number(quantity.standard_uncertainty)} {quantity.unit}"
    if quantity.expanded_uncertainty is not None:
        expanded = number(quantity.expanded_uncertainty)
        yield f"expanded uncertainty (95 %) {expanded} {quantity.unit}"


def _in_si(unit: str, gravity: float | None) -> tuple[str, float] | None:
    """Unit of the D-SI and factor; None where the unit or the local gravity is not known."""
    found = si_unit(unit)
    if found is None or (found.power != 0 and gravity is None):
        return None
    return found.text, found.scale * (1.0 if gravity is None else gravity**found.power)


def _uncertainty(quantity: Quantity, factor: float) -> Element | None:
    expanded, k = quantity.expanded_uncertainty, quantity.coverage_factor
    if expanded is not None and k is not None:
        known = si(
            "expandedMU",
            si("valueExpandedMU", number(expanded * factor)),
            si("coverageFactor", f"{Decimal(number(max(k, 1.0))):f}"),  # has no exponent there
            si("coverageProbability", _PROBABILITY),
        )
    elif quantity.standard_uncertainty is not None:
        known = si(
            "standardMU", si("valueStandardMU", number(quantity.standard_uncertainty * factor))
        )
    else:
        return None
    return si("measurementUncertaintyUnivariate", known)


def _covariance(table: TableCalibration, calibration: Calibration) -> Element | None:
    """The covariance of each pair, in the product of their units.

    Readers give all values of an ``si:realListXMLList`` its first unit; so each stands by itself.
    """
    names, matrix = table.covariance_names, table.covariance_matrix
    units = [_in_si(table.coefficients[name].unit, calibration.g_local_m_s2) for name in names]
    known = [unit for unit in units if unit is not None]
    if not matrix or len(known) < len(names):
        return None
    pairs = combinations_with_replacement(range(len(names)), 2)
    quantities = [
        _covariance_of((names[i], names[j]), matrix[i][j], known[i], known[j]) for i, j in pairs
    ]
    return dcc("list", named("covariance of the coefficients"), *quantities)


def _covariance_of(
    pair: tuple[str, str], value: float, one: tuple[str, float], other: tuple[str, float]
) -> Element:
    first, second = pair
    title = f"variance of {first}" if first == second else f"covariance of {first} and {second}"
    real = si(
        "real",
        si("label", f"cov({first},{second})"),
        si("value", number(value * one[1] * other[1])),
        si("unit", product(one[0], other[0])),
    )
    return dcc("quantity", named(title), real)


NO_UNIT = r"\one"

_PREFIXES = {
    **{"p": r"\pico", "n": r"\nano", "u": r"\micro", "µ": r"\micro", "m": r"\milli"},
    **{"k": r"\kilo", "M": r"\mega"},
}
_SYMBOLS = {"A": r"\ampere", "V": r"\volt", "Hz": r"\hertz", "C": r"\coulomb"}
_PLAIN = {"1": "", "rad": r"\radian"}
_ACCELERATION = "m/s^2"
_PARTS = re.compile(r"(?P<unit>m/s\^2|[^/]+)(?P<per>/g(?:\^(?P<power>\d))?)?(?P<slope>/degC)?")


class SiUnit(NamedTuple):
    """A unit of the D-SI, and how a value comes into it.

    Attributes
    ----------
    text : str
        The unit, with m/s^2 in place of g.
    power : int
        Power of the local gravity in m/s^2 by which the value is multiplied.
    scale : float
        Number by which it is multiplied as well: 0.001 where mg became m/s^2.
    """

    text: str
    power: int
    scale: float = 1.0


def si_unit(unit: str) -> SiUnit | None:
    r"""Write the unit of a coefficient in the form of the D-SI.

    There is none for one that the SI does not know, such as counts.

    Examples
    --------
    >>> si_unit("mA/g")
    SiUnit(text='\\milli\\ampere\\metre\\tothe{-1}\\second\\tothe{2}', power=-1, scale=1.0)
    >>> si_unit("rad").text, si_unit("1/degC").text, si_unit("counts/g")
    ('\\radian', '\\kelvin\\tothe{-1}', None)
    >>> si_unit("mg")
    SiUnit(text='\\metre\\second\\tothe{-2}', power=1, scale=0.001)
    """
    found = _PARTS.fullmatch(unit)
    if found is None:
        return None
    name, scale = found["unit"], conversion_factor(found["unit"], "g")
    is_acceleration = scale is not None or name == _ACCELERATION
    base = "" if is_acceleration else _base(name)
    if base is None:
        return None
    per_g = int(found["power"] or 1) if found["per"] else 0
    slope = r"\kelvin\tothe{-1}" if found["slope"] else ""
    text = base + _acceleration(is_acceleration - per_g) + slope
    if scale is None:
        return SiUnit(text or NO_UNIT, -per_g)
    return SiUnit(text or NO_UNIT, 1 - per_g, scale)


def product(one: str, other: str) -> str:
    r"""Write the product of two units of the D-SI.

    Examples
    --------
    >>> product(r"\volt", r"\metre"), product(NO_UNIT, r"\metre"), product(NO_UNIT, NO_UNIT)
    ('\\volt\\metre', '\\metre', '\\one')
    """
    return "".join(unit for unit in (one, other) if unit != NO_UNIT) or NO_UNIT


def _base(unit: str) -> str | None:
    if unit in _PLAIN:
        return _PLAIN[unit]
    if unit in _SYMBOLS:
        return _SYMBOLS[unit]
    prefix, symbol = _PREFIXES.get(unit[:1]), _SYMBOLS.get(unit[1:])
    return prefix + symbol if prefix and symbol else None


def _acceleration(power: int) -> str:
    if power == 0:
        return ""
    metre = r"\metre" if power == 1 else rf"\metre\tothe{{{power}}}"
    return rf"{metre}\second\tothe{{{-2 * power}}}"
