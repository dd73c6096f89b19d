"""How a stream of samples is turned into accelerations, and its units."""

from __future__ import annotations

from dataclasses import dataclass

from accelcal.apparatus import Apparatus
from accelcal.errors import InputError
from accelcal.io.layout.output_unit import notes_of_unit
from accelcal.io.samples.headings import SampleHeadings, acceleration_unit
from accelcal.units import canonical_unit, conversion_factor


@dataclass(frozen=True, slots=True)
class StreamOptions:
    """How a stream is compensated."""

    temperature: float | None = None  # of all samples; None takes the column or header line [degC]
    output_unit: str | None = None  # None takes that of the stream
    unit: str = "g"  # of the accelerations, ``"g"`` or ``"m/s^2"``
    local_gravity: float | None = None  # None takes that of the calibration [m/s^2]
    output_uncertainty: float = 0.0  # standard [output unit of the calibration]
    temperature_uncertainty: float = 0.0  # standard [degC]
    extrapolate: bool = False  # whether temperatures outside the calibrated range are accepted
    serial: str | None = None  # None takes that of the stream or calibration
    run: str | None = None  # use the tables of this run only
    mounting: str | None = None
    by: str = "laws"  # or ``"levels"``: how the coefficients depend on temperature
    same_launch: bool = False  # leave the shift to the next launch out of the uncertainty


def acceleration_scale(
    options: StreamOptions, headings: SampleHeadings, gravity: float | None
) -> float:
    """Tell what accelerations in g are multiplied by: 1, or the gravity [m/s^2].

    Raises InputError if the gravity is needed and not known, given without need, or found nowhere
    on Earth.
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
    """Factor from the unit of the outputs of a stream to that of the calibration, with notes.

    Raises InputError if the units are of different quantities.
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
