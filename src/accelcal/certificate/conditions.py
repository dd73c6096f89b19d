"""The conditions of a test that its results hold for: local gravity and temperature."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree.ElementTree import Element

from accelcal.certificate.xml import dcc, named, number, rich, si
from accelcal.io.toml.laboratory import NOT_STATED
from accelcal.results.calibration import Calibration

_METRES = r"\metre\second\tothe{-2}"


def influence_conditions(calibration: Calibration) -> Element:
    """Make ``dcc:influenceConditions``; ``not stated`` where nothing is."""
    stated = [table.temperature_degC for table in calibration.tables]
    levels = list(dict.fromkeys(level for level in stated if level is not None))
    local = calibration.g_local_m_s2
    gravity = _quantity("local gravity", [] if local is None else [local], _METRES)
    return dcc(
        "influenceConditions",
        dcc("influenceCondition", named("local gravity"), dcc("data", gravity)),
        dcc("influenceCondition", named("temperature"), dcc("data", temperature_quantity(levels))),
    )


def temperature_quantity(levels: Sequence[float]) -> Element:
    """Make a quantity of the temperatures of a test [degC]."""
    return _quantity("temperature", levels, r"\degreecelsius")


def _quantity(name: str, values: Sequence[float], unit: str) -> Element:
    """One value as it is, several as a list."""
    if not values:
        return dcc("quantity", named(name), rich("noQuantity", NOT_STATED))
    tag, ending = ("real", "") if len(values) == 1 else ("realListXMLList", "XMLList")
    written = " ".join(map(number, values))
    found = si(tag, si(f"value{ending}", written), si(f"unit{ending}", unit))
    return dcc("quantity", named(name), found)
