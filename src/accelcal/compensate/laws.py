"""Temperature laws of a calibration as those who use the accelerometer take them."""

from __future__ import annotations

from accelcal.compensate.coefficients import Law, Slope
from accelcal.compensate.covariance import standard_uncertainty
from accelcal.errors import InputError
from accelcal.results.quantity import Quantity
from accelcal.results.temperature import TemperatureLaw


def law_of(law: TemperatureLaw, name: str) -> Law:
    """Take a law in plain numbers.

    Returns
    -------
    Law
        A slope that is missing is that of the other side, +- all of it.

    Raises
    ------
    InputError
        If it has no value at T0.
    """
    if law.at_T0 is None or law.at_T0.value is None:
        raise InputError(f"the temperature law of {name} has no value at T0; choose one run")
    above, below = _slope(law.above), _slope(law.below)
    return Law(law.at_T0.value, above or _borrowed(below), below or _borrowed(above))


def _slope(slope: Quantity | None) -> Slope | None:
    if slope is None or slope.value is None:
        return None
    return Slope(slope.value, standard_uncertainty(slope), determined=True)


def _borrowed(slope: Slope | None) -> Slope:
    return Slope() if slope is None else Slope(slope.value, abs(slope.value))
