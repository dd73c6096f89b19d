"""A stream of outputs in, a stream of accelerations out, block by block."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from accelcal.apparatus import Apparatus
from accelcal.arrays import Array
from accelcal.compensate.apply import compensate
from accelcal.compensate.coefficients import CALIBRATE_THERE, Compensation
from accelcal.compensate.measured import MeasuredAcceleration
from accelcal.errors import InputError, TableError
from accelcal.escapes import ESCAPED
from accelcal.io.csv_text import needs_quotes, quoted
from accelcal.io.output_unit import notes_of_unit
from accelcal.io.samples.headings import in_metres
from accelcal.io.samples.reader import SampleBlock, SampleReader
from accelcal.units import canonical_unit, conversion_factor
from accelcal.version import SOFTWARE

__all__ = ["AccelerationStream", "StreamOptions"]

_WIDEST = 2.0
"""Accelerations across beyond it were hardly meant in g [g]."""


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
    gravity : float or None
        Gravity where it was calibrated; None takes that of the calibration [m/s^2].
    output_uncertainty : float
        Standard uncertainty of an output [output unit of the calibration].
    temperature_uncertainty : float
        Standard uncertainty of a temperature [degC].
    extrapolate : bool
        Whether temperatures outside the calibrated range are accepted.
    """

    temperature: float | None = None
    output_unit: str | None = None
    unit: str = "g"
    gravity: float | None = None
    output_uncertainty: float = 0.0
    temperature_uncertainty: float = 0.0
    extrapolate: bool = False


