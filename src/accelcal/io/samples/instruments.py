"""What turns samples into accelerations: one calibrated accelerometer, or a triad."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from accelcal.apparatus import Apparatus
from accelcal.arguments.axes import AXES
from accelcal.arguments.temperatures import NO_TEMPERATURE, outside_tests
from accelcal.arrays import Array, Mask
from accelcal.compensate.apply import compensate
from accelcal.compensate.choice import compensation
from accelcal.compensate.measured import MeasuredAcceleration
from accelcal.compensate.ranges import (
    CALIBRATE_THERE,
    MORE_THAN_TESTS,
    WIDEST,
    Range,
    outside_temperatures,
    refuse_metres,
)
from accelcal.compensate.triad import (
    apply_triad,
    assumptions_of_triad,
    notes_of_triad,
    refuse_for_triad,
)
from accelcal.errors import InputError, TableError
from accelcal.io.layout.output_columns import notes_of_unit
from accelcal.io.samples.headings import SampleHeadings, acceleration_unit
from accelcal.io.samples.reader import SampleBlock
from accelcal.io.values.markers import are_markers
from accelcal.results.calibration import Calibration
from accelcal.results.triad import TriadCalibration
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
            problem = "local_gravity=... is given for accelerations in g"
            raise InputError(f"{problem}; leave it out, or ask for m/s^2")
        return 1.0
    if not gravity:
        problem = "m/s^2 needs the gravity of the place of calibration"
        raise InputError(f"{problem}; give it by local_gravity=..., or stay with g")
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
        problem = f"{headings.source}: outputs in {given}, but the calibration is for {wanted}"
        raise InputError(f"{problem}; give the outputs in its unit")
    if factor != 1.0:
        notes.append(f"outputs in {given} are converted to {wanted}")
    return factor, notes


OTHER_TEMPERATURES = "are outside the calibrated temperatures"
"""What is said of samples outside the range that were accepted."""


class SampleTemperatures:
    """Temperatures of samples: one for all, which wins, or those of a column or header line.

    Raises InputError if the calibration depends on temperature and nothing tells it.
    """

    def __init__(
        self, headings: SampleHeadings, options: StreamOptions, calibrated: Range | None
    ) -> None:
        given = options.temperature
        self._source = headings.source
        self._calibrated = calibrated
        self._extrapolate = options.extrapolate
        self.notes: list[str] = []
        in_column = "temperature" in headings.columns
        if in_column and given is not None:
            self.notes.append(f"column temperature is set aside for {given:g} degC")
        self._of_all = headings.temperature if given is None and not in_column else given
        if calibrated is None or in_column or self._of_all is not None:
            return
        if calibrated[0] < calibrated[1]:
            problem = "no column temperature, but the calibration depends on it"
            raise InputError(f"{headings.source}: {problem}; give temperature=...")
        level = f"{calibrated[0]:g} degC"
        self.notes.append(f"no temperature is given; the calibration holds at {level}")

    def of_column(self, block: SampleBlock) -> Array | None:
        """Those of the column, None where one temperature holds for all or none is known."""
        return block.values.get("temperature") if self._of_all is None else None

    def of(self, block: SampleBlock) -> Array | float | None:
        """Those of the column, or that of all samples [degC].

        Raises TableError if one of a column that counts is hardly in degC, at its line.
        """
        found = self.of_column(block)
        odd = outside_tests([] if found is None or self._calibrated is None else found)
        if found is not None and odd.any():
            problem = f"temperature {found[odd][0]:g} {NO_TEMPERATURE}"
            raise self._at(block, odd, problem, "write temperatures in degC")
        return self._of_all if found is None else found

    def refuse_others(self, block: SampleBlock, found: MeasuredAcceleration) -> None:
        """Refuse the first sample outside the calibrated range, unless these are accepted."""
        outside = found.outside_temperatures
        if self._extrapolate or not outside.any():
            return
        each = np.broadcast_to(np.asarray(self.of(block), dtype=np.float64), outside.shape)
        problem = outside_temperatures(self._calibrated, float(each[outside][0]))
        raise self._at(block, outside, problem, CALIBRATE_THERE)

    def _at(self, block: SampleBlock, samples: Mask, problem: str, remedy: str) -> TableError:
        """What is wrong with the first of some samples, at its line."""
        line = int(block.lines[int(np.argmax(samples))])
        return TableError(problem, remedy, source=self._source, line=line)


_FARTHEST = 10.0
"""Accelerations beyond so many times the tested ones may be markers of missing outputs."""

_MARKED = "have an output that looks like a marker of a missing one, such as -9999: leave it empty"

_FAR = "there the nonlinearity is extrapolated"
_WIDE = (
    f"have more than {WIDEST:g} g across the input axis, {MORE_THAN_TESTS}: write its unit, as in"
    " a_p [m/s^2], if it is not g"
)


class Accelerometer:
    """A calibrated accelerometer, an `Instrument` of a stream.

    Raises InputError if the calibration is not usable, the units do not agree, or the temperature
    or local gravity is needed and not given.
    """

    axes = ""

    def __init__(
        self, calibration: Calibration, headings: SampleHeadings, options: StreamOptions
    ) -> None:
        same = options.same_launch
        found = compensation(calibration, options.run, by=options.by, same_launch=same)
        self.assumptions, self._found = found.assumptions, found
        self._headings = headings
        self._options = options
        self.serial = found.serial
        gravity = options.local_gravity or found.local_gravity
        self.scale = acceleration_scale(options, headings, gravity)
        self.notes = list(found.notes)
        self._temperatures = SampleTemperatures(headings, options, found.temperatures)
        self.notes += self._temperatures.notes
        factor, notes = output_factor(options.output_unit, headings, found.output_unit)
        self.notes += notes
        self._factors = {"output": factor, **self._cross_factors(gravity)}

    # -- before the first sample -------------------------------------------------------------------

    def _cross_factors(self, gravity: float | None) -> dict[str, float]:
        factors = {}
        for axis in self._found.axes:
            if axis.name not in self._headings.columns:
                effect = f"{axis.delta.at_T0 * 1e3:.3g} mg for each g"
                self.notes.append(f"no column {axis.name}: it is taken as 0, an error of {effect}")
                continue
            unit = acceleration_unit(self._headings.units.get(axis.name, "g"))
            size, in_metres = unit or (1.0, False)
            if in_metres and not gravity:
                remedy = "give the gravity of the place of calibration by local_gravity=..."
                raise InputError(f"{axis.name} is in m/s^2; {remedy}")
            factors[axis.name] = size / (gravity or 1.0) if in_metres else size
        for name in {"a_p", "a_o"} & set(self._headings.columns) - set(factors):
            self.notes.append(f"column {name} is set aside: the calibration does not know its part")
        return factors

    # -- the samples -------------------------------------------------------------------------------

    def used(self, block: SampleBlock) -> Mapping[str, Array]:
        """Take outputs, accelerations across and temperatures."""
        used = {name: block.values[name] * factor for name, factor in self._factors.items()}
        warmth = self._temperatures.of_column(block)
        return used if warmth is None else {**used, "temperature": warmth}

    def measured(self, block: SampleBlock, used: Mapping[str, Array]) -> MeasuredAcceleration:
        """Turn them into accelerations; refuse temperatures outside the calibrated range."""
        self._refuse_metres(used)
        found = compensate(
            self._found,
            used["output"],
            self._temperatures.of(block),
            used.get("a_p"),
            used.get("a_o"),
            output_uncertainty=self._options.output_uncertainty,
            temperature_uncertainty=self._options.temperature_uncertainty,
        )
        self._temperatures.refuse_others(block, found)
        return found

    def _refuse_metres(self, used: Mapping[str, Array]) -> None:
        """Refuse accelerations across whose column tells no unit, and is not in g."""
        names = used.keys() & {"a_p", "a_o"} - self._headings.units.keys()
        try:
            refuse_metres(**{name: used[name] for name in names})
        except InputError as error:
            raise error.at(self._headings.source) from None

    def outside(self, used: Mapping[str, Array], found: MeasuredAcceleration) -> Mapping[str, int]:
        """Count the samples outside the calibrated temperatures and tested accelerations."""
        low, high = self._found.accelerations
        across = [np.abs(used[axis]) for axis in ("a_p", "a_o") if axis in used]
        solved = np.isfinite(found.value)
        told = {
            OTHER_TEMPERATURES: ~found.within_temperatures,
            f"are outside the tested {low:g} to {high:g} g: {_FAR}": ~found.within_accelerations,
            _WIDE: np.max(across, axis=0) > WIDEST if across else ~solved,
            _MARKED: self._marked(used, np.abs(found.value) > _FARTHEST * max(-low, high)),
        }
        return {what: int(np.sum(solved & is_so)) for what, is_so in told.items()}

    def _marked(self, used: Mapping[str, Array], far: Mask) -> Mask:
        """Samples, of some that are far off, whose output loggers write for a missing one."""
        marked: Mask = far.copy()
        marked[far] = are_markers(used["output"][far] / self._factors["output"])
        return marked


_LONG = "are longer than the tested 1 g: there the outputs are taken as linear"


class Triad:
    """A calibrated triad, an `Instrument` of a stream.

    Raises InputError if the units do not agree, the local gravity is needed and not given, or an
    option is none of this triad.
    """

    axes = AXES

    def __init__(
        self, found: TriadCalibration, headings: SampleHeadings, options: StreamOptions
    ) -> None:
        heat = options.temperature_uncertainty or None
        by = None if options.by == "laws" else options.by
        refuse_for_triad(temperature_uncertainty=heat, run=options.run, by=by)
        if found.temperature_degC is None:
            wide = options.extrapolate or None
            refuse_for_triad(temperature=options.temperature, extrapolate=wide)
        self._found = found
        self.assumptions = assumptions_of_triad(found, same_launch=options.same_launch)
        self._noise = options.output_uncertainty
        self.serial = found.serial
        gravity = options.local_gravity or found.g_local_m_s2
        self.scale = acceleration_scale(options, headings, gravity)
        self._factor, self.notes = output_factor(options.output_unit, headings, found.output_unit)
        self._temperatures = SampleTemperatures(headings, options, found.temperatures)
        self.notes += [*self._temperatures.notes, *notes_of_triad(found)]
        if found.temperature_degC is None and "temperature" in headings.columns:
            self.notes.append("column temperature is set aside: that of the calibration is unknown")

    def used(self, block: SampleBlock) -> Mapping[str, Array]:
        """Take the outputs of the channels, and temperatures where they count."""
        used = {axis: block.values[axis] * self._factor for axis in AXES}
        warmth = self._temperatures.of_column(block)
        if self._found.temperature_degC is None or warmth is None:
            return used
        return {**used, "temperature": warmth}

    def measured(self, block: SampleBlock, used: Mapping[str, Array]) -> MeasuredAcceleration:
        """Turn them into accelerations; refuse temperatures other than that of the calibration."""
        found = apply_triad(
            self._found,
            np.stack([used[axis] for axis in AXES], axis=-1),
            None if self._found.temperature_degC is None else self._temperatures.of(block),
            output_uncertainty=self._noise,
        )
        self._temperatures.refuse_others(block, found)
        return found

    def outside(self, used: Mapping[str, Array], found: MeasuredAcceleration) -> Mapping[str, int]:  # noqa: ARG002
        """Count the samples outside the calibrated temperature and beyond the tested length."""
        far = np.isfinite(found.value).all(axis=1) & ~found.within_accelerations
        return {OTHER_TEMPERATURES: int(found.outside_temperatures.sum()), _LONG: int(far.sum())}
