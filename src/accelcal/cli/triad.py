"""accelcal triad: three accelerometers in one block."""

from __future__ import annotations

import click

from accelcal.cli import options as option
from accelcal.cli.deliver import deliver_picture
from accelcal.cli.files import JSON, Command
from accelcal.cli.forms import deliver_result
from accelcal.errors import InputError


@click.command(cls=Command)
@option.data()
@option.output("the calibration as JSON", metavar="TRIAD.json", file=JSON)
@click.option(
    "--frame",
    type=click.Choice(["x", "z"]),
    help="Axis of the frame that lies along its channel's sensitive axis, x if not given (attitudes"
    " unknown).",
)
@option.local_gravity
@option.text("--unit", "UNIT", "Unit of the outputs, such as V.")
@option.text("--serial", "NAME", "Serial number of the triad.")
@option.picture("the residuals by attitude (png, svg or pdf)")
@option.format("text", "json", "csv")
def triad(
    data: str,
    path: str | None,
    frame: str | None,
    local_gravity: float | None,
    unit: str | None,
    serial: str | None,
    picture: str | None,
    form: str,
) -> None:
    """Calibrate three accelerometers in one block.

    DATA has one row for each attitude in which the block stood still: its mean outputs x, y, z. If
    the attitudes are known, also up_x, up_y, up_z (acceleration along the axes of the block, in g),
    or shaft (x, y, z, -x ...) and angle (deg). If not, only |a| = g is used, and the rotation of
    the triad stays unknown.

    \b
    Examples:
      accelcal triad examples/triad.csv
      accelcal triad attitudes.csv --g 9.8106 -o triad.json --plot residuals.png
    """
    from accelcal.io.triad import read_triad
    from accelcal.triad.calibrate import calibrate_triad

    given = {"unit": unit, "serial": serial, "local_gravity": local_gravity}
    record = read_triad(data, overrides=given)
    try:
        found = calibrate_triad(record, frame=frame)
    except InputError as error:
        raise error.at(record.source) from None
    deliver_picture(lambda: found.plot.residuals(record), picture)
    deliver_result(found, path, form)