class AccelerationStream:
    """Accelerations of a stream of outputs, as CSV.

    Parameters
    ----------
    found : Compensation
        The coefficients.
    samples : SampleReader
        The stream of outputs.
    options : StreamOptions
        How it is compensated.
    about : str
        Where the calibration comes from, for the header.

    Attributes
    ----------
    notes : list of str
        What was understood of the stream.

    Raises
    ------
    InputError
        If the units do not agree, or the temperature or local gravity is needed and not given.
    """

    def __init__(
        self, found: Compensation, samples: SampleReader, options: StreamOptions, about: str = ""
    ) -> None:
        self._found = found
        self._samples = samples
        self._options = options
        self._about = about
        self.notes: list[str] = [*samples.notes, *samples.headings.notes]
        self._counts = dict.fromkeys(
            ("samples", "missing", "unsolved", "cold or hot", "far", "wide"), 0
        )
        Apparatus(local_gravity=options.gravity)  # refuses what is found nowhere on Earth
        gravity = options.gravity or found.local_gravity
        if options.unit != "g" and not gravity:
            raise InputError(
                "m/s^2 needs the gravity of the place of calibration; give it by gravity=..., or"
                " stay with g"
            )
        self._scale = 1.0 if options.unit == "g" or gravity is None else gravity
        self._temperature = self._constant_temperature()
        self._factors = {"output": self._output_factor(), **self._cross_factors(gravity)}

    # -- before the first sample -------------------------------------------------------------------

    def _output_factor(self) -> float:
        given, wanted = self._options.output_unit, self._found.output_unit
        own = self._samples.headings.units.get("output")
        if given and own:
            self.notes += notes_of_unit(canonical_unit(given), [own])
        given = given or own
        if given is None or wanted is None:
            missing, other = ("stream", wanted) if given is None else ("calibration", given)
            if other is not None:
                self.notes.append(f"the {missing} names no unit; outputs are taken as {other}")
            return 1.0
        factor = conversion_factor(given, wanted)
        if factor is None:
            raise InputError(
                f"{self._samples.source}: outputs in {given}, but the calibration is for {wanted};"
                " give the outputs in its unit"
            )
        if factor != 1.0:
            self.notes.append(f"outputs in {given} are converted to {wanted}")
        return factor

    def _cross_factors(self, gravity: float | None) -> dict[str, float]:
        factors = {}
        for axis in self._found.axes:
            if axis.name not in self._samples.headings.columns:
                effect = f"{axis.delta.at_T0 * 1e3:.3g} mg for each g"
                self.notes.append(f"no column {axis.name}: it is taken as 0, an error of {effect}")
                continue
            factors[axis.name] = 1.0
            if in_metres(self._samples.headings.units.get(axis.name, "g")):
                if not gravity:
                    raise InputError(
                        f"{axis.name} is in m/s^2; give the gravity of the place of calibration"
                        " by gravity=..."
                    )
                factors[axis.name] = 1.0 / gravity
        for name in {"a_p", "a_o"} & set(self._samples.headings.columns) - set(factors):
            self.notes.append(f"column {name} is set aside: the calibration does not know its part")
        return factors

    def _constant_temperature(self) -> float | None:
        """Temperature of all samples; None where a column tells it, or nobody does."""
        given = self._options.temperature
        if "temperature" in self._samples.headings.columns:
            if given is not None:
                self.notes.append(f"column temperature is set aside for {given:g} degC")
            return given
        given = self._samples.headings.temperature if given is None else given
        if given is not None:
            return given
        if self._found.several_levels:
            raise InputError(
                f"{self._samples.source}: no column temperature, but the calibration depends on it;"
                " give temperature=..."
            )
        if self._found.temperatures is not None:
            level = self._found.temperatures[0]
            self.notes.append(f"no temperature is given; the calibration holds at {level:g} degC")
        return None

    # -- the samples -------------------------------------------------------------------------------

    def rows(self) -> Iterator[bytes]:
        """Write the header, and then a row for each sample.

        Yields
        ------
        bytes
            Whole lines of CSV.

        Raises
        ------
        TableError
            At a cell that is no number, or a temperature outside the calibrated range.
        """
        header = self._header()
        for block in self._samples.blocks():
            values = dict(block.values)
            for name, factor in self._factors.items():
                values[name] = values[name] * factor
            measured = self._measured(values)
            self._refuse_other_temperatures(block, values, measured)
            self._count(values, measured)
            yield (header + self._csv(block, measured)).encode(errors=ESCAPED)
            header = ""

    def _measured(self, values: Mapping[str, Array]) -> MeasuredAcceleration:
        cross = {axis.name: values.get(axis.name) for axis in self._found.axes}
        warmth = self._temperature
        return compensate(
            self._found,
            values["output"],
            values.get("temperature") if warmth is None else warmth,
            cross.get("a_p"),
            cross.get("a_o"),
            output_uncertainty=self._options.output_uncertainty,
            temperature_uncertainty=self._options.temperature_uncertainty,
        )

    def _refuse_other_temperatures(
        self, block: SampleBlock, values: Mapping[str, Array], measured: MeasuredAcceleration
    ) -> None:
        outside = ~measured.within_temperatures & np.isfinite(measured.value)
        if self._options.extrapolate or not outside.any():
            return
        at = int(np.argmax(outside))
        warmth = self._temperature
        problem = self._found.outside_temperatures(
            float(values["temperature"][at]) if warmth is None else warmth
        )
        line = int(block.lines[at])
        raise TableError(problem, CALIBRATE_THERE, source=self._samples.source, line=line)

    def _count(self, values: Mapping[str, Array], measured: MeasuredAcceleration) -> None:
        used = [values[name] for name in self._factors]
        if self._temperature is None and "temperature" in values:
            used.append(values["temperature"])
        missing = np.isnan(used).any(axis=0)
        solved = np.isfinite(measured.value)
        self._counts["samples"] += solved.size
        self._counts["missing"] += int(missing.sum())
        self._counts["unsolved"] += int((~solved & ~missing).sum())
        self._counts["cold or hot"] += int((solved & ~measured.within_temperatures).sum())
        self._counts["far"] += int((solved & ~measured.within_accelerations).sum())
        across = [np.abs(values[axis]) for axis in ("a_p", "a_o") if axis in self._factors]
        wide = solved & (np.max(across, axis=0) > _WIDEST) if across else np.zeros(1, dtype=bool)
        self._counts["wide"] += int(wide.sum())

    def _header(self) -> str:
        unit = {"g": "g_local"}.get(self._options.unit, self._options.unit)
        lines = {
            "serial": self._found.serial,
            "acceleration_unit": unit,
            "calibration": self._about or None,
            "data": self._samples.source,
            "software": SOFTWARE,
        }
        text = "".join(f"# {key}: {value}\n" for key, value in lines.items() if value is not None)
        time = "time," if "time" in self._samples.headings.columns else ""
        return f"{text}{time}acceleration,standard_uncertainty,expanded_uncertainty,inside\n"

    def _csv(self, block: SampleBlock, measured: MeasuredAcceleration) -> str:
        sizes = (measured.value, measured.standard_uncertainty, measured.expanded_uncertainty)
        columns = [(size * self._scale).tolist() for size in sizes] + [measured.inside.tolist()]
        if block.time is None:
            return "".join(map("%.15g,%.3g,%.3g,%d\n".__mod__, zip(*columns, strict=True)))
        time = map(quoted, block.time) if needs_quotes("".join(block.time)) else block.time
        return "".join(map("%s,%.15g,%.3g,%.3g,%d\n".__mod__, zip(time, *columns, strict=True)))

    # -- after the last sample ---------------------------------------------------------------------

    def remarks(self) -> list[str]:
        """Say how many samples were left without a value or lie outside the calibrated ranges."""
        low, high = self._found.accelerations
        texts = {
            "missing": "have a value missing and get no acceleration",
            "unsolved": "have an output that no acceleration gives, and get none",
            "cold or hot": "are outside the calibrated temperatures",
            "far": f"are outside the tested {low:g} to {high:g} g: there the nonlinearity is"
            " extrapolated",
            "wide": f"have more than {_WIDEST:g} g across the input axis, more than any test on"
            " Earth: write its unit, as in a_p [m/s^2], if it is not g",
        }
        total = self._counts["samples"]
        return [
            f"{self._counts[name]} of {total} samples {text}"
            for name, text in texts.items()
            if self._counts[name]
        ]
