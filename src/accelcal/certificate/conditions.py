"""The conditions of a test that its results hold for: local gravity and temperature."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree.ElementTree import Element

from accelcal.certificate.xml import dcc, named, number, rich, si
from accelcal.io.laboratory import NOT_STATED
from accelcal.results.calibration import Calibration


def influence_conditions(calibration: Calibration) -> Element:
    """Make the conditions.

    Parameters
    ----------
    calibration : Calibration
        The calibration.

    Returns
    -------
    Element
        ``dcc:influenceConditions``; ``not stated`` where nothing is.
    """
    stated = [table.temperature_degC for table in calibration.tables]
    levels = list(dict.fromkeys(level for level in stated if level is not None))
    return dcc(
        "influenceConditions",
        _condition(_gravity(calibration.g_local_m_s2)),
        _condition(temperature_quantity(levels)),
    )


def temperature_quantity(levels: Sequence[float]) -> Element:
    """Make a quantity of the temperatures of a test [degC]."""
    return _quantity("temperature", levels, r"\degreecelsius")


def _gravity(local: float | None) -> Element:
    return _quantity("local gravity", [] if local is None else [local], r"\metre\second\tothe{-2}")


def _quantity(name: str, values: Sequence[float], unit: str) -> Element:
    """One value as it is, several as a list."""
    if not values:
        return dcc("quantity", named(name), rich("noQuantity", NOT_STATED))
    tag, ending = ("real", "") if len(values) == 1 else ("realListXMLList", "XMLList")
    written = " ".join(map(number, values))
    found = si(tag, si(f"value{ending}", written), si(f"unit{ending}", unit))
    return dcc("quantity", named(name), found)


def _condition(quantity: Element) -> Element:
    name = quantity.findtext(".//{*}content") or NOT_STATED
    return dcc("influenceCondition", named(name), dcc("data", quantity))
