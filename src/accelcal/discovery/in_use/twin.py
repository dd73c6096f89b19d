"""The twin of an accelerometer: what a discovery found, ready to be simulated."""

from __future__ import annotations

from typing import NamedTuple

from accelcal.accelerometer import Accelerometer, BilinearLaw
from accelcal.arguments.kinds import expect
from accelcal.effects.effect import Disturbance
from accelcal.effects.found import disturbances
from accelcal.escapes import visible
from accelcal.results.discovery import Discovery
from accelcal.simulation import NoiseComponents

__all__ = ["Twin", "twin"]


class Twin(NamedTuple):
    """An accelerometer as a discovery found it.

    Attributes
    ----------
    accelerometer : Accelerometer
        Its coefficients.
    noise : NoiseComponents
        Noise of its readings, and head, launch and temperature errors as they were declared.
    effects : tuple of Disturbance
        Its effects with their sizes.

    Examples
    --------
    >>> import accelcal
    >>> hidden = [accelcal.effect("backlash").of(5e-5)]
    >>> twin = accelcal.twin(accelcal.discover(accelcal.simulate(effects=hidden, seed=1)))
    >>> [disturbance.effect.id for disturbance in twin.effects]
    ['backlash']
    """

    accelerometer: Accelerometer
    noise: NoiseComponents
    effects: tuple[Disturbance, ...]

    def __repr__(self) -> str:
        ids = ", ".join(disturbance.effect.id for disturbance in self.effects)
        return visible(f"<Twin of {self.accelerometer.serial or 'a unit'}: {ids or 'no effect'}>")


def twin(model: Discovery) -> Twin:
    """Make a discovery ready to be simulated.

    Parameters
    ----------
    model : Discovery
        The discovery.

    Returns
    -------
    Twin
        What `accelcal.simulate` takes. Coefficients that the record did not determine are zero.

    Raises
    ------
    InputError
        If an effect is not in the catalogue.

    Examples
    --------
    >>> import accelcal
    >>> record = accelcal.simulate(effects=[accelcal.effect("backlash").of(5e-5)], seed=1)
    >>> accelerometer, noise, effects = accelcal.twin(accelcal.discover(record))
    >>> again = accelcal.simulate(accelerometer, noise=noise, effects=effects, seed=2)
    >>> accelcal.discover(again)
    <Discovery serial AL-15: backlash>
    """
    expect(model, Discovery)
    values = {change.coefficient: change.after.value or 0.0 for change in model.coefficients}
    gain = 1.0 + values.get("K1", 0.0)
    tilt = "M" if "M" in values else "M_O"
    sizes = {source.name: source.value or 0.0 for source in model.noise}
    accelerometer = Accelerometer(
        scale_factor=BilinearLaw(
            model.scale_factor * gain,
            values.get("K1 above T0", 0.0) / gain,
            values.get("K1 below T0", 0.0) / gain,
        ),
        bias=_law(values, "K0"),
        misalignment=_law(values, tilt),
        k2=values.get("K2", 0.0),
        k3=values.get("K3", 0.0),
        cross_coupling=values.get("M_ip", 0.0),
        reference_temperature=model.T0_degC,
        unit=model.output_unit,
        serial=model.serial,
    )
    names = ("reading", "head", "launch", "launch_sf", "temperature")
    noise = NoiseComponents(**{name: sizes.get(name, 0.0) for name in names})
    return Twin(accelerometer, noise, disturbances(model.effects))


def _law(values: dict[str, float], name: str) -> BilinearLaw:
    sides = (values.get(f"{name}{side}", 0.0) for side in ("", " above T0", " below T0"))
    return BilinearLaw(*sides)
