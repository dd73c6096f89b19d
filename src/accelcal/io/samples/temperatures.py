"""Temperatures of the samples of a stream, and whether the calibration is good there."""

from __future__ import annotations

import numpy as np

from accelcal.arguments.temperatures import NO_TEMPERATURE, outside_tests
from accelcal.arrays import Array, Mask
from accelcal.compensate.measured import MeasuredAcceleration
from accelcal.compensate.ranges import CALIBRATE_THERE, Range, outside_temperatures
from accelcal.errors import InputError, TableError
from accelcal.io.samples.headings import SampleHeadings
from accelcal.io.samples.reader import SampleBlock

OTHER_TEMPERATURES = "are outside the calibrated temperatures"
"""What is said of samples outside the range that were accepted."""


class SampleTemperatures:
    """Temperatures of samples: one for all, which wins, or those of a column or header line.

    Raises InputError if the calibration depends on temperature and nothing tells it.
    """

    def __init__(
        self,
        headings: SampleHeadings,
        given: float | None,
        calibrated: Range | None,
        *,
        extrapolate: bool,
    ) -> None:
        self._source = headings.source
        self._calibrated = calibrated
        self._extrapolate = extrapolate
        self.notes: list[str] = []
        in_column = "temperature" in headings.columns
        if in_column and given is not None:
            self.notes.append(f"column temperature is set aside for {given:g} degC")
        self._of_all = headings.temperature if given is None and not in_column else given
        if calibrated is None or in_column or self._of_all is not None:
            return
        if calibrated[0] < calibrated[1]:
            raise InputError(
                f"{headings.source}: no column temperature, but the calibration depends on it; give"
                " temperature=..."
            )
        self.notes.append(
            f"no temperature is given; the calibration holds at {calibrated[0]:g} degC"
        )

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
