"""accelcal head: the errors of the head from the tables of units that were measured on it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from accelcal.cli import options as option
from accelcal.cli.deliver import deliver_picture, remark_alike
from accelcal.cli.files import JSON, Command
from accelcal.cli.forms import csv_of, deliver_result
from accelcal.escapes import visible

if TYPE_CHECKING:
    from accelcal.results.head_calibration import HeadCalibration


@click.command(cls=Command)
@option.data(many=True)
@option.output("the calibration of the head as JSON", metavar="HEAD.json", file=JSON)
@option.declared_angle(
    "--head-uncertainty",
    "G",
    "Standard uncertainty of one head position before the test [rad, or g].",
)
@option.fixture_angle
@option.picture("the errors of the positions (png, svg or pdf)")
@option.format("text", "json", "csv")
def head(
    data: Sequence[str],
    path: str | None,
    head_uncertainty: float | str | None,
    delta0: float | None,
    picture: str | None,
    form: str,
) -> None:
    """Calibrate the dividing head from the units tested on it.

    DATA are tables of one unit whose fixture was clamped on the head at several angles (column
    clamping), of several units of one stand, or both. Gives the error of each head position, what
    the readings cannot determine, and the coefficients of each unit, all from one joint fit. Use
    the result in `accelcal fit --head`.

    \b
    Examples:
      accelcal head clamped_0_and_90.csv -o head.json
      accelcal head archive/*.csv -o head.json
      accelcal fit other.csv --head head.json
    """
    from accelcal.estimate.self_calibration import calibrate_head
    from accelcal.io.tables import read_tables

    declared = {"head_uncertainty": head_uncertainty}
    records = [record for source in data for record in read_tables(source, overrides=declared)]
    remark_alike(records)
    found = calibrate_head(records, delta0=delta0)
    deliver_picture(lambda: found.plot.errors(), picture)
    deliver_result(found, path, form, lambda: _certificate(found))


def _certificate(found: HeadCalibration) -> str:
    """CSV that `accelcal.read_head` takes as a certificate."""
    told = {"head": found.head_name, "stand": found.stand_name}
    lines = [f"# {key}: {visible(name)}\n" for key, name in told.items() if name]
    names = ("angle [deg]", "error [rad]", "uncertainty [rad]")
    rows = [
        dict(zip(names, (angle, error.value, error.standard_uncertainty), strict=True))
        for angle, error in zip(found.angles_deg, found.quantities(), strict=True)
    ]
    return "".join(lines) + csv_of(rows)
