"""accelcal compare: where a calibration and a record disagree."""

from __future__ import annotations

import click

from accelcal.cli.files import Command, FileToRead
from accelcal.cli.forms import deliver_forms
from accelcal.cli.options import (
    apparatus_options,
    data_argument,
    effects_option,
    format_option,
    text_option,
)


@click.command(cls=Command)
@click.argument("calibration", type=FileToRead(), metavar="CAL.json")
@data_argument()
@text_option("--serial", "TEXT", "Compare this unit only, if a file holds several.")
@click.option(
    "--same-head/--other-head",
    "same_head",
    default=None,
    help="Whether both were measured on the same head and clamping [default: as their header"
    " lines '# head: NAME' say].",
)
@effects_option
@apparatus_options
@format_option("text", "json")
def compare(
    calibration: str,
    data: str,
    serial: str | None,
    same_head: bool | None,
    form: str,
    **declared: float | str | None,
) -> None:
    """Show where the readings of DATA disagree with CAL.json.

    Nothing is fitted: the calibration, with its effects, predicts each reading. Differences that
    noise, head, launches and the uncertainty of the calibration do not explain are shown by
    position, stroke, cycle, time, temperature and run. A MODEL.json of accelcal discover holds the
    calibration with the effects that it found, and may stand in place of CAL.json.

    \b
    Examples:
      accelcal fit table.csv -o calibration.json
      accelcal compare calibration.json next-year.csv
    """
    from accelcal.discovery.new_record.compare import compare as simulate_and_compare
    from accelcal.io.documents.calibrations import read_calibrations_or_models
    from accelcal.io.documents.of_serial import records_of_serial
    from accelcal.io.tables import read_tables
    from accelcal.results.result import all_to_json

    known = read_calibrations_or_models(calibration)
    found = [
        simulate_and_compare(known.choose(serial or record.serial), record, same_head=same_head)
        for record in records_of_serial(read_tables(data, overrides=declared), serial)
    ]
    forms = {
        "text": lambda: "\n\n".join(map(str, found)),
        "json": lambda: all_to_json(found),
    }
    deliver_forms(forms, None, form)
