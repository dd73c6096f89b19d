"""accelcal export: a calibration for those who run navigation code."""

from __future__ import annotations

import warnings

import click

from accelcal.cli.deliver import deliver, refuse_to_overwrite
from accelcal.cli.options import mounting_option, output_option, serial_option
from accelcal.errors import AccelcalWarning, InputError

__all__ = ["export"]

_FORM_OF_SUFFIX = {".h": "c", ".hpp": "c", ".yaml": "yaml", ".yml": "yaml", ".csv": "csv"}


@click.command()
@click.argument("calibration", metavar="CAL.json")
@output_option("the export", metavar="FILE.(h|yaml|csv)")
@click.option(
    "--format",
    "form",
    type=click.Choice(["c", "yaml", "csv"]),
    help="Format; by default that of the file's extension.",
)
@serial_option
@click.option("--run", metavar="TEXT", help="Export the table of this run only.")
@mounting_option
def export(
    calibration: str,
    path: str | None,
    form: str | None,
    serial: str | None,
    run: str | None,
    mounting: str | None,
) -> None:
    """Export the calibration CAL.json as a C header, YAML or CSV.

    All of them hold the coefficients with units and uncertainties, their covariance, the convention
    of signs, the calibrated ranges and where the calibration comes from. The C header (C99) has a
    function that turns an output into acceleration as "accelcal apply" does.

    \b
    Examples:
      accelcal export calibration.json -o accelerometer.h
      accelcal export calibration.json --format yaml
    """  # noqa: D301  (\b is click's mark of a paragraph that is not filled)
    from accelcal.compensate.choice import compensation
    from accelcal.export.content import export_content
    from accelcal.io.calibrations import read_calibrations

    refuse_to_overwrite([calibration], path)
    form = form or _form_of(path)
    file = read_calibrations(calibration)
    chosen = file.choose(serial, mounting)
    content = export_content(chosen, file.sha256, run)
    found = compensation(chosen, run, effects=False)
    if form == "c":
        from accelcal.export.c_header import to_c_header

        text = to_c_header(content, found)
    else:
        from accelcal.export.plain_text import to_csv, to_yaml

        text = to_yaml(content) if form == "yaml" else to_csv(content)
    for assumption in found.assumptions:
        warnings.warn(assumption, AccelcalWarning, stacklevel=2)
    deliver(text, path)


def _form_of(path: str | None) -> str:
    suffix = "." + (path or "").lower().rpartition(".")[2]
    if suffix not in _FORM_OF_SUFFIX:
        raise InputError(
            f"no format for {path or 'standard output'}; name the file .h, .yaml or .csv, or give"
            " --format"
        )
    return _FORM_OF_SUFFIX[suffix]
