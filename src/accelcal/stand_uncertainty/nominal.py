"""The accelerometer that a calibration found, to be put on a stand."""

from __future__ import annotations

from accelcal.accelerometer import Accelerometer, BilinearLaw
from accelcal.errors import InputError
from accelcal.reference import USUAL_TEMPERATURE
from accelcal.results.calibration import Calibration
from accelcal.results.quantity import Quantity
from accelcal.results.table import nearest_table
from accelcal.results.temperature import TemperatureLaw


def accelerometer_of(calibration: Calibration) -> Accelerometer:
    """Take the coefficients of a calibration as those of the accelerometer.

    Parameters
    ----------
    calibration : Calibration
        The calibration.

    Returns
    -------
    Accelerometer
        Laws from the temperature model, else from the table nearest to T0, with no slopes; what
        was not determined is zero.

    Raises
    ------
    InputError
        If the scale factor is not known.

    Examples
    --------
    >>> import accelcal
    >>> found = accelerometer_of(accelcal.fit(accelcal.simulate(seed=1)))
    >>> round(found.scale_factor.at_reference, 3), round(found.scale_factor.above * 1e6)
    (1.35, 520)
    """
    reference = calibration.T0_degC
    reference = USUAL_TEMPERATURE if reference is None else reference
    nearest = nearest_table(calibration.tables, reference)
    own, model = nearest.error_model, calibration.temperature_model
    laws = {} if model is None else {"k0": model.k0, "K1": model.K1, "delta": model.delta}
    scale_factor = _law(laws.get("K1"), nearest.coefficients["K1"])
    if scale_factor.at_reference == 0.0:
        raise InputError("the calibration has no scale factor K1; fit a record that determines it")
    return Accelerometer(
        scale_factor=scale_factor,
        bias=_law(laws.get("k0"), own["k0"]),
        misalignment=_law(laws.get("delta"), own["delta"]),
        k2=_value(own["k2"]),
        k3=_value(own["k3"]),
        cross_coupling=_value(own["delta_ip"]),
        reference_temperature=reference,
        unit=calibration.output_unit,
        serial=calibration.serial,
    )


def _law(law: TemperatureLaw | None, at_rest: Quantity) -> BilinearLaw:
    if law is None or law.at_T0 is None:
        return BilinearLaw(_value(at_rest))
    return BilinearLaw(*(_value(part) for part in (law.at_T0, law.above, law.below)))


def _value(quantity: Quantity | None) -> float:
    return 0.0 if quantity is None or quantity.value is None else quantity.value
