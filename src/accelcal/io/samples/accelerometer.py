"""Samples of one calibrated accelerometer."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.compensate.apply import compensate
from accelcal.compensate.choice import compensation
from accelcal.compensate.measured import MeasuredAcceleration
from accelcal.compensate.ranges import MORE_THAN_TESTS, WIDEST, refuse_metres
from accelcal.errors import InputError
from accelcal.io.samples.headings import SampleHeadings, acceleration_unit
from accelcal.io.samples.options import StreamOptions, acceleration_scale, output_factor
from accelcal.io.samples.reader import SampleBlock
from accelcal.io.samples.temperatures import OTHER_TEMPERATURES, SampleTemperatures
from accelcal.io.values.markers import are_markers
from accelcal.results.calibration import Calibration

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
        found = compensation(
            calibration, options.run, by=options.by, same_launch=options.same_launch
        )
        self.assumptions = found.assumptions
        self._found = found
        self._headings = headings
        self._options = options
        self.serial = found.serial
        gravity = options.local_gravity or found.local_gravity
        self.scale = acceleration_scale(options, headings, gravity)
        self.notes = list(found.notes)
        self._temperatures = SampleTemperatures(
            headings, options.temperature, found.temperatures, extrapolate=options.extrapolate
        )
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
                raise InputError(
                    f"{axis.name} is in m/s^2; give the gravity of the place of calibration"
                    " by local_gravity=..."
                )
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
