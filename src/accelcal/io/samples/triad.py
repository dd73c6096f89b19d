"""Samples of a calibrated triad: three outputs each, along the axes of one block."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from accelcal.arguments.axes import AXES
from accelcal.arrays import Array
from accelcal.compensate.measured import MeasuredAcceleration
from accelcal.compensate.triad import (
    apply_triad,
    assumptions_of_triad,
    notes_of_triad,
    refuse_for_triad,
)
from accelcal.io.samples.headings import SampleHeadings
from accelcal.io.samples.options import StreamOptions, acceleration_scale, output_factor
from accelcal.io.samples.reader import SampleBlock
from accelcal.io.samples.temperatures import OTHER_TEMPERATURES, SampleTemperatures
from accelcal.results.triad import TriadCalibration

_FAR = "are longer than the tested 1 g: there the outputs are taken as linear"


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
        self._temperatures = SampleTemperatures(
            headings, options.temperature, found.temperatures, extrapolate=options.extrapolate
        )
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
        return {OTHER_TEMPERATURES: int(found.outside_temperatures.sum()), _FAR: int(far.sum())}
