"""accelcal apply: outputs to accelerations, in a stream of any length."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import IO, TYPE_CHECKING, Any, cast

import click

from accelcal.cli import options as option
from accelcal.cli.deliver import remark, standard_output
from accelcal.cli.files import CSV, Command, FileToRead, refuse_source

if TYPE_CHECKING:
    from accelcal.io.documents import ResultFile
    from accelcal.io.samples.instruments import StreamOptions
    from accelcal.io.samples.reader import SampleReader
    from accelcal.io.samples.stream import Instrument


@click.command(cls=Command)
@click.argument("calibration", type=FileToRead(), metavar="CAL.json")
@option.data()
@option.output("the accelerations as CSV", metavar="OUT.csv", file=CSV)
@option.temperature("--temperature", "DEG", "Temperature of all samples [degC].")
@option.choice(
    "--in",
    ("g", "m/s^2"),
    "Unit of the accelerations; g is local g at the place of calibration.",
    name="unit",
)
@option.gravity("Gravity at the place of calibration [m/s^2].", name="local_gravity")
@option.text("--unit", "UNIT", "Unit of the outputs in DATA.", name="output_unit")
@option.serial
@option.run
@option.mounting
@option.choice(
    "--by",
    ("laws", "levels"),
    "Coefficients by the temperature laws, or on straight lines between the levels.",
)
@option.number(
    "--output-uncertainty",
    "U",
    "Standard uncertainty of an output, its noise included [output unit].",
    default=0.0,
)
@option.degrees(
    "--temperature-uncertainty",
    "DEG",
    "Standard uncertainty of the temperatures [degC].",
    default="0",
)
@option.flag("--extrapolate", "Accept temperatures outside the calibrated range.")
@option.flag("--same-launch", "Do not include the shift from launch to launch in the uncertainty.")
@option.effects()
def apply(calibration: str, data: str, path: str | None, **options: Any) -> None:
    """Turn the outputs in DATA into accelerations, using CAL.json.

    DATA is CSV or Parquet of any length, or a sheet of a workbook, with a column output and, if
    available, temperature, time, a_p and a_o. The result has for each sample the acceleration
    along the input axis, its standard and expanded uncertainty (95 %), and a flag that says
    whether the sample is inside the calibrated ranges. The uncertainty includes the shift to a
    new launch, if the calibration has it. "-" reads standard input; without -o the result goes
    to standard output.

    With the calibration of a triad, DATA has the columns x, y and z, and the result has three
    accelerations for each sample.

    \b
    Examples:
      accelcal apply calibration.json flight.csv -o accelerations.csv
      accelcal apply triad.json imu.csv -o accelerations.csv
      accelcal apply calibration.json flight.csv.gz --in m/s^2 -o accelerations.csv.gz
      accelcal apply calibration.json flight.csv --by levels -o accelerations.csv
    """
    from accelcal.compensate.assumptions import warn_of
    from accelcal.io.documents import read_results
    from accelcal.io.samples.headings import ONE_ACCELEROMETER, TRIAD
    from accelcal.io.samples.instruments import StreamOptions
    from accelcal.io.samples.reader import open_samples
    from accelcal.io.samples.stream import AccelerationStream
    from accelcal.results.calibration import Calibration
    from accelcal.results.triad import TriadCalibration

    how = StreamOptions(**options)
    file = read_results(calibration, Calibration, TriadCalibration)
    form = TRIAD if isinstance(file.results[0], TriadCalibration) else ONE_ACCELEROMETER
    with open_samples(data, form, how.output_unit) as samples:
        instrument = _instrument(file, samples, how, path)
        about = f"{file.name}, SHA-256 {file.sha256}" + (
            ", by levels" if how.by == "levels" else ""
        )
        stream = AccelerationStream(instrument, samples, how.unit, about)
        for note in stream.notes:
            remark(f"note: {note}")
        warn_of(instrument.assumptions)
        with _destination(path) as target, _progress(samples) as show:
            for rows in stream.rows():
                target.write(rows)
                show()
    warn_of(stream.remarks())


def _instrument(
    file: ResultFile,
    samples: SampleReader,
    options: StreamOptions,
    path: str | None,
) -> Instrument:
    """Choose whose samples these are, by the serial number."""
    from accelcal.io.samples.instruments import Accelerometer, Triad
    from accelcal.results.triad import TriadCalibration

    serial = options.serial or samples.headings.serial
    calibration = file.choose(serial, options.mounting)
    refuse_source(calibration.source, path)
    samples.choose(serial or calibration.serial, options.output_unit)
    if isinstance(calibration, TriadCalibration):
        return Triad(calibration, samples.headings, options)
    return Accelerometer(calibration, samples.headings, options)


@contextmanager
def _destination(path: str | None) -> Iterator[IO[bytes]]:
    """Standard output, or a file that is written whole or not at all."""
    if path is None or path == "-":
        with standard_output() as stream:
            yield stream.buffer
        return
    from accelcal.atomic import open_atomically

    with open_atomically(path) as file:
        if not path.endswith(".gz"):
            yield file
            return
        import gzip

        with gzip.GzipFile("", "wb", compresslevel=6, fileobj=file, mtime=0) as packed:
            yield cast("IO[bytes]", packed)


@contextmanager
def _progress(samples: SampleReader) -> Iterator[Callable[[], None]]:
    """Bar on a terminal, by the part of the file that was read; none for standard input."""
    hidden = samples.size is None or sys.stderr is None or not sys.stderr.isatty()
    with click.progressbar(length=samples.size or 1, file=sys.stderr, hidden=hidden) as bar:
        yield lambda: bar.update(samples.position() - bar.pos)
