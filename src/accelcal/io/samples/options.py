"""How a stream of samples is turned into accelerations, and its units."""

from __future__ import annotations

from dataclasses import dataclass

from accelcal.apparatus import Apparatus
from accelcal.errors import InputError
from accelcal.io.layout.output_unit import notes_of_unit
from accelcal.io.samples.headings import SampleHeadings, acceleration_unit
from accelcal.units import canonical_unit, conversion_factor

__all__ = ["StreamOptions", "acceleration_scale", "output_factor"]


@dataclass(frozen=True, slots=True)
class StreamOptions:
    """How a stream is compensated.

    Attributes
    ----------
    temperature : float or None
        Temperature of all samples; None takes the column or header line [degC].
    output_unit : str or None
        Unit of the outputs; None takes that of the stream.
    unit : str
        Unit of the accelerations, ``"g"`` or ``"m/s^2"``.
    local_gravity : float or None
        Gravity where it was calibrated; None takes that of the calibration [m/s^2].
    output_uncertainty : float
        Standard uncertainty of an output [output unit of the calibration].
    temperature_uncertainty : float
        Standard uncertainty of a temperature [degC].
    extrapolate : bool
        Whether temperatures outside the calibrated range are accepted.
    serial : str or None
        Serial number of the accelerometer; None takes that of the stream or calibration.
    run, mounting : str or None
        Use the tables of this run or mounting only.
    by : str
        How the coefficients depend on temperature, ``"laws"`` or ``"levels"``.
    same_launch : bool
        Leave the shift to the next launch out of the uncertainty.
    """

    temperature: float | None = None
    output_unit: str | None = None
    unit: str = "g"
    local_gravity: float | None = None
    output_uncertainty: float = 0.0
    temperature_uncertainty: float = 0.0
    extrapolate: bool = False
    serial: str | None = None
    run: str | None = None
    mounting: str | None = None
    by: str = "laws"
    same_launch: bool = False


def acceleration_scale(
    options: StreamOptions, headings: SampleHeadings, gravity: float | None
) -> float:
    """Tell what accelerations in g are multiplied by.

    Parameters
    ----------
    options : StreamOptions
        The unit that is wanted.
    headings : SampleHeadings
        What stands above the samples, whose accelerations may be in m/s^2 as well.
    gravity : float or None
        Gravity where it was calibrated [m/s^2].

    Returns
    -------
    float
        1, or the gravity.

    Raises
    ------
    InputError
        If the gravity is needed and not known, given without need, or found nowhere on Earth.
    """
    Apparatus(local_gravity=options.local_gravity)  # refuses what is found nowhere on Earth
    if options.unit == "g":
        units = (acceleration_unit(headings.units.get(name, "g")) for name in ("a_p", "a_o"))
        if options.local_gravity is not None and not any(unit and unit[1] for unit in units):
            raise InputError(
                "local_gravity=... is given for accelerations in g; leave it out, or ask for m/s^2"
            )
        return 1.0
    if not gravity:
        raise InputError(
            "m/s^2 needs the gravity of the place of calibration; give it by local_gravity=..., or"
            " stay with g"
        )
    return gravity


def output_factor(
    given: str | None, headings: SampleHeadings, wanted: str | None
) -> tuple[float, list[str]]:
    """Factor from the unit of the outputs of a stream to that of the calibration.

    Parameters
    ----------
    given : str or None
        Unit that the caller names.
    headings : SampleHeadings
        What stands above the samples.
    wanted : str or None
        Unit of the calibration.

    Returns
    -------
    factor : float
        What outputs are multiplied by.
    notes : list of str
        What is to be told of it.

    Raises
    ------
    InputError
        If the units are of different quantities.
    """
    own = headings.output_unit
    declared = headings.layout.declared.get("unit")
    written = [unit for unit in (own, declared and declared.value) if unit]
    notes = list(notes_of_unit(canonical_unit(given), written)) if given else []
    given = given or own
    if given is None or wanted is None:
        missing, other = ("stream", wanted) if given is None else ("calibration", given)
        if other is not None:
            notes.append(f"the {missing} names no unit; outputs are taken as {other}")
        return 1.0, notes
    factor = conversion_factor(given, wanted)
    if factor is None:
        raise InputError(
            f"{headings.source}: outputs in {given}, but the calibration is for {wanted};"
            " give the outputs in its unit"
        )
    if factor != 1.0:
        notes.append(f"outputs in {given} are converted to {wanted}")
    return factor, notes
