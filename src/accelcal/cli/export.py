"""accelcal export: a calibration for those who run navigation code."""

from __future__ import annotations

import click

from accelcal.cli import options as option
from accelcal.cli.deliver import deliver
from accelcal.cli.files import Command, FileToRead, refuse_source


@click.command(cls=Command)
@click.argument("calibration", type=FileToRead(), metavar="CAL.json")
@option.output("the export", metavar="FILE.(h|yaml|csv)")
@click.option(
    "--format",
    "form",
    type=click.Choice(["c", "yaml", "csv"]),
    help="Format [default: by the extension of the file].",
)
@option.serial
@option.run
@option.mounting
def export(
    calibration: str,
    path: str | None,
    form: str | None,
    serial: str | None,
    run: str | None,
    mounting: str | None,
) -> None:
    """Export the calibration CAL.json as a C header, YAML or CSV.

    CAL.json may be of a triad. The export has the coefficients with units and uncertainties,
    their covariance, the sign convention, the calibrated ranges and the origin of the
    calibration. The C header (C99) has a function that turns an output into an acceleration, as
    "accelcal apply" does.

    \b
    Examples:
      accelcal export calibration.json -o accelerometer.h
      accelcal export calibration.json --format yaml
      accelcal export triad.json -o triad.h
    """
    from accelcal.export.write import export_text, form_of
    from accelcal.io.documents import read_results
    from accelcal.results.calibration import Calibration
    from accelcal.results.triad import TriadCalibration

    form = form_of(path or "-", form)
    file = read_results(calibration, Calibration, TriadCalibration)
    chosen = file.choose(serial, mounting)
    refuse_source(chosen.source, path)
    deliver(export_text(chosen, form, file.sha256, run), path)
