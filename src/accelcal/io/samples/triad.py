"""Samples of a calibrated triad: three outputs each, along the axes of one block."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from accelcal.arrays import Array
from accelcal.compensate.measured import MeasuredAcceleration
from accelcal.compensate.triad import apply_triad, assumptions_of_triad, refuse_for_triad
from accelcal.io.samples.headings import SampleHeadings
from accelcal.io.samples.options import StreamOptions, acceleration_scale, output_factor
from accelcal.io.samples.reader import SampleBlock
from accelcal.results.triad import AXES, TriadCalibration

__all__ = ["Triad"]

_FAR = "are longer than the tested 1 g: there the outputs are taken as linear"


class Triad:
    """A calibrated triad, see `accelcal.io.samples.stream.Instrument`.

    Parameters
    ----------
    found : TriadCalibration
        The calibration.
    headings : SampleHeadings
        What stands above the samples.
    options : StreamOptions
        How they are compensated.

    Raises
    ------
    InputError
        If the units do not agree, the local gravity is needed and not given, or an option is none
        of a triad.
    """

    axes = AXES

    def __init__(
        self, found: TriadCalibration, headings: SampleHeadings, options: StreamOptions
    ) -> None:
        refuse_for_triad(
            temperature=options.temperature,
            temperature_uncertainty=options.temperature_uncertainty or None,
            extrapolate=options.extrapolate or None,
            run=options.run,
        )
        self._found = found
        self.assumptions = assumptions_of_triad(found, same_launch=options.same_launch)
        self._noise = options.output_uncertainty
        self.serial = found.serial
        self.scale = acceleration_scale(options, options.gravity or found.local_gravity)
        self._factor, self.notes = output_factor(options.output_unit, headings, found.output_unit)

    def used(self, block: SampleBlock) -> Mapping[str, Array]:
        """Take the outputs of the channels."""
        return {axis: block.values[axis] * self._factor for axis in AXES}

    def measured(self, block: SampleBlock, used: Mapping[str, Array]) -> MeasuredAcceleration:  # noqa: ARG002
        """Turn them into accelerations."""
        output = np.stack([used[axis] for axis in AXES], axis=-1)
        return apply_triad(self._found, output, output_uncertainty=self._noise)

    def outside(self, used: Mapping[str, Array], found: MeasuredAcceleration) -> Mapping[str, int]:  # noqa: ARG002
        """Count the samples beyond the tested length."""
        return {_FAR: int(np.sum(found.within_temperatures & ~found.within_accelerations))}
