"""Whether two calibrations can be compared: one unit, one quantity, one temperature."""

from __future__ import annotations

import math

from accelcal.compensate.ranges import TEMPERATURE_MARGIN, outside_temperatures, within_temperatures
from accelcal.discovery.two_calibrations.errors import Side
from accelcal.errors import InputError
from accelcal.results.calibration import Calibration
from accelcal.serials import serials_alike
from accelcal.units import conversion_factor


def refuse_two_units(old: Calibration, new: Calibration) -> None:
    """Refuse calibrations of two accelerometers.

    Raises
    ------
    InputError
        If both name their serial number, and differ in more than its spelling.
    """
    names = {own.serial for own in (old, new) if own.serial}
    if len(names) == 2 and not serials_alike(names):
        raise InputError(
            f"the old calibration is that of {old.serial}, the new one that of {new.serial}; give"
            " two of one accelerometer"
        )


def factor_of_unit(old: Side, new: Side) -> float:
    """Output unit of the new calibration in that of the old one; 1 where one names none.

    Raises
    ------
    InputError
        If they are of two quantities.
    """
    unit, other = old.found.output_unit, new.found.output_unit
    if unit is None or other is None:
        return 1.0
    factor = conversion_factor(other, unit)
    if factor is None:
        raise InputError(
            f"the old calibration is of an output in {unit}, the new one in {other}; give two of"
            " one output"
        )
    return factor


def common_temperature(old: Side, new: Side, asked: float | None) -> float | None:
    """Choose where to compare: as asked, else at T0 of the old one or next to it [degC].

    It is None where one calibration knows none.

    Raises
    ------
    InputError
        If one of them is not good there, or there is none for which both are.
    """
    ranges = [(own.name, own.found.temperatures) for own in (old, new)]
    known = [own for _, own in ranges if own is not None]
    if asked is not None:
        for name, own in ranges:
            if own is not None and not within_temperatures(own, asked):
                problem = outside_temperatures(own, asked)
                raise InputError(f"{name} calibration: {problem}; compare where both are good")
        return asked
    if len(known) < 2:
        return None
    low, high = max(own[0] for own in known), min(own[1] for own in known)
    if low - high > 2.0 * TEMPERATURE_MARGIN:
        told = [f"the {name} one is for {_levels(*own)}" for name, own in ranges if own]
        raise InputError(
            f"no temperature at which both calibrations are good: {' and '.join(told)}; calibrate"
            " at a common level"
        )
    if low > high:
        return 0.5 * (low + high)
    return min(max(old.found.T0_degC or 0.0, low), high)


def _levels(low: float, high: float) -> str:
    return f"{low:.4g} degC" if math.isclose(low, high) else f"{low:.4g} to {high:.4g} degC"
