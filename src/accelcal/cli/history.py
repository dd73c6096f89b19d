"""accelcal history: a unit through its recalibrations."""

from __future__ import annotations

from collections.abc import Sequence

import click

from accelcal.cli import options as option
from accelcal.cli.deliver import deliver_picture
from accelcal.cli.files import JSON, Command, FileToRead
from accelcal.cli.forms import deliver_result
from accelcal.errors import InputError


@click.command(cls=Command)
@click.argument("results", type=FileToRead(), metavar="RESULTS...", nargs=-1, required=True)
@option.output("the history as JSON", metavar="HISTORY.json", file=JSON)
@option.text("--serial", "TEXT", "Unit to follow [default: all, a line each].")
@option.mounting
@option.temperature(
    "--temperature", "DEG", "Temperature at which to compare [degC; default: that of most dates]."
)
@option.number(
    "--alpha",
    "P",
    "A jump is named if its p-value is below this.",
    default="0.01",
    show_default=True,
)
@option.text("--due-before", "DATE", "Of all units, those last calibrated before are due.")
@option.picture("the history, or the drifts of all units (png, svg or pdf)")
@option.format("text", "json", "csv")
def history(
    results: Sequence[str],
    path: str | None,
    serial: str | None,
    mounting: str | None,
    temperature: float | None,
    alpha: float,
    due_before: str | None,
    picture: str | None,
    form: str,
) -> None:
    """Follow units through their recalibrations RESULTS.

    RESULTS are tables of accelcal batch (CSV or Parquet), documents of accelcal fit (JSON), or
    both. Gives the drift of bias and scale factor per year, with 95 % intervals that include the
    scatter from one calibration to the next, and jumps with their dates. Of several units each has
    a line, those that need attention first.

    \b
    Examples:
      accelcal history results.csv
      accelcal history results.csv --due-before 2024-01-01 --format csv
      accelcal history results.csv --serial AL-15
      accelcal history 2019.json 2021.json 2023.json --plot history.png
    """
    from accelcal.io.documents import read_entries
    from accelcal.recalibrations.fleet import fleet_history
    from accelcal.recalibrations.history import history as of_unit

    entries = read_entries(results)
    several = len({entry.serial for entry in entries}) > 1
    if serial is None and (several or due_before is not None):
        fleet = fleet_history(
            entries, mounting=mounting, temperature=temperature, alpha=alpha, due_before=due_before
        )
        deliver_picture(lambda: fleet.plot.drifts(), picture)
        deliver_result(fleet, path, form)
        return
    if due_before is not None:
        raise InputError("--due-before looks at all units; leave out --serial")
    found = of_unit(entries, serial, mounting=mounting, temperature=temperature, alpha=alpha)
    deliver_picture(lambda: found.plot.trends(), picture)
    deliver_result(found, path, form)
