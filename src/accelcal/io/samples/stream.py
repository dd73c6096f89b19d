"""A stream of outputs in, a stream of accelerations out, block by block."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Protocol

import numpy as np

from accelcal.arguments.kinds import shown
from accelcal.arrays import Array
from accelcal.compensate.measured import MeasuredAcceleration, columns_of
from accelcal.escapes import ESCAPED, visible
from accelcal.io.files.csv_text import needs_quotes, quoted
from accelcal.io.samples.reader import SampleBlock, SampleReader
from accelcal.version import SOFTWARE

_ALWAYS = {
    "missing": "have a value missing and get no acceleration",
    "unsolved": "have an output that no acceleration gives, and get none",
}


class Instrument(Protocol):
    """What turns samples into accelerations: a calibrated accelerometer, or a triad."""

    serial: str | None
    axes: str  # of its accelerations, empty where there is one
    scale: float  # what accelerations in g are multiplied by
    notes: list[str]  # what was understood of the stream
    assumptions: tuple[str, ...]  # what has to be assumed

    def used(self, block: SampleBlock) -> Mapping[str, Array]:
        """Take what the accelerations follow from, in the units of the calibration."""

    def measured(self, block: SampleBlock, used: Mapping[str, Array]) -> MeasuredAcceleration:
        """Turn it into accelerations [g]."""

    def outside(self, used: Mapping[str, Array], found: MeasuredAcceleration) -> Mapping[str, int]:
        """Count the samples with an acceleration outside of what was calibrated, by sentence."""


class AccelerationStream:
    """Accelerations of a stream of outputs, as CSV.

    They are in g or m/s^2; the header says about the calibration where it comes from.
    """

    def __init__(
        self, instrument: Instrument, samples: SampleReader, unit: str = "g", about: str = ""
    ) -> None:
        self._instrument = instrument
        self._samples = samples
        self._unit = unit
        self._about = about
        self._count = 0
        self._left: Counter[str] = Counter()
        self.notes = [*samples.notes, *samples.headings.notes, *instrument.notes]

    def rows(self) -> Iterator[bytes]:
        """Write the header, and then a row for each sample, as pieces of whole lines.

        Raises TableError at a cell that is no number, or a temperature that is out of range.
        """
        header = self._header()
        for block in self._samples.blocks():
            used = self._instrument.used(block)
            found = self._instrument.measured(block, used)
            self._tell(used, found)
            yield (header + self._csv(block, found)).encode(errors=ESCAPED)
            header = ""

    def _tell(self, used: Mapping[str, Array], found: MeasuredAcceleration) -> None:
        missing = np.isnan(list(used.values())).any(axis=0)
        unsolved = ~np.isfinite(found.value.reshape(missing.size, -1)).all(axis=1) & ~missing
        self._count += missing.size
        self._left["missing"] += int(missing.sum())
        self._left["unsolved"] += int(unsolved.sum())
        self._left.update(self._instrument.outside(used, found))

    def _header(self) -> str:
        unit = {"g": "g_local"}.get(self._unit, self._unit)
        lines = {
            "serial": self._instrument.serial,
            "acceleration_unit": unit,
            "calibration": self._about or None,
            "data": self._samples.source,
            "software": SOFTWARE,
        }
        told = [(key, value) for key, value in lines.items() if value is not None]
        told += [("note", note) for note in self._instrument.notes]
        told += [("warning", own) for own in self._instrument.assumptions]
        text = "".join(f"# {key}: {visible(value)}\n" for key, value in told)
        time = ["time"] if "time" in self._samples.headings.columns else []
        return text + ",".join([*time, *columns_of(self._instrument.axes), "inside"]) + "\n"

    def _csv(self, block: SampleBlock, found: MeasuredAcceleration) -> str:
        columns = [(size * self._instrument.scale).tolist() for size in found.sizes()]
        width = len(self._instrument.axes) or 1
        form = ",".join(["%.15g"] * width + ["%.3g"] * (2 * width) + ["%d\n"])
        columns.append(found.inside.tolist())
        if block.time is None:
            return "".join(map(form.__mod__, zip(*columns, strict=True)))
        time = map(quoted, block.time) if needs_quotes("".join(block.time)) else block.time
        return "".join(map(("%s," + form).__mod__, zip(time, *columns, strict=True)))

    def remarks(self) -> list[str]:
        """Say how many samples were left without a value or lie outside the calibrated ranges."""
        left = [(_ALWAYS.get(what, what), count) for what, count in self._left.items() if count]
        told = [f"{count} of {self._count} samples {what}" for what, count in left]
        others = self._samples.others
        names = shown(", ".join(others))
        of_others = f"{others.total()} samples of other serials, {names}, are set aside"
        return [of_others, *told] if others else told
